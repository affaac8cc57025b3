# SPDX-License-Identifier: MIT
"""Writes the measured figures into README.md and docs/results.md, between the lines that mark them, and the plot beside.

usage: results.py          runs the default and the current-step scenario on every motor, and every fault on the first
"""
import io
import os
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "qemu"), str(ROOT / "tests" / "tools")]

from launcher import simulate  # noqa: E402
from launcher.plot import draw  # noqa: E402

import size  # noqa: E402
import stack  # noqa: E402
from pages import replace_block  # noqa: E402

BUILD = ROOT / os.environ.get("BUILD", "build")
MOTORS = ["teknic_m2310p", "maxon_ec45flat", "abb_m2bj100l"]
# row of the table -> (scenario, figure, format)
ROWS = [
    ("steady speed error at rated load", "default", "steady speed error, rated load", "{:.3f} %"),
    ("speed overshoot, 0 to 1500 rpm", "default", "speed overshoot", "{:.1f} %"),
    ("dip at the rated load step", "default", "dip at the rated load step", "{:.1f} %"),
    ("recovered to 1 % within", "default", "recovery from the load step", "{:.0f} ms"),
    ("largest i_d at rated load, of rated current", "default", "i_d deviation, rated load", "{:.1f} %"),
    ("phase-current THD at rated load", "default", "phase current THD at rated load", "{:.2f} %"),
    ("peak current, of the limit", "default", "peak current", "{:.1f} %"),
    ("current loop: rise 10-90 %", "current_step", "i_q rise, 10-90 %", "{:.0f} us"),
    ("current loop: overshoot", "current_step", "i_q overshoot", "{:.1f} %"),
    ("current loop: bandwidth (-3 dB)", "current_step", "current bandwidth", "{:.0f} Hz"),
]


def drive_table():
    runs = {(m, s): simulate(s, motor=m, out_dir=BUILD / "results" / m / s) for m in MOTORS
            for s in ("default", "current_step")}
    for (motor, scenario), result in runs.items():
        if not result.passed:
            raise SystemExit(f"mssfoc: {scenario} on {motor} misses a limit; see make run")
    draw(runs[MOTORS[0], "default"], ROOT / "docs" / "run.png")
    names = [runs[m, "default"].drive.motor.name for m in MOTORS]
    lines = ["| `make run` | " + " | ".join(names) + " |", "|---|" + "---|" * len(names)]
    for label, scenario, figure, form in ROWS:
        cells = [form.format(runs[m, scenario].figures[figure].value) for m in MOTORS]
        lines.append(f"| {label} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def fault_table():
    lines = ["| scenario | reported | bridge off after |", "|---|---|---|"]
    for path in sorted((ROOT / "qemu" / "scenarios").glob("fault_*.toml")):
        result = simulate(path.stem, motor=MOTORS[0], out_dir=BUILD / "results" / "faults" / path.stem)
        off = result.figures.get("bridge off")
        after = f"{off.value * 50:.0f} us" if off and off.value is not None else "never switched on"
        lines.append(f"| {result.scenario.title.removeprefix('fault at rated load: ').removeprefix('fault: ')} | "
                     f"{result.figures['faults'].value} | {after} |")
    return "\n".join(lines) + "\n"


def listing(function, *arguments):
    out = io.StringIO()
    with redirect_stdout(out):
        function(*arguments)
    return "```text\n" + out.getvalue() + "```\n"


def versions():
    gcc = subprocess.run([os.environ.get("CROSS", "arm-none-eabi-") + "gcc", "--version"], capture_output=True, text=True,
                         check=True).stdout.split("\n")[0]
    qemu = subprocess.run([os.environ.get("QEMU", "qemu-system-arm"), "--version"], capture_output=True, text=True,
                          check=True).stdout.split("\n")[0]
    return f"{gcc}; {qemu}\n"


def main():
    table = drive_table()
    results = ROOT / "docs" / "results.md"
    replace_block(ROOT / "README.md", "drive", table)
    replace_block(results, "drive", table)
    replace_block(results, "faults", fault_table())
    image = str(BUILD / "mssfoc.elf")
    replace_block(results, "size", listing(lambda: (size.image_table(image), size.library_table(str(BUILD / "libmssfoc.a")))))
    replace_block(results, "stack", listing(stack.main, image, str(BUILD / "arm")))
    replace_block(results, "versions", versions())
    print("written: README.md, docs/results.md, docs/run.png")


if __name__ == "__main__":
    main()
