# SPDX-License-Identifier: MIT
"""What the drive refused: console lines that it answered with `error: ...`, and when they were typed."""
import re
from dataclasses import dataclass

import numpy as np

from .drive import preamble
from .figures import Figure
from .kinds_protection import enumerator

NAME = "refused by the drive"
NOTHING = "nothing"
_ERROR = "error: "


@dataclass
class Refusal:
    """A line that was typed and the answer to it; t_s is None where the transcript does not tell which line it was."""
    line: str
    answer: str
    t_s: float = None

    def __str__(self):
        when = "" if self.t_s is None else f" at {self.t_s:.3f} s"
        return f"'{self.line}'{when}: {self.answer}"


def typed(plan, drive):
    """[(seconds, line)] of everything that the scenario types, in order."""
    lines = [(plan.preamble_s, text) for text in preamble(drive)] if plan.preamble_s is not None else []
    lines += [(step.t_s, step.text) for step in plan.steps if step.kind == "console"]
    return lines + [(None, step.text) for step in plan.late if step.kind == "console"]


def refusals(console, lines):
    """Every Refusal of a transcript, in which each typed line is echoed after the prompt."""
    found, echoed, rest = [], None, list(lines)
    for text in console.split("\n"):
        if text.startswith("> "):
            line = text[2:].strip()
            place = next((n for n, (_, wanted) in enumerate(rest) if wanted.strip() == line), None)
            echoed = (None, line) if place is None else rest[place]
            rest = rest if place is None else rest[place + 1:]
        elif text.startswith(_ERROR):
            t_s, line = echoed or (None, "")
            found.append(Refusal(line, text[len(_ERROR):], t_s))
    return found


def judge(plan, run, lines):
    """The figure that every run has: nothing was refused but what the scenario expects, and that was."""
    found = refusals(run.console, lines)
    expected = [r for r in found if plan.expect_refusal and re.search(plan.expect_refusal, f"{r.line}: {r.answer}")]
    unexpected = [r for r in found if r not in expected]
    value = NOTHING
    if unexpected:
        value = str(unexpected[0]) + _cause(run, unexpected[0])
    elif plan.expect_refusal and not expected:
        value = f"nothing, but '{plan.expect_refusal}' was expected"
    method = "first console line that the drive refused, other than expected"
    return Figure(NAME, "refusals", value, "", method, equal=NOTHING)


def _cause(run, refusal):
    """A fault that was there before the line: then the refusal only follows from it."""
    if refusal.t_s is None:
        return ""
    t, faults = run.trace["t_s"], run.trace["fault"]
    index = min(int(np.searchsorted(t, refusal.t_s)), len(t) - 1)
    if faults[index] == 0:
        return ""
    began = index
    while began > 0 and faults[began - 1] == faults[index]:
        began -= 1
    return f" (fault {enumerator(run, 'fault', faults[index])} since {t[began]:.3f} s)"


def complaint(figures):
    """The one line to end with, or None."""
    figure = figures.get(NAME)
    return None if figure is None or figure.passed else f"the drive refused {figure.value}"
