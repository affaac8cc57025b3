# SPDX-License-Identifier: MIT
"""PART=lot: motors that nobody listed, from FROM on, each with the default scenario, the slowest speed, a start, a start
without an encoder, and identify. The verdict of each is a word of verdict.py; the night's number is how many are wrong.

A number says everything: the motor, and the angle at which its rotor stands.
"""
from collections import Counter

from .campaign import Case
from .drive import load_drive
from .part import PartCase
from .verdict import NOT_SET_UP, TRUE, WORKS, WRONG

NAME = "lot"
COUNT = 200
LAST = 1000000
TURN = 137  # degrees from one lot's rotor to the next: no two in 360 alike
COLUMNS = ("default", "start", "low_speed", "sensorless", "identify")
WORDS = (WORKS, TRUE, NOT_SET_UP, WRONG)


def plan(first, count=COUNT):
    """The cases of so many lots from a number on, lot by lot: what a night leaves undone are whole lots."""
    return [case for number in range(first, min(first + count, LAST + 1)) for case in cases_of(number)]


def cases_of(number):
    """Those of one lot; start and identify are for encoders."""
    motor, angle = f"lot:{number}", number * TURN % 360
    of_all = [Case(motor, "default", 1), Case(motor, "low_speed", 1), PartCase("sensorless", motor, f"start/{angle}/free")]
    by_encoder = [PartCase("start", motor, f"free/{angle}"), PartCase("identify", motor, "seed1")]
    return of_all + (by_encoder if load_drive(motor).motor["control"]["angle_source"] == 0 else [])


def column(case):
    """Of the table."""
    return case.part if isinstance(case, PartCase) else case.scenario


def table(outcomes):
    """How many of each word, as lines."""
    lines = ["| | " + " | ".join(COLUMNS) + " | all |", "|---|" + "---|" * (len(COLUMNS) + 1)]
    count = Counter((column(case), outcome["word"]) for case, outcome in outcomes.items())
    for word in WORDS:
        cells = [count[name, word] for name in COLUMNS]
        lines.append(f"| {word} | " + " | ".join(map(str, [*cells, sum(cells)])) + " |")
    return lines


def causes(outcomes):
    """What does not work, each with what was said or found and what of it is true of the plant."""
    lines = ["| case | verdict | what the drive said, or what is wrong | true of the plant |", "|---|---|---|---|"]
    return lines + [f"| `{case.command}` | {outcome['word']} | {outcome.get('cause') or outcome.get('error') or ''} |"
                    f" {outcome.get('truth') or ''} |" for case, outcome in outcomes.items() if outcome["word"] != WORKS]


def report(outcomes, known, out):
    """(the page, exit status). Known are those wrong ones that have their cause in a list."""
    wrong = [case for case, outcome in outcomes.items() if outcome["word"] == WRONG]
    listed = [case for case in wrong if case in known]
    out(f"PART=lot: {len(outcomes)} runs, {len(wrong)} wrong ({100 * len(wrong) / max(len(outcomes), 1):.1f} %),"
        f" {len(listed)} of them listed")
    for line in table(outcomes):
        out(f"  {line}")
    page = [f"# PART=lot: {len(outcomes)} runs, {len(wrong)} wrong", "", *table(outcomes), "", *causes(outcomes)]
    return "\n".join(page) + "\n", 1 if len(wrong) > len(listed) else 0
