# SPDX-License-Identifier: MIT
"""The twin's C models beside the verilated RTL, clock by clock (lockstep/lockstep.cpp), and what of the RTL that exercised.

lockstep.py PROGRAM CLOCKS [SEED]   prints what was compared and Verilator's coverage; exits 1 at the first difference, and
                                    if a line or branch was not taken
"""
import os
import re
import subprocess
import sys
from pathlib import Path

import tomllib

from places import ROOT

# what the twin has no model of: adc_benches.py simulates it against exact arithmetic
NOT_MODELLED = {"adc_modulators", "sinc3", "sinc3_comb", "adc_curve"}
POINT = re.compile(r"C '(.*)' (\d+)$")


def points(path):
    """{(module, line, what): hits} of a coverage file of Verilator."""
    hits = {}
    for line in Path(path).read_text(encoding="latin-1").split("\n"):
        match = POINT.match(line)
        if match:
            keys = dict(part.split("\x02", 1) for part in match.group(1).split("\x01") if part)
            point = (Path(keys["f"]).stem, int(keys["l"]), keys.get("o", "line"))
            hits[point] = hits.get(point, 0) + int(match.group(2))
    return hits


def coverage_lines(hits):
    modelled = {point: count for point, count in hits.items() if point[0] not in NOT_MODELLED}
    missed = sorted(point for point, count in modelled.items() if count == 0)
    yield (f"coverage: {len(modelled) - len(missed)} of {len(modelled)} lines and branches of the RTL taken; "
           f"{len(hits) - len(modelled)} more are of modulators and sensor curve, which adc_benches.py simulates")
    for module, line, what in missed:
        yield f"coverage: {module}.v:{line} not taken ({what})"


def offsets():
    """Of all registers, and of those that can be written."""
    spec = tomllib.loads((ROOT / "drivers/fabric/registers.toml").read_text(encoding="utf-8"))
    of = {spec["slot_bytes"] * block["slot"] + register["offset"]: register["access"]
          for block in spec["block"] for register in block["register"]}
    return set(of), {offset for offset, access in of.items() if access != "RO"}


def registers_line(text):
    """How many of the registers were read, and how many of those that can be were written."""
    done = [set(map(int, line.split()[2:])) for line in text.split("\n") if line.startswith("lockstep: offsets")]
    every, writable = offsets()
    return (f"registers: {len(every & done[0])} of {len(every)} read, {len(writable & done[1])} of {len(writable)} written, "
            f"{len(done[0] - every)} other words read")


def play(program, clocks, seed=1):
    """(exit code, text, coverage)"""
    folder = Path(program).parent
    data = folder / f"coverage-{os.getpid()}.dat"
    run = subprocess.run([str(program), str(seed), str(clocks), str(data)], capture_output=True, text=True)
    if run.returncode:
        return run.returncode, run.stdout + run.stderr, {}
    hits = points(data)
    data.unlink()
    return 0, run.stdout, hits


def main(arguments):
    program, clocks, seed = arguments[0], int(arguments[1]), int(arguments[2]) if len(arguments) > 2 else 1
    code, text, hits = play(program, clocks, seed)
    print("\n".join(line for line in text.strip().split("\n") if not line.startswith("lockstep: offsets")))
    if code:
        return 1
    print(registers_line(text))
    covered, *missed = coverage_lines(hits)
    print("\n".join([covered, *missed]))
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
