# SPDX-License-Identifier: MIT
"""Writes the measured figures between the lines that mark them in docs/results.md, and README's picture and figures after them.

usage: results.py          the default run and the swept sine on every motor, and every fault on the first one
"""
import io
import os
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "qemu"), str(ROOT / "tests/tools"), str(ROOT / "firmware/tables"), str(ROOT / "linker/bounds")]

from launcher import simulate  # noqa: E402
from launcher.data import MOTORS, available, read_toml  # noqa: E402
from launcher.paths import SCENARIOS as SCENARIO_FILES  # noqa: E402
from launcher.plot import draw_wide  # noqa: E402
from launcher.report import value_text  # noqa: E402
from launcher.simulate import DEFAULT_MOTOR  # noqa: E402

import front  # noqa: E402
import size  # noqa: E402
import stack  # noqa: E402
from pages import replace_block  # noqa: E402

BUILD = ROOT / os.environ.get("BUILD", "build")
SCENARIOS = ("default", "current_sweep")
# column, with its condition -> scenario, figures, what each is shown with
COLUMNS = [
    ("speed error, rated load, steady: mean / largest", "default",
     ("speed error, steady, rated load, mean", "speed error, steady, rated load, largest"), ("{:.3f}", "{:.2f} %")),
    ("largest speed dip at the rated load step", "default", ("speed dip at the rated load step",), ("{:.1f} %",)),
    ("recovered to 1 % within", "default", ("recovery to 1 % from the rated load step",), ("{:.0f} ms",)),
    ("i_d error of rated, whole run: rms / largest", "default",
     ("i_d error, whole run, rms", "i_d error, whole run, largest"), ("{:.1f}", "{:.1f} %")),
    ("field angle error, electrical, whole run: mean / largest", "default",
     ("field angle error, whole run, mean", "field angle error, whole run, largest"), ("{:.1f}", "{:.1f}°")),
    ("current distortion, rated load, steady: without / with ripple", "default",
     ("current distortion without ripple, rated load", "current distortion with ripple, rated load"), ("{:.1f}", "{:.1f} %")),
    ("largest current between samples too, of i_max, whole run", "default", ("peak current, whole run",), ("{:.0f} %",)),
    ("closed loop of i_q by swept sine: -3 dB / -90° / phase margin", "current_sweep",
     ("bandwidth of i_q, -3 dB", "bandwidth of i_q, -90 degrees", "phase margin of i_q"), ("{:.0f}", "{:.0f} Hz", "{:.0f}°")),
]


def drive_table():
    """A row for each motor; where a run misses a limit, its row says so."""
    lines = ["| motor | " + " | ".join(column for column, *_ in COLUMNS) + " |", "|---|" + "---|" * len(COLUMNS)]
    for motor in available(MOTORS):
        runs = {scenario: simulate(scenario, motor=motor, out_dir=BUILD / "results" / motor / scenario)
                for scenario in SCENARIOS}
        if motor == DEFAULT_MOTOR:
            draw_wide(runs["default"], ROOT / "docs" / "run.png")
        lines.append(f"| {runs['default'].drive.motor.name} | " + " | ".join(cells(runs)) + " |")
    return "\n".join(lines) + "\n"


def cells(runs):
    """What a run that misses a limit measures is not shown but, once, what it misses."""
    missed = {scenario: next((f for f in run.figures.values() if f.passed is False), None) for scenario, run in runs.items()}
    said = set()
    for _, scenario, names, forms in COLUMNS:
        if missed[scenario]:
            yield "" if scenario in said else f"fails: {missed[scenario].name} is {value_text(missed[scenario])}"
            said.add(scenario)
        else:
            yield " / ".join(form.format(runs[scenario].figures[name].value) for name, form in zip(names, forms))


QUICKEST = {"motor": {"control": {"pwm_samples": 2, "pwm_update": 2, "current_bw_hz": 4000}},
            "inverter": {"sensor": {"shunt": 0}}}
QUICK_HZ = [50, 200, 500, 800, 1200, 1600, 2000, 2500, 3000, 3500, 4000, 5000, 6000, 7000, 8000, 9500, 11500]


def quickest():
    """The closed current loop with two samples a period and voltages that act at once: a line for results.md and README."""
    plan = {"key": "current_sweep", **read_toml(SCENARIO_FILES / "current_sweep.toml")}
    for step in plan["step"]:
        if "each" in step:
            step["each"] = {"hz": QUICK_HZ}
    run = simulate(plan, overrides=QUICKEST, aligned=True, out_dir=BUILD / "results" / "quickest")
    value = {name: figure.value for name, figure in run.figures.items()}
    return (f"{value['bandwidth of i_q, -90 degrees']:.0f} Hz at -90°, phase margin {value['phase margin of i_q']:.0f}°, on "
            f"{run.drive.motor.name}\n")


def fault_table():
    lines = ["| scenario | reported | bridge off within, PWM periods |", "|---|---|---|"]
    for path in sorted((ROOT / "qemu" / "scenarios").glob("fault_*.toml")):
        result = simulate(path.stem, out_dir=BUILD / "results" / "faults" / path.stem)
        off = result.figures.get("bridge off")
        after = str(off.value) if off and off.value is not None else "never switched on" if off is None else "not switched off"
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
    results = ROOT / "docs" / "results.md"
    replace_block(results, "drive", drive_table())
    replace_block(results, "quickest", quickest())
    replace_block(results, "faults", fault_table())
    image = str(BUILD / "mssfoc.elf")
    replace_block(results, "size", listing(lambda: (size.image_table(image), size.library_table(str(BUILD / "libmssfoc.a")))))
    replace_block(results, "stack", listing(stack.main, image, str(BUILD / "arm")))
    replace_block(results, "versions", versions())
    front.write()
    print("written: README.md, docs/results.md, docs/run.png")


if __name__ == "__main__":
    main()
