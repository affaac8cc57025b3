# SPDX-License-Identifier: MIT
"""The twin's C models beside the verilated RTL, clock by clock (lockstep/lockstep.cpp), and what of the RTL that exercised.

lockstep.py PROGRAM CLOCKS [SEED]   prints what was compared and Verilator's coverage; exits 1 at the first difference
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
    yield (f"coverage: {len(modelled) - len(missed)} of {len(modelled)} lines and branches of the RTL taken; besides "
           f"{sum(1 for point in hits if point not in modelled)} of modulators and sensor curve, which adc_benches.py simulates")
    for module, line, what in missed:
        yield f"coverage: {module}.v:{line} not taken ({what})"


def register_words():
    """How many registers the description has, and how many of them can be written."""
    blocks = tomllib.loads((ROOT / "drivers/fabric/registers.toml").read_text(encoding="utf-8"))["block"]
    registers = [register for block in blocks for register in block["register"]]
    return len(registers), sum(1 for register in registers if register["access"] != "RO")


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
    print(text, end="")
    if code:
        return 1
    print("registers: {} in the description, {} of them written".format(*register_words()))
    print("\n".join(coverage_lines(hits)))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
