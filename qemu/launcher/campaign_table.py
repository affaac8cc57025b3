# SPDX-License-Identifier: MIT
"""What a campaign says: each figure's worst case with the command that repeats it, and which failures were expected."""
import collections
import csv
import io
import math
import tomllib
from dataclasses import dataclass

from .campaign import Case, parse_case
from .errors import LauncherError
from .lot import is_lot
from .paths import REPO, shown

EXCUSED = ("true reason", "not set up")  # of verdict.py
EXPECTED = REPO / "tests" / "campaign" / "expected.toml"
EXPECTED_PARTS = EXPECTED.with_name("expected_parts.toml")


@dataclass
class Row:
    """A figure of a scenario over all its cases."""
    scenario: str
    figure: str
    unit: str
    limit: str
    cases: int
    failed: int
    median: float
    worst: object
    where: Case


def load_expected(path=EXPECTED, parse=parse_case):
    """{case: cause} of the failures that are known. Each [[cause]] has a text and its cases."""
    try:
        with open(path, "rb") as file:
            raw = tomllib.load(file)
    except OSError as error:
        raise LauncherError(f"cannot read {shown(path)}: {error.strerror}") from error
    except tomllib.TOMLDecodeError as error:
        raise LauncherError(f"{shown(path)}: {error}") from error
    expected = {}
    for entry in raw.get("cause", []):
        if {*entry} - {"border"} != {"text", "cases"} or not entry["text"].strip():
            raise LauncherError(f"{shown(path)}: each [[cause]] has 'text' and 'cases', and perhaps 'border'")
        for key in entry["cases"]:
            case = parse(key)
            if case in expected:
                raise LauncherError(f"{shown(path)}: {key} stands there twice")
            expected[case] = entry["text"]
    return expected


def reasons(outcome):
    """Why a case failed, in a few words; empty when it passed."""
    if outcome["error"]:
        return outcome["error"]
    return "; ".join(f"{f['name']}: {_value(f['value'])} {f['unit']}, limit {limit_text(f)}".replace(" ,", ",")
                     for f in outcome["figures"] if f["passed"] is False)


def surprises(outcomes, expected):
    """(failures that nobody expects, expected failures that passed), as {Case: text}; each list must be empty.

    Of lots and of motors from elsewhere a true reason is no failure.
    """
    failed = {case: reasons(outcome) for case, outcome in outcomes.items()
              if outcome["passed"] is False and not (is_stranger(case) and outcome.get("word") in EXCUSED)}
    unexpected = {case: why for case, why in failed.items() if case not in expected}
    mended = {case: cause for case, cause in expected.items() if case in outcomes and case not in failed}
    return unexpected, mended


def badness(figure):
    """How near a figure is to its limit, or how far beyond: 1 is on it. Without a limit, its size."""
    value = figure["value"]
    if figure["equal"] is not None:
        return 0.0 if value == figure["equal"] else math.inf
    if value is None:
        return math.inf
    if isinstance(value, str):
        return 0.0
    beyond = [] if figure["max"] is None else [(value - figure["max"]) / (abs(figure["max"]) or 1)]
    beyond += [] if figure["min"] is None else [(figure["min"] - value) / (abs(figure["min"]) or 1)]
    return 1 + max(beyond) if beyond else abs(value)


