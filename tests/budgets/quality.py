# SPDX-License-Identifier: MIT
"""Quality of control, held as cycles are: figures of every motor on the full plant, on fixed seeds, both ways.

tests/quality.toml has what is held and why ([held.SCENARIO]), what each motor measured when that was last agreed to
([values.MOTOR.SCENARIO]), and which runs fail today ([fails]). A figure that leaves its tolerance fails in either direction:
upwards the drive got worse, downwards the budget no longer guards it.
"""
import tomllib
from pathlib import Path

from launcher import LauncherError, simulate
from launcher.report import value_text

ROOT = Path(__file__).resolve().parents[2]
QUALITY = ROOT / "tests" / "quality.toml"
SEEDS = (1, 2)  # each figure is its mean over these


def load_quality(path=QUALITY):
    with open(path, "rb") as stream:
        return tomllib.load(stream)


def failures(results):
    """Why the runs fail, in a line; empty when they hold all their limits."""
    missed = {result.seed: [f for f in result.figures.values() if f.passed is False] for result in results}
    return "; ".join(f"seed {seed}: {figures[0].name} is {value_text(figures[0])}, limit {figures[0].limit_text}"
                     + (f", and {len(figures) - 1} more" if len(figures) > 1 else "")
                     for seed, figures in missed.items() if figures)


def measure(motor, scenario, names, out_dir, seeds=SEEDS):
    """({figure: mean over the seeds}, why the runs fail); no figures when they do."""
    try:
        results = [simulate(scenario, motor=motor, seed=seed, out_dir=Path(out_dir) / str(seed)) for seed in seeds]
    except LauncherError as error:
        return {}, str(error).split("\n", maxsplit=1)[0]
    why = failures(results)
    if why:
        return {}, why
    return {name: mean_of(results, name) for name in names}, ""


def mean_of(results, name):
    """None when a run did not measure it, or has no such figure."""
    values = [result.figures[name].value for result in results if name in result.figures]
    numbers = [value for value in values if isinstance(value, (int, float))]
    return sum(numbers) / len(results) if len(numbers) == len(results) else None


def verdict_of_runs(key, why, fails):
    """Complaints about runs as a whole: `fails` is a list of strict expectations."""
    if why and key not in fails:
        yield f"{key} fails: {why}"
    if not why and key in fails:
        yield f"{key} holds its limits now: take it out of [fails] and measure it (tests/budgets/update_quality.py)"


def complaints(key, measured, values, held):
    """One line for each figure that is not what it was, or that nothing holds."""
    for name in sorted(set(measured) | set(values)):
        if name not in held:
            yield f"{key}: {name} has a value, but [held] does not know it"
        elif name not in values:
            yield f"{key}: {name} is {measured[name]}, without a budget in tests/quality.toml"
        elif measured.get(name) is None:
            yield f"{key}: {name} was not measured"
        else:
            yield from _compared(f"{key}: {name}", measured[name], values[name], held[name])


def _compared(what, now, budget, rule):
    allowed = rule["percent"] / 100 * abs(budget)
    if abs(now - budget) <= allowed:
        return
    change = f"{now:.4g}, budget {budget:.4g} +-{rule['percent']:g} % ({_percent(now, budget)})"
    if (now > budget) == (rule["better"] == "lower"):
        yield f"{what}: {change}, worse"
    else:
        yield f"{what}: {change}, better: tighten the budget"


def _percent(now, budget):
    return f"{(now / budget - 1) * 100:+.0f} %" if budget else "budget is zero"
