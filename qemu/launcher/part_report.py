# SPDX-License-Identifier: MIT
"""What a part of the campaign says: outcomes by motor, the worst figures with the command that repeats them, the failures."""
import json
from collections import Counter

from .parts import PARTS, play_part_case
from .paths import build_dir, shown
from .plot import draw
from .simulate import write

SHOWN = 20  # failures printed; all of them are in the file


def report_part(part, outcomes, folder, out):
    """Writes PART.md and PART.json, prints the short of it, and returns the exit status: 0 if nothing failed."""
    write(folder / f"{part}.md", as_markdown(part, outcomes))
    write(folder / f"{part}.json", json.dumps({case.key: outcome for case, outcome in outcomes.items()}, indent=1) + "\n")
    failed = {case: outcome for case, outcome in outcomes.items() if not outcome["passed"]}
    out(f"PART={part}: {len(outcomes)} runs, {len(failed)} failed")
    for line in [*counts(outcomes), "", *worst_cases(outcomes), *summary(part, outcomes)]:
        out(f"  {line}")
    for case, outcome in list(failed.items())[:SHOWN]:
        out(f"  FAIL {case.command}")
        out(f"       {outcome['outcome']}: {outcome['why']}")
    if len(failed) > SHOWN:
        out(f"  and {len(failed) - SHOWN} more")
    out(f"written: {shown(folder / f'{part}.md')} and {part}.json")
    return 1 if failed or not outcomes else 0


def report_case(case, build, qemu, out):
    """One case with everything it leaves; the exit status is its verdict's."""
    folder = build_dir(build) / "campaign" / "case"
    result, verdict = play_part_case(case, folder, build, qemu, csv=True)
    draw(result, folder / "run.png")
    out(f"{case.key}: {'PASS' if verdict.passed else 'FAIL'}, {verdict.outcome}{': ' if verdict.why else ''}{verdict.why}")
    for name, value in verdict.figures.items():
        out(f"  {name:<45} {_number(value):>10}")
    out(f"written: {shown(folder / 'trace.csv')}, console.txt and run.png")
    return 0 if verdict.passed else 1


def counts(outcomes):
    """The table of outcomes by motor, as lines; failures of all in the last column."""
    kinds = [kind for kind, _ in Counter(outcome["outcome"] for outcome in outcomes.values()).most_common()]
    lines = ["| motor | " + " | ".join(kinds) + " | failed |", "|---|" + "---|" * (len(kinds) + 1)]
    for motor in sorted({case.motor for case in outcomes}):
        own = [outcome for case, outcome in outcomes.items() if case.motor == motor]
        count = Counter(outcome["outcome"] for outcome in own)
        failed = sum(not outcome["passed"] for outcome in own)
        lines.append(f"| {motor} | " + " | ".join(str(count[kind] or "") for kind in kinds) + f" | {failed}/{len(own)} |")
    return lines


def worst_cases(outcomes):
    """Of each figure the largest magnitude, over all cases and over those that passed."""
    names = list(dict.fromkeys(name for outcome in outcomes.values() for name in outcome["figures"]))
    lines = ["| figure | worst | of those that passed | repeat the latter |", "|---|---|---|---|"]
    for name in names:
        known = [(abs(outcome["figures"][name]), case, outcome["passed"]) for case, outcome in outcomes.items()
                 if isinstance(outcome["figures"].get(name), (int, float))]
        if known:
            good = max((entry for entry in known if entry[2]), key=lambda entry: entry[0], default=(None, None, True))
            lines.append(f"| {name} | {_number(max(entry[0] for entry in known))} | {_number(good[0])} | "
                         f"{'' if good[1] is None else '`' + good[1].command + '`'} |")
    return lines


def summary(part, outcomes):
    """What the part itself has to say of all its cases, as lines."""
    own = getattr(PARTS[part], "summary", None)
    return ["", *own(list(outcomes.values()))] if own else []


def as_markdown(part, outcomes):
    """The whole of it."""
    failures = [f"- `{case.command}`: {outcome['outcome']}: {outcome['why']}" for case, outcome in outcomes.items()
                if not outcome["passed"]]
    return "\n".join([f"# PART={part}: {len(outcomes)} runs, {len(failures)} failed", "", *counts(outcomes), "",
                      *worst_cases(outcomes), *summary(part, outcomes), "", "Failures:", "", *(failures or ["none"])]) + "\n"


def _number(value):
    return "-" if value is None else f"{value:.4g}" if isinstance(value, (int, float)) else str(value)
