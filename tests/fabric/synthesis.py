# SPDX-License-Identifier: MIT
"""Cells and levels of logic of each block on SmartFusion2, by yosys' synth_sf2, against tests/fabric/budgets.toml.

Those are yosys 0.23's figures; where a newer yosys makes others of the same RTL, they stand beside: budgets-yosys0.52.toml.

synthesis.py [--update]       prints one line a block; exits 1 if a budget is not kept; --update writes the figures as budgets
synthesis.py --paths BLOCK    prints which registers and outputs the longest paths of a block end at, and where they begin

Levels count, from flip-flop or input to flip-flop or output, look-up tables (CFG) and carry chains entered (ARI1); `carries`
are the bits that a carry runs through on the path with most levels, which are several times faster than a level.
"""
import json
import re
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from places import ROOT, RTL, includes, sources

BUDGETS = ROOT / "tests/fabric/budgets.toml"
REFERENCE = 23
BLOCKS = ("pwm", "adc", "encoder", "gate", "sto", "apb_slave", "fabric", "two_axes", "plant")
AXES = {"two_axes": 2}        # the whole fabric with more than one
FIGURES = ("CFG", "ARI1", "SLE", "MACC", "RAM64", "levels")
BUDGETED = FIGURES[:-1]
MAPPED = ("CFG", "ARI1")       # differ by a few with the names of cells, and so with edits elsewhere; the others do not
SLACK_PERCENT, SLACK_LEAST = 5, 4
MOST_LEVELS = 6
STOPS = ("SLE", "MACC", "RAM64")
# yosys would make tables of them, and flip-flops; they have registers on both sides
MATH_BLOCKS = ("adc_multiply", "plant_multiply")
MEMORY, MEMORY_IS = "plant_memory", 2     # RAM64x18, side by side
OUTPUTS = {"Y", "S", "FCO", "Q", "product", "read_a", "read_b"}


def version():
    """n of yosys 0.n"""
    return int(re.match(r"Yosys 0\.(\d+)", subprocess.run(["yosys", "-V"], capture_output=True, text=True).stdout).group(1))


def file_of(minor):
    return BUDGETS if minor == REFERENCE else BUDGETS.with_stem(f"budgets-yosys0.{minor}")


def nearest(minor):
    """The budgets of this yosys, or of the next older one that has any."""
    known = [int(path.stem.rpartition(".")[2]) for path in BUDGETS.parent.glob("budgets-yosys0.*.toml")]
    return file_of(max((one for one in known if one <= minor), default=REFERENCE))


def bare(folder, files_of):
    """Writes files without comments: yosys names cells by their lines, and its mapping depends on the names."""
    for path in files_of:
        lines = (line.partition("//")[0].rstrip() for line in path.read_text(encoding="utf-8").split("\n"))
        (folder / path.name).write_text("".join(f"{line}\n" for line in lines if line), encoding="utf-8")
        yield str(folder / path.name)


def synthesise(block, folder, then, files_of):
    """Makes the flat netlist of a block, with which yosys does what `then` says."""
    files = " ".join([*includes(), *bare(folder, files_of)])
    axes, top = (f"chparam -set AXES {AXES[block]} fabric; ", "fabric") if block in AXES else ("", block)
    boxes = "plant_multiply plant_memory" if block == "plant" else "adc_multiply"
    script = f"read_verilog {files}; {axes}blackbox {boxes}; synth_sf2 -top {top} -noiobs; {then}"
    subprocess.run(["yosys", "-q", "-p", script], check=True, cwd=RTL)


def netlist(block, out):
    """The flat netlist of a block, as yosys' JSON."""
    synthesise(block, out.parent, f"write_json {out}", sources(block))
    return json.loads(out.read_text(encoding="utf-8"))["modules"]["fabric" if block in AXES else block]


def kind(cell):
    name = cell["type"]
    return "CFG" if name.startswith("CFG") else "MACC" if name in MATH_BLOCKS else "RAM64" if name == MEMORY else name


def cells(module):
    """{kind: count}; SLE are flip-flops, ARI1 a bit of an adder or comparator, CFG a look-up table."""
    found = Counter(kind(cell) for cell in module["cells"].values())
    found["RAM64"] *= MEMORY_IS
    return found


def drivers(module):
    """{bit: (cell, port)} of the combinational cells."""
    return {bit: (name, port) for name, cell in module["cells"].items() if kind(cell) not in STOPS
            for port, bits in cell["connections"].items() if port in OUTPUTS for bit in bits if isinstance(bit, int)}


