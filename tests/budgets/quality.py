# SPDX-License-Identifier: MIT
"""Quality of control, held as cycles are: figures of every motor on the full plant, on fixed seeds, both ways.

tests/quality.toml has what is held and why ([held.SCENARIO]), and what each motor measured when that was last agreed to
([values.MOTOR.SCENARIO]). A figure that leaves its tolerance fails in either direction: upwards the drive got worse, downwards
the budget no longer guards it. Runs that miss a limit stand in the campaign's list of expected failures, and nowhere else; a
motor's figures are those of its other seeds.

Part of a figure may be chance: where the rotor sticks differs from one start of a board to the next, and with it all that the
angle touches. So the update starts each board several times. A figure that these starts move by more than a third of its
tolerance is written as [lowest, highest], and the tolerance begins there. A test starts the board once, and if a figure leaves
its tolerance three times more: their mean decides. So one start that falls out of what eight have shown fails nothing, and a
drive that is worse by a fifth is noticed in every figure by a quarter of the motors or more (test_quality.py).
"""
import tomllib
from pathlib import Path

from launcher import LauncherError, simulate
from launcher.campaign import Case
from launcher.data import read_toml
from launcher.paths import SCENARIOS
from launcher.report import value_text

ROOT = Path(__file__).resolve().parents[2]
QUALITY = ROOT / "tests" / "quality.toml"
# {scenario: seeds to run}; a figure is the mean of the runs that keep all limits of the scenario
SEEDS = {"default": (1,), "current_sweep": (1,), "field_weakening": (1,), "overmodulation": (1,)}
# {scenario: motors}, where not all: a surface machine, an interior one and one that saturates; the campaign plays the others
MOTORS_OF = {"field_weakening": ("abb_m2bj100l", "estun_emj04apb22", "thor_pmsyrm"),
             "overmodulation": ("abb_m2bj100l", "estun_emj04apb22")}

# how much later each start of an update switches on: nothing of the drive repeats with this period
STARTS_S = tuple(start * 0.0137 for start in range(8))
DECIDING = 4  # starts, where the first has left a tolerance


def load_quality(path=QUALITY):
    with open(path, "rb") as stream:
        return tomllib.load(stream)


def is_held(motor, scenario):
    """Whether the motor's figures of a scenario are."""
    return motor in MOTORS_OF.get(scenario, (motor,))


def failure(result):
    """Why a run fails, in a few words; empty when it holds all its limits."""
    missed = [figure for figure in result.figures.values() if figure.passed is False]
    more = f", and {len(missed) - 1} more" if len(missed) > 1 else ""
    return f"{missed[0].name} is {value_text(missed[0])}, limit {missed[0].limit_text}{more}" if missed else ""


def seeds_to_run(motor, scenario, expected):
    """Where every run is known to fail, one is enough to notice that it does not any more."""
    seeds = SEEDS[scenario]
    return seeds[:1] if all(Case(motor, scenario, seed) in expected for seed in seeds) else seeds


def switched_on_later(scenario, later_s):
    """A copy of the scenario; None where it does not start a motor, but finds it started."""
    raw = read_toml(SCENARIOS / f"{scenario}.toml")
    first = raw["step"][0]
    return {"key": scenario, **raw, "step": [{**first, "t_s": first["t_s"] + later_s}, *raw["step"][1:]]} \
        if first.get("label") == "on" else None


def measure_starts(motor, scenario, names, out_dir):
    """({figure: what each start that holds its limits measured}, {Case: why a start of it fails, or nothing})."""
    measured, verdicts = measure(motor, scenario, names, out_dir)
    starts = [measured]
    for later_s in STARTS_S[1:] if switched_on_later(scenario, 0) else ():
        figures, later = measure(motor, scenario, names, out_dir, later_s=later_s)
        starts.append(figures)
        for case, why in later.items():
            verdicts[case] = verdicts[case] or (why and f"{why}, switched on {later_s:g} s later")
    return {name: [start[name] for start in starts if start.get(name) is not None] for name in names}, verdicts


def judge(motor, scenario, quality, expected, out_dir):
    """What is to be complained of, of runs and figures."""
    held, values = quality["held"][scenario], quality["values"].get(motor, {}).get(scenario, {})
    measured, verdicts = measure(motor, scenario, held, out_dir, expected)

    def found(figures):
        known = {name: value for name, value in figures.items() if value is not None or name in values}
        return list(complaints(f"{motor}/{scenario}", known, values, held))

    starts = [measured]
    if found(measured) and switched_on_later(scenario, 0):
        starts += [measure(motor, scenario, held, out_dir, expected, later_s)[0] for later_s in STARTS_S[1:DECIDING]]
    return [*verdict_of_runs(verdicts, expected), *found(mean_of_starts(starts))]


def mean_of_starts(starts):
    """{figure: mean of those that measured it}."""
    known = {name: [start[name] for start in starts if start.get(name) is not None] for name in starts[0]}
    return {name: sum(values) / len(values) if values else None for name, values in known.items()}


def measure(motor, scenario, names, out_dir, expected=(), later_s=0):
    """({figure: mean over the seeds that hold their limits}, {Case: why it fails, or nothing})."""
    results, verdicts = [], {}
    for seed in seeds_to_run(motor, scenario, expected):
        case = Case(motor, scenario, seed)
        try:
            played = switched_on_later(scenario, later_s) if later_s else scenario
            result = simulate(played, motor=motor, seed=seed, out_dir=Path(out_dir) / str(seed))
            verdicts[case] = failure(result)
            results += [] if verdicts[case] else [result]
        except LauncherError as error:
            verdicts[case] = str(error).split("\n", maxsplit=1)[0]
    return ({name: mean_of(results, name) for name in names} if results else {}), verdicts


def mean_of(results, name):
    """None when a run did not measure it, or has no such figure."""
    values = [result.figures[name].value for result in results if name in result.figures]
    numbers = [value for value in values if isinstance(value, (int, float))]
    return sum(numbers) / len(results) if len(numbers) == len(results) else None


def verdict_of_runs(verdicts, expected):
    """Complaints about runs as a whole; `expected` are the campaign's strict expected failures."""
    for case, why in verdicts.items():
        if why and case not in expected:
            yield f"{case.command} fails: {why}"
        if not why and case in expected:
            yield f"{case.command} holds its limits now: take it out of tests/campaign/expected.toml"


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


def budget_of(values, percent):
    """What several starts measured, as it is written: their mean, or [lowest, highest] where chance moves it too far."""
    mean, low, high = sum(values) / len(values), min(values), max(values)
    if max(mean - low, high - mean) <= percent / 100 / 3 * abs(mean):
        return float(f"{mean:.4g}")
    return [float(f"{low:.4g}"), float(f"{high:.4g}")]


def _compared(what, now, budget, rule):
    low, high = budget if isinstance(budget, list) else (budget, budget)
    slack = rule["percent"] / 100
    if low - slack * abs(low) <= now <= high + slack * abs(high):
        return
    near = high if now > high else low
    text = f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
    change = f"{now:.4g}, budget {text} +-{rule['percent']:g} % ({_percent(now, near)})"
    if (now > near) == (rule["better"] == "lower"):
        yield f"{what}: {change}, worse"
    else:
        yield f"{what}: {change}, better: tighten the budget"


def _percent(now, budget):
    return f"{(now / budget - 1) * 100:+.0f} %" if budget else "budget is zero"
