# SPDX-License-Identifier: MIT
"""Measures the quality of control again and rewrites the values of tests/quality.toml; what is held and why stays.

usage: update_quality.py [MOTOR ...]     all motors, or those named; one run a processor; a quarter of an hour for all on two

Look at the difference before committing it: every value that got worse is a decision. Runs that miss a limit are named; they
belong into tests/campaign/expected.toml with their cause.
"""
import json
import os
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "qemu"), str(ROOT / "tests")]

from budgets.quality import QUALITY, budget_of, is_held, load_quality, measure_starts  # noqa: E402
from launcher.data import MOTORS, available  # noqa: E402

HEAD = """# SPDX-License-Identifier: MIT
# Quality of control on the full plant: every motor, seeds and tolerances as tests/budgets/quality.py has them. A figure that
# leaves its tolerance fails in either direction. `tests/budgets/update_quality.py` measures the values, [lowest, highest] where
# starts of the same board differ; [held] is written by hand.
"""


def _lines(table):
    width = max((len(json.dumps(name)) for name in table), default=0)
    for name, value in table.items():
        if isinstance(value, dict):
            value = "{ " + ", ".join(f"{key} = {json.dumps(entry)}" for key, entry in value.items()) + " }"
        elif isinstance(value, str):
            value = json.dumps(value)
        elif isinstance(value, list):
            value = f"[{value[0]:.4g}, {value[1]:.4g}]"
        else:
            value = f"{value:.4g}"
        yield f"{json.dumps(name):<{width}} = {value}"


def written(quality):
    """The whole file as text."""
    parts = [HEAD]
    for scenario, rows in quality["held"].items():
        parts += [f"[held.{scenario}]", *_lines(rows), ""]
    for motor, scenarios in sorted(quality["values"].items()):
        for scenario, values in scenarios.items():
            parts += [f"[values.{motor}.{scenario}]", *_lines(values), ""]
    return "\n".join(parts)


def updated(quality, motor, scenario, measured, verdicts):
    """Takes one motor's scenario over; returns lines that say what changed."""
    values = quality["values"].setdefault(motor, {})
    lines = [f"{case.key} fails: {why}" for case, why in verdicts.items() if why]
    before = values.pop(scenario, {})
    known = {name: found for name, found in measured.items() if found}
    if known:
        held = quality["held"][scenario]
        values[scenario] = {name: budget_of(found, held[name]["percent"]) for name, found in known.items()}
    return lines + [f"{motor}/{scenario}: {name}: {before.get(name)} -> {now}"
                    for name, now in values.get(scenario, {}).items() if before.get(name) != now]


def main(motors):
    quality = load_quality()
    cases = [(motor, scenario) for motor in motors or available(MOTORS) for scenario in quality["held"]
             if is_held(motor, scenario)]
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(os.cpu_count()) as pool:
        found = pool.map(lambda case: measure_starts(*case, quality["held"][case[1]], Path(folder) / "_".join(case)),
                         cases)
        for (motor, scenario), (measured, verdicts) in zip(cases, found):
            for line in updated(quality, motor, scenario, measured, verdicts):
                print(line, flush=True)
    order = list(quality["held"])
    quality["values"] = {motor: dict(sorted(rows.items(), key=lambda row: order.index(row[0])))
                         for motor, rows in quality["values"].items() if rows}
    QUALITY.write_text(written(quality))


if __name__ == "__main__":
    main(sys.argv[1:])
