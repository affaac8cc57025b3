# SPDX-License-Identifier: MIT
"""The netlist of PWM and GATE with delays (netlist_cells.v) beside its RTL (netlist_bench.v): the gates see what the RTL says,
and never a pulse shorter than a clock or both sides at once. Prints one line a set of delays; exits 1 if they do.

netlist.py [--faults]   --faults: each fault below in a copy of the RTL must be noticed
"""
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import synthesis
from places import RTL, includes

FOLDER = Path(__file__).resolve().parent
SEEDS = range(4)    # 0: 300 ps to each input of a cell; else 100...500 ps, drawn anew
LEAST = 100         # turn-offs in each part of the bench

# (file, text, other text): no proof of clocks sees them
FAULTS = (
    ("pwm_leg", "assign high   = enable && gate_high;\n    assign low    = enable && gate_low;",
     "assign high   = enable && on && side;\n    assign low    = enable && on && !side;"),
    ("pwm_leg", "!enable || ends", "!enable"),
    ("gate", "|pins_2 || both || latched;", "|pins_2 || both || lost_now || latched;"),
)


def build(folder, rtl=RTL):
    """The simulation of the netlist of `rtl`."""
    netlist, program, copy = folder / "netlist.v", folder / "bench", folder / "copy"
    copy.mkdir()
    sources = [*sorted(rtl.glob("*.v")), FOLDER / "netlist_top.v"]
    synthesis.synthesise("bridge", copy, f"rename bridge netlist; write_verilog -noattr {netlist}", sources)
    subprocess.run(["iverilog", "-g2005", *includes(rtl), "-o", program, "-s", "bench", FOLDER / "netlist_bench.v",
                    FOLDER / "netlist_cells.v", netlist, *sources], check=True)
    return program


def play(program, seed):
    """{part of the bench: {what: count}}"""
    run = subprocess.run(["vvp", "-n", program, f"+seed={seed}"], capture_output=True, text=True, check=True)
    parts = (line.split(": ") for line in run.stdout.strip().split("\n"))
    return {part: {what: int(count) for count, what in re.findall(r"(\d+) ([a-z -]+)", text)} for part, text in parts}


def complaints(parts):
    """What a part of the bench must not have seen, and turn-offs that it should have."""
    for part, counts in parts.items():
        yield from (f"{count} {what} at {part}" for what, count in counts.items() if count and what != "turn-offs")
        if counts["turn-offs"] < LEAST:
            yield f"{counts['turn-offs']} turn-offs at {part}, too few to say anything"


def played(rtl=RTL):
    """[(seed, parts)]"""
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        program = build(Path(folder), rtl)
        return list(zip(SEEDS, pool.map(lambda seed: play(program, seed), SEEDS)))


def check():
    good = True
    for seed, parts in played():
        found = list(complaints(parts))
        good = good and not found
        turn_offs = sum(counts["turn-offs"] for counts in parts.values())
        print(f"netlist, delays {seed}: {'; '.join(found) or f'{turn_offs} turn-offs as the RTL, no more pulses'}")
    return 0 if good else 1


def noticed(fault):
    name, old, new = fault
    text = (RTL / f"{name}.v").read_text(encoding="utf-8")
    if text.count(old) != 1:
        return f"stands {text.count(old)} times in {name}.v"
    with tempfile.TemporaryDirectory() as folder:
        rtl = Path(folder) / "rtl"
        shutil.copytree(RTL, rtl)
        (rtl / f"{name}.v").write_text(text.replace(old, new), encoding="utf-8")
        seen = sum(count for _, parts in played(rtl) for counts in parts.values() for what, count in counts.items()
                   if what != "turn-offs")
    return None if seen else "SURVIVES"


def faults():
    found = [(fault, noticed(fault)) for fault in FAULTS]
    for (name, old, new), why in found:
        if why:
            print(f"netlist {name}: {old!r} -> {new!r} {why}")
    print(f"netlist: {sum(why is None for _, why in found)} of {len(found)} faults noticed")
    return 1 if any(why for _, why in found) else 0


if __name__ == "__main__":
    sys.exit(faults() if "--faults" in sys.argv else check())