def arrivals(module):
    """A function from a bit to (levels, carries, bit at which its path begins); recursion fails on a loop."""
    driver, known = drivers(module), {}

    def arrive(bit):
        if bit not in driver:
            return 0, 0, bit
        if bit not in known:
            name, port = driver[bit]
            cell, best = module["cells"][name], (0, 0, bit)
            for pin, bits in cell["connections"].items():
                if pin in OUTPUTS or not isinstance(bits[0], int):
                    continue
                levels, carries, begin = arrive(bits[0])
                carried = kind(cell) == "ARI1" and pin == "FCI" and port == "FCO"
                best = max(best, (levels, carries + 1, begin) if carried else (levels + 1, carries, begin))
            known[bit] = best
        return known[bit]

    sys.setrecursionlimit(20000)
    return arrive


def ends(module):
    """(name, bit) of each input of a flip-flop or math block, and of each output."""
    names = {bit: net for net, one in module["netnames"].items() if "$" not in net for bit in one["bits"]}
    for cell in module["cells"].values():
        if kind(cell) in STOPS:
            out = cell["connections"].get("Q", [None])[0]
            yield from ((f"{names.get(out, kind(cell))} {pin}", bit) for pin, bits in cell["connections"].items()
                        if pin not in OUTPUTS for bit in bits if isinstance(bit, int))
    for name, port in module["ports"].items():
        if port["direction"] == "output":
            yield from ((f"{name} out", bit) for bit in port["bits"] if isinstance(bit, int))


def longest(module):
    """(levels, bits of carry) of the path with most levels; raises RecursionError on a loop without a flip-flop."""
    arrive = arrivals(module)
    return max(arrive(bit)[:2] for _, bit in ends(module))


def paths(block):
    """One line for each register and output at which one of the longest paths of a block ends: where that begins."""
    with tempfile.TemporaryDirectory() as folder:
        module = netlist(block, Path(folder) / "netlist.json")
    names = {bit: net for net, one in module["netnames"].items() if "$" not in net for bit in one["bits"]}
    arrive, found = arrivals(module), {}
    for name, bit in ends(module):
        found[name] = max(found.get(name, (0, 0, "")), (*arrive(bit)[:2], names.get(arrive(bit)[2], "?")))
    most = max(levels for levels, _, _ in found.values())
    for name, (levels, carries, begin) in sorted(found.items()):
        if levels == most:
            yield f"paths {block}: {levels} levels ({carries} carries) from {begin} to {name}"


def measure(block):
    """{figure: number} of a block, and the carry bits of its longest path."""
    with tempfile.TemporaryDirectory() as folder:
        module = netlist(block, Path(folder) / "netlist.json")
    counts = cells(module)
    levels, carries = longest(module)
    return {**{name: counts[name] for name in FIGURES[:-1]}, "levels": levels, "carries": carries}


def complaints(block, figures, budgets):
    """One line for each figure far from its budget, and for more levels than close at 100 MHz."""
    if figures["levels"] > MOST_LEVELS:
        yield f"{block} levels: {figures['levels']}, at most {MOST_LEVELS} close at 100 MHz; see synthesis.py --paths {block}"
    if block not in budgets:
        yield f"{block} has no budget"
        return
    for name in BUDGETED:
        allowed, figure = budgets[block].get(name, 0), figures.get(name, 0)
        slack = max(SLACK_LEAST, allowed * SLACK_PERCENT // 100) if name in MAPPED else 0
        if figure > allowed + slack:
            yield f"{block} {name}: {figure}, allowed {allowed + slack}"
        elif figure < allowed - slack:
            yield f"{block} {name}: {figure}, far below its budget of {allowed}; tighten it"


def write(found, path):
    rows = [f"{block} = {{ {', '.join(f'{name} = {n}' for name in BUDGETED if (n := figures[name]) or name != 'RAM64')} }}\n"
            for block, figures in found.items()]
    path.write_text("# SPDX-License-Identifier: MIT\n"
                    "# Cells of each block, held both ways by tests/fabric/synthesis.py; `fabric`\n"
                    "# is that of one axis. Renewed by `synthesis.py --update`, with the reason in the commit.\n"
                    + "".join(rows), encoding="utf-8")


def main(arguments):
    if len(arguments) == 2 and arguments[0] == "--paths" and arguments[1] in BLOCKS:
        print("\n".join(paths(arguments[1])))
        return 0
    if arguments not in ([], ["--update"]):
        print(f"synthesis.py [--update], or --paths BLOCK with one of {', '.join(BLOCKS)}", file=sys.stderr)
        return 1
    with ThreadPoolExecutor(2) as pool:
        found = dict(zip(BLOCKS, pool.map(measure, BLOCKS)))
    for block, figures in found.items():
        print(f"synthesis {block}: " + ", ".join(f"{figures[name]} {name}" for name in FIGURES)
              + f" ({figures['carries']} carries)")
    if arguments == ["--update"]:
        write(found, file_of(version()))
    budgets = tomllib.loads(nearest(version()).read_text(encoding="utf-8"))
    lines = [line for block, figures in found.items() for line in complaints(block, figures, budgets)]
    lines += [f"{block}: a budget for something that is not there" for block in set(budgets) - set(BLOCKS)]
    for line in lines:
        print(f"synthesis: {line}")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
