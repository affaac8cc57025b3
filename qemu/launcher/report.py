# SPDX-License-Identifier: MIT
"""What a person reads after a run, and the same as report.json."""
import json
import platform
import subprocess

import numpy as np

from .drive import twin_items
from .load import load_lines, load_values
from .paths import REPO
from .simulate import write


def print_report(result, out, whose="", with_load=True):
    """The report in engineering units, one line a figure; of several `whose` begins the title, and one has the core's load."""
    drive, rating = result.drive, result.drive.motor["rating"]
    out(f"{whose}{result.scenario.title}")
    out(f"  motor     {drive.motor.name}: {rating['rated_torque_nm']:g} N m, {rating['rated_current_a']:g} A peak,"
        f" {rating['rated_speed_rpm']:g} rpm, {drive.motor['electrical']['pole_pairs']} pole pairs")
    out(f"  inverter  {drive.inverter.name}, {drive.inverter['supply']['vbus_v']:g} V")
    out(f"  plant     {plant_text(drive)}")
    out(f"  run       {result.trace.rows} PWM periods, seed {result.seed}, {result.qemu.version}")
    if asked := speeds(result.scenario):
        out(f"  speed     {', '.join(asked)} rpm asked for")
    for note in drive.notes:
        out(f"  note      {note}")
    out("")
    width = max([len(name) for name in result.figures] + [10])
    for figure in result.figures.values():
        out(f"  {figure.name:<{width}}  {value_text(figure):>26}  {figure.limit_text:<24} {verdict(figure)}".rstrip())
        if figure.note:
            out(f"  {'':<{width}}  {figure.note}")
    out("")
    for line in load_lines(result.load) if with_load else []:
        out(f"  {line}")
    if with_load:
        out("")
    failed = [figure.name for figure in result.figures.values() if figure.passed is False]
    limited = sum(figure.limited for figure in result.figures.values())
    out(f"{len(failed)} of {limited} limits failed: {', '.join(failed)}" if failed else f"all {limited} limits hold")


def speeds(scenario):
    """The speeds that a scenario commands, in turn, each once."""
    said = [step.text.split() for step in scenario.steps if step.kind == "console"]
    return list(dict.fromkeys(words[-1] for words in said if words[-2:-1] == ["speed"]))


def plant_text(drive):
    """What stands behind every figure: which effects, whose values, and what the firmware was told of them."""
    values = f"tolerances times {drive.spread:g} by the seed" if drive.spread else "nominal values"
    return f"{drive.plant.text}; {values}" + (f"; the firmware is told {drive.detune}" if drive.detune else "")


def verdict(figure):
    return {True: "PASS", False: "FAIL", None: ""}[figure.passed]


def value_text(figure):
    if figure.value is None:
        return "not measured"
    if isinstance(figure.value, str):
        return figure.value
    if float(figure.value) == round(figure.value) and abs(figure.value) < 1e6:
        return f"{figure.value:.0f} {figure.unit}".strip()
    return f"{figure.value:.4g} {figure.unit}".strip()


def write_json(result, path):
    """Everything needed to judge the run or to repeat it."""
    drive = result.drive
    report = {
        "scenario": {"name": result.scenario.key, "title": result.scenario.title, "end_s": result.scenario.end_s},
        "seed": result.seed,
        "passed": result.passed,
        "figures": [_figure(figure) for figure in result.figures.values()],
        "motor": {"key": drive.motor.key, "name": drive.motor.name, "values": drive.motor.values},
        "inverter": {"key": drive.inverter.key, "name": drive.inverter.name, "values": drive.inverter.values},
        "console_parameters": drive.params,
        "conditions": {"plant": drive.plant.text, "spread": drive.spread, "detune": drive.detune},
        "plant": dict(twin_items(drive)),
        "cpu_load": load_values(result.load),
        "versions": versions(result),
    }
    write(path, json.dumps(report, indent=2, default=_plain) + "\n")


def _figure(figure):
    limits = {key: getattr(figure, key) for key in ("min", "max", "equal") if getattr(figure, key) is not None}
    return {"name": figure.name, "kind": figure.kind, "value": figure.value, "unit": figure.unit, "limits": limits,
            "passed": figure.passed, "method": figure.method, "note": figure.note}


def _plain(value):
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(type(value).__name__)


def versions(result):
    return {"qemu": result.qemu.version, "compiler": result.symbols.producer, "mssfoc": describe(),
            "python": platform.python_version(), "numpy": np.__version__}


def describe():
    """`git describe`, or "unknown" outside a clone."""
    try:
        answer = subprocess.run(["git", "-C", str(REPO), "describe", "--always", "--dirty", "--tags"],
                                capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return "unknown"
    return answer.stdout.strip() if answer.returncode == 0 else "unknown"
