# SPDX-License-Identifier: MIT
"""PART=identified: a drive that runs by what it has identified is as good as one that is told the data sheets' values.

WHAT is seedN: tolerances drawn by N, SPREAD 1. Three runs of one plant: identify, told nothing of motor and encoder that is
true; the default scenario by what `identify use` has made of that; and the default scenario by the nominal values. What
identify refuses has to be told: it stays nominal.

Each figure that tests/quality.toml holds is compared. Worse is what exceeds the nominal run's by more than that figure
scatters for reasons of its own (ALIKE), for the two runs differ in where their start has found the rotor.
"""
import re

from .errors import LauncherError
from .part import ON_S, PREAMBLE_S, PartCase, Setup, Verdict, first_fault
from .part_identify import PATIENCE_S, TOLD

NAME = "identified"
SEEDS = 8
SCENARIO = "default"
# figure -> (share that it may be worse by, and so much in its unit)
ALIKE = {
    "speed error, steady, no load, largest": (0.15, 0.02), "speed error, steady, rated load, largest": (0.15, 0.02),
    "speed overshoot after a ramp": (0.15, 0.1), "speed dip at the rated load step": (0.10, 0.1),
    "recovery to 1 % from the rated load step": (0.15, 1.0), "torque ripple, steady, rated load, rms": (0.10, 0.1),
    "i_d error, steady, rated load, rms": (0.10, 0.1), "i_d error, whole run, rms": (0.10, 0.1),
    "field angle error, whole run, mean": (0.10, 0.5), "field angle error, whole run, largest": (0.15, 0.5),
    "current distortion without ripple, rated load": (0.10, 0.1), "current distortion with ripple, rated load": (0.10, 0.1),
    "peak current, whole run": (0.05, 1.0),
}
STEP_S = 0.02  # from a line typed to the next


def plan(motors, options):
    """SEEDS of each motor."""
    return [PartCase(NAME, motor, f"seed{seed}") for motor in motors for seed in range(1, SEEDS + 1)]


def setup(what, drive):
    """The first run of a case, and what follows it."""
    match = re.fullmatch(r"seed(\d{1,4})", what)
    if match is None:
        raise LauncherError(f"no case '{what}' of {NAME}; there are: seed1, seed2, ...")
    told = {name: value for name, value in (TOLD | {"cross_pm": 0}).items() if name in drive.params}
    plant = {"seed": int(match.group(1)), "spread": 1}
    lines = ["identify show", "identify use", *(f"get {name}" for name in told)]
    steps = [{"t_s": ON_S, "console": "identify"}]
    for state in ("SWITCHED_ON SWITCH_ON_DISABLED", "FAULT"):
        steps += [{"t_s": 0.05 + STEP_S * n, "after_state": state, "console": line} for n, line in enumerate(lines)]
        steps += [{"t_s": 0.1 + STEP_S * len(lines), "after_state": state, "event": "end"}]
    scenario = {"key": "part", "title": f"identify, {what}", "preamble_s": PREAMBLE_S, "end_s": PATIENCE_S + 1,
                "step": [*steps, {"t_s": PATIENCE_S, "event": "end"}]}
    return Setup(scenario, None, {**plant, "overrides": {"params": told}},
                 lambda run, play: follow(run, play, told, plant))


def known_of(console, told):
    """{parameter: value} of those that `identify use` has changed from what was told; the rest it has refused."""
    used = console.rpartition("identify use")[2]
    shown = {name: int(value) for name, value in re.findall(r"^([a-z_]+) = (-?\d+)", used, re.M)}
    return {name: shown[name] for name in told if shown.get(name, told[name]) != told[name]}


def follow(run, play, told, plant):
    """The two other runs, and the comparison."""
    known = known_of(run.console, told)
    if first_fault(run) or not known:
        return Verdict(first_fault(run) or "nothing known", first_fault(run) or "identify use has changed nothing", {})
    identified = play(SCENARIO, **plant, overrides={"params": known}).figures
    nominal = play(SCENARIO, **plant).figures
    return judge(identified, nominal, known)


def judge(identified, nominal, known):
    """Each figure as good or better, and no limit of the scenario left that the nominal run keeps."""
    wrong, figures = [], {"parameters identified": len(known)}
    for name, (share, least) in ALIKE.items():
        value, usual = identified[name].value, nominal[name].value
        if value is None and usual is None:
            continue
        if value is None:
            wrong.append(f"{name}: not reached, nominal {usual:.4g} {identified[name].unit}")
            continue
        figures[f"{name}, {identified[name].unit}"] = value
        if usual is not None:
            figures[f"{name}, nominal, {identified[name].unit}"] = usual
            if value > usual * (1 + share) + least:
                wrong.append(f"{name}: {value:.4g}, nominal {usual:.4g} {identified[name].unit}")
    wrong += [f"{name}: {figure.value} is outside its limit {figure.limit_text}" for name, figure in identified.items()
              if figure.passed is False and name in nominal and nominal[name].passed]
    return Verdict("worse" if wrong else "as good", "; ".join(wrong), figures)


def summary(outcomes):
    """Lines: of each figure the mean of its ratio to the nominal one, and the largest."""
    lines = ["| figure | identified by nominal, mean | largest | compared |", "|---|---|---|---|"]
    for name in ALIKE:
        ratios = [value / outcome["figures"][usual] for outcome in outcomes for key, value in outcome["figures"].items()
                  if key.startswith(f"{name}, ") and ", nominal, " not in key
                  and outcome["figures"].get(usual := key.replace(f"{name}, ", f"{name}, nominal, "))]
        if ratios:
            lines.append(f"| {name} | {sum(ratios) / len(ratios):.3f} | {max(ratios):.3f} | {len(ratios)} |")
    return lines
