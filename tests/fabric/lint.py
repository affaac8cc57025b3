# SPDX-License-Identifier: MIT
"""The RTL without a warning in three tools: Verilator, Icarus and yosys. Prints one line a tool, exits 1 on a finding."""
import subprocess
import sys
import tempfile

from places import PLANT, RTL, includes

TOP = "fabric"


def commands(rtl, axes, out):
    """{tool: command}; Icarus writes `out`, which it makes executable: not a device, or root would change its mode."""
    sources = [str(path) for path in sorted(rtl.glob("*.v"))]
    return {
        "verilator": ["verilator", "--lint-only", "-Wall", "--language", "1364-2005", *includes(rtl), "--top-module",
                      TOP, f"-GAXES={axes}", str(rtl / f"{TOP}.v")],
        "iverilog": ["iverilog", "-Wall", "-g2005", *includes(rtl), f"-P{TOP}.AXES={axes}", "-o", out, "-s", TOP, *sources],
        "yosys": ["yosys", "-q", "-p", f"read_verilog {' '.join([*includes(rtl), *sources])}; "
                  f"chparam -set AXES {axes} {TOP}; hierarchy -check -top {TOP}; proc; flatten; opt_clean; check -assert"],
    }


def of_plant(out, plant=PLANT):
    """The same of the motor beside the drive."""
    sources = [str(path) for path in sorted(plant.glob("*.v"))]
    return {
        "verilator": ["verilator", "--lint-only", "-Wall", "--language", "1364-2005", *includes(plant), "--top-module", "plant",
                      str(plant / "plant.v")],
        "iverilog": ["iverilog", "-Wall", "-g2005", *includes(plant), "-o", out, "-s", "plant", *sources],
        "yosys": ["yosys", "-q", "-p", f"read_verilog {' '.join([*includes(plant), *sources])}; blackbox plant_memory; "
                  "hierarchy -check -top plant; proc; flatten; opt_clean; check -assert"],
    }


def findings(rtl=RTL):
    """[(tool, what it says)]: what a tool says at all is a finding, for one axis and for two."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for made in (commands(rtl, 1, f"{folder}/{TOP}"), commands(rtl, 2, f"{folder}/{TOP}"), of_plant(f"{folder}/plant")):
            for tool, command in made.items():
                run = subprocess.run(command, capture_output=True, text=True)
                said = [line for line in (run.stdout + run.stderr).split("\n") if line.strip() and not timescale(line)]
                if run.returncode or said:
                    found.append((tool, said[0] if said else f"exit code {run.returncode}"))
    return found


def timescale(line):
    """Icarus' note on what this RTL does on purpose, which has no delays and so no timescale; and Verilator 5.03's report."""
    return "timescale" in line or line.startswith(("- V e r i l a t i o n", "- Verilator:"))


def main():
    found = findings()
    for tool, text in found:
        print(f"lint {tool}: {text}")
    if not found:
        print("lint: no warning in verilator, iverilog, yosys; 1 axis and 2, and the plant")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
