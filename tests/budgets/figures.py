# SPDX-License-Identifier: MIT
"""Everything that has a budget, as {section: {row: figure}}: cycles, flash, RAM, stack; and the comparison with it.

A budget holds both ways: a figure above it fails, and so does one so far below that the budget no longer guards it. What a
harmless change moves (test_harmless.py) must do neither. The current loop's interrupt, whose code is locked in the cache, is
held to the cycle. Code that stands a few bytes further has its lines of flash elsewhere: of a step of the slow loop that
moves up to 4 %, of the scope 11. So what is OUTSIDE is held without the flash's waits, which leaves what the code itself
costs; and with all waits at their longest, in one row, the slow loop as a whole. All of it has SLACK.
"""
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "tests/tools"), str(ROOT / "firmware/tables"), str(ROOT / "linker/bounds")]
from compiler import nearest  # noqa: E402

BUDGETS = ROOT / "tests" / "budgets.toml"
AT_WORST = ("current_loop.", "handler.", "fault_raise.", "slow_loop.")
# Of the slow loop and the thread. So is the write of the compares: what the core has to end before it is any of these.
OUTSIDE = ("slow_loop.", "drive_step.", "speed_loop_", "speed_watch_", "torque_", "tuning_", "thermal_", "encoder_watch_",
           "phase_watch_", "start_learn_", "current_loop_follow", "profile_", "cogging_torque", "console.", "scope.recorder",
           "scope.sampled", "current_loop.write")
LONGEST_OF_A_RUN, LONGEST_PERCENT = "slow_loop.interrupt", 5  # which step is the longest is by the noise too
# How far a figure may lie above and below its budget: a share, or so many cycles or bytes if that is more.
SLACK_PERCENT = {"pessimistic": 5, "cycles": 0.5, "flash": 0.5, "ram": 0.5, "stack": 0.5}
SLACK_LEAST = {"cycles": 4, "pessimistic": 4, "flash": 96, "ram": 32, "stack": 16}
# And how far below where nothing may lie above.
BELOW_PERCENT, BELOW_LEAST = 5, 2


def load(path):
    with open(path, "rb") as stream:
        return tomllib.load(stream)


def load_budgets(path=BUDGETS):
    """{section: {row: {"max": n, "reason": text}}}, with the figures of the present compiler where they differ."""
    budgets = load(path)
    if nearest(path) != path:
        for section, rows in load(nearest(path)).items():
            for name, figure in rows.items():
                budgets[section][name]["max"] = figure
    return budgets


def cycles(bench):
    """The largest cycles of every row of build/bench.json; OUTSIDE, where flash does not wait."""
    return {name: row.get("cycles_without_wait", row["cycles_max"]) if name.startswith(OUTSIDE) else row["cycles_max"]
            for name, row in bench.items() if not name.startswith("_")}


def pessimistic(bench):
    """The loops' interrupts and the way to the gates, with every range at its worst end and a cold cache."""
    return {name: row["cycles_pessimistic"] for name, row in bench.items()
            if name.startswith(AT_WORST) and "cycles_pessimistic" in row}


def portable(bench):
    """Where the portable C is faster than what is shipped, on worst data: by how many cycles."""
    behind = {}
    for name, row in bench.items():
        if "portable_O2" in row:
            behind[name] = row["cycles_max"] - min(row[f"portable_{level}"]["cycles_max"] for level in ("O2", "O3"))
    return {name: cycles_more for name, cycles_more in behind.items() if cycles_more > 0}


def sizes(build):
    """(flash, RAM) bytes by room, with the sum."""
    import size

    flash, ram = defaultdict(int), defaultdict(int)
    for section, name, count in size.contributions(build / "mssfoc.map"):
        if section in size.IN_FLASH:
            flash[size.room(name)] += count
        if section in size.IN_RAM:
            ram[size.room(name)] += count
    flash["sum"], ram["sum"] = sum(flash.values()), sum(ram.values())
    return dict(flash), dict(ram)


def stacks(build):
    """Bytes of stack: each entry point's own, and both stacks with everything nested."""
    import stack

    _, found, _ = stack.worked_out(build / "mssfoc.elf", build / "arm")
    rows = {row.name: row.own for row in found.rows}
    return {**rows, "main stack": found.main, "fault stack": found.fault}


def gather(bench, build):
    flash, ram = sizes(build)
    return {"cycles": cycles(bench), "pessimistic": pessimistic(bench), "portable": portable(bench), "flash": flash, "ram": ram,
            "stack": stacks(build)}


def slack(section, name, allowed):
    """How far a figure may lie (below, above) its budget."""
    if section == "portable" or (section in ("cycles", "pessimistic") and not name.startswith(OUTSIDE)):
        return max(BELOW_LEAST, allowed * BELOW_PERCENT / 100), 0
    percent = LONGEST_PERCENT if name.startswith(LONGEST_OF_A_RUN) else SLACK_PERCENT[section]
    share = max(SLACK_LEAST[section], allowed * percent / 100)
    return share, share


def complaints(section, figures, budgets):
    """One line for each row that does not keep its budget, or has none."""
    for name in sorted(set(figures) | set(budgets)):
        if name not in budgets:
            yield f"{section} {name}: {figures[name]} without a budget in tests/budgets.toml"
        elif name not in figures:
            yield f"{section} {name}: a budget for something that is not there"
        else:
            allowed, figure = budgets[name]["max"], figures[name]
            below, above = slack(section, name, allowed)
            if figure > allowed + above:
                yield f"{section} {name}: {figure}, allowed {allowed} ({figure - allowed:+d}, slack {above:g})"
            elif figure < allowed - below:
                yield f"{section} {name}: {figure}, far below its budget of {allowed}; tighten it to {figure}"