def rows(outcomes):
    """One Row for each figure of each scenario, the worst case in it."""
    groups = {}
    for case, outcome in outcomes.items():
        for figure in outcome["figures"]:
            groups.setdefault((case.scenario, figure["name"]), []).append((case, figure))
    table = []
    for (scenario, name), entries in groups.items():
        case, worst = max(entries, key=lambda entry: badness(entry[1]))
        numbers = sorted(f["value"] for _, f in entries if isinstance(f["value"], (int, float)))
        median = numbers[len(numbers) // 2] if numbers else None
        table.append(Row(scenario, name, worst["unit"], limit_text(worst), len(entries),
                         sum(f["passed"] is False for _, f in entries), median, worst["value"], case))
    return table


def limit_text(figure):
    if figure["equal"] is not None:
        return f"= {figure['equal']}"
    low = [] if figure["min"] is None else [f">= {figure['min']:.4g}"]
    return " and ".join(low + ([] if figure["max"] is None else [f"<= {figure['max']:.4g}"]))


def _value(value):
    if value is None:
        return "not measured"
    return value if isinstance(value, str) else f"{value:.4g}"


def as_csv(table):
    """The whole table, for a spreadsheet."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["scenario", "figure", "unit", "limit", "cases", "failed", "median", "worst", "motor", "seed", "repeat"])
    for row in table:
        writer.writerow([row.scenario, row.figure, row.unit, row.limit, row.cases, row.failed,
                         "" if row.median is None else f"{row.median:.6g}", _value(row.worst), row.where.motor,
                         row.where.seed, row.where.command])
    return out.getvalue()


def as_markdown(outcomes, expected):
    """The summary a person reads: how many failed where, then the worst case of each figure that has a limit."""
    motors = sorted({case.motor for case in outcomes})
    scenarios = list(dict.fromkeys(case.scenario for case in outcomes))
    played = {case: outcome for case, outcome in outcomes.items() if outcome["passed"] is not None}
    lines = [f"# Campaign: {len(played)} runs, {sum(not o['passed'] for o in played.values())} failed", "",
             "Failed runs of all, by scenario and motor:", "",
             "| scenario | " + " | ".join(motors) + " |", "|---|" + "---|" * len(motors)]
    for scenario in scenarios:
        cells = []
        for motor in motors:
            of_cell = [o for c, o in played.items() if (c.motor, c.scenario) == (motor, scenario)]
            bad = sum(not outcome["passed"] for outcome in of_cell)
            cells.append(f"**{bad}**/{len(of_cell)}" if bad else f"0/{len(of_cell)}" if of_cell else "")
        lines.append(f"| {scenario} | " + " | ".join(cells) + " |")
    lines += ["", "Worst cases, over all motors and seeds:", "",
              "| scenario | figure | limit | failed | median | worst | repeat |", "|---|---|---|---|---|---|---|"]
    for row in rows(outcomes):
        if row.limit:
            lines.append(f"| {row.scenario} | {row.figure} | {row.limit} {row.unit} | {row.failed}/{row.cases} "
                         f"| {_value(row.median)} | {_value(row.worst)} | `{row.where.command}` |")
    lines += _verdicts(outcomes)
    lines += ["", "Failures:", ""]
    for case, outcome in outcomes.items():
        if outcome["passed"] is False:
            known = expected.get(case)
            lines.append(f"- `{case.command}`: {reasons(outcome)} ({'expected: ' + known if known else 'NOT EXPECTED'})")
    lines += ["", "What does not apply, with any seed:", ""]
    lines += [f"- {scenario}: {why}" for scenario, why in sorted(without_seeds(outcomes))]
    return "\n".join(lines) + "\n"


def is_stranger(case):
    """Whether its motor is none that is shipped."""
    return is_lot(case.motor) or case.motor.endswith(".toml")


def words(outcomes):
    """{verdict: how many cases} of strangers."""
    return collections.Counter(outcome["word"] for case, outcome in outcomes.items()
                               if is_stranger(case) and outcome.get("word"))


def _verdicts(outcomes):
    """What strangers came to, each that does not work with its cause: qemu/launcher/verdict.py."""
    if not words(outcomes):
        return []
    lots = {case: outcome for case, outcome in outcomes.items() if is_stranger(case) and outcome.get("word")}
    counts = ", ".join(f"{count} {word}" for word, count in words(lots).items())
    lines = ["", f"Motors that are not shipped: {counts}", "",
             "| case | verdict | what the drive said, or which limits failed | true of the plant |", "|---|---|---|---|"]
    for case, outcome in lots.items():
        if outcome["passed"] is False:
            cause = outcome.get("cause") or outcome["error"]
            lines.append(f"| {case.key} | {outcome['word']} | {cause} | {outcome.get('truth', '')} |")
    return lines


def without_seeds(outcomes):
    """{(scenario, reason)} of what a motor cannot play; its tolerances move no more than the reason's numbers."""
    first = {}
    for case, outcome in outcomes.items():
        if outcome["passed"] is None:
            first.setdefault((case.scenario, case.motor), outcome["error"])
    return {(scenario, why) for (scenario, _), why in first.items()}
