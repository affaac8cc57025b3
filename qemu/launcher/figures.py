# SPDX-License-Identifier: MIT
"""The figures of a run: each [[figure]] of a scenario file is one measurement and, with a limit, one verdict.

A kind that gives several numbers (a mean and the largest deviation beside it) makes a figure of each; their limits are
written `max = { mean = 0.5, largest = 2 }`.

What cannot be asked of every motor has `only_if`, an expression over the same names, and `otherwise`, why not: where it does
not hold, the figure is measured all the same, if the run shows it, and has no limit.
"""
import math
from dataclasses import dataclass

import numpy as np

from . import kinds_columns, kinds_current, kinds_protection, kinds_speed, kinds_sweep, kinds_weakening
from .errors import LauncherError, instead
from .expression import evaluate, number

KINDS = {**kinds_speed.KINDS, **kinds_current.KINDS, **kinds_sweep.KINDS, **kinds_protection.KINDS, **kinds_columns.KINDS,
         **kinds_weakening.KINDS}


@dataclass
class Figure:
    """A measured value, its limits and whether they hold. `value` is None when it could not be measured: that fails."""
    name: str
    kind: str
    value: object
    unit: str
    method: str
    max: float = None
    min: float = None
    equal: object = None
    note: str = ""

    @property
    def limited(self):
        return self.max is not None or self.min is not None or self.equal is not None

    @property
    def passed(self):
        """True, False, or None without a limit."""
        if not self.limited:
            return None
        if self.value is None:
            return False
        if self.equal is not None:
            return self.value == self.equal
        return (self.max is None or self.value <= self.max) and (self.min is None or self.value >= self.min)

    @property
    def limit_text(self):
        if self.equal is not None:
            return f"= {self.equal}"
        low = [f">= {self.min:g}"] if self.min is not None else []
        return " and ".join(low + ([f"<= {self.max:g}"] if self.max is not None else []))


def measure(scenario, run):
    """{figure name: Figure} in the scenario's order."""
    results = {}
    for index, entry in enumerate(scenario.figures):
        where = f"scenario {scenario.key}: figure {index + 1}"
        for figure in _measure_one(dict(entry), run, where):
            if figure.name in results:
                raise LauncherError(f"{where}: the name '{figure.name}' is taken")
            results[figure.name] = figure
    return results


def _measure_one(entry, run, where):
    """The Figures of one entry, one for each part of its kind."""
    name, kind_name = entry.pop("name", None), entry.pop("kind", None)
    if not isinstance(name, str) or kind_name not in KINDS:
        raise LauncherError(f"{where}: needs a name and a kind"
                            + ("" if kind_name in KINDS else instead(str(kind_name), sorted(KINDS))))
    kind = KINDS[kind_name]
    try:
        otherwise = _why_not(entry, run.names)
        limits = _limits(entry, kind, run.names)
        unit = entry.pop("unit", kind.unit)
        values = _arguments(entry, kind, kind_name, run.names)
    except LauncherError as error:
        raise LauncherError(f"{where} ({name}): {error}") from error
    note, limits = otherwise, {} if otherwise else limits
    try:
        readings = kind.function(run, **values)
    except LauncherError as error:  # the run does not show what was to be measured: the figure fails, the others count
        readings, note = None, otherwise or str(error)
    for index, part in enumerate(kind.parts):
        value, why = _plain(readings[index] if readings is not None and len(kind.parts) > 1 else readings)
        yield Figure(f"{name}, {part}" if part else name, kind_name, value, unit, kind.method, note=note or why,
                     **{key: limit[part] for key, limit in limits.items() if part in limit})


def _why_not(entry, names):
    """Why the limits of a figure do not apply to this motor; empty if they do."""
    if ("only_if" in entry) != ("otherwise" in entry):
        raise LauncherError("'only_if' and 'otherwise' belong together")
    applies, why = entry.pop("only_if", "1 == 1"), entry.pop("otherwise", "")
    return "" if evaluate(applies, names) else f"no limit applies: {why}"


def _plain(value):
    """(value, "") as Python has it, or (None, why) of what is no number."""
    if isinstance(value, (np.floating, np.integer)):
        value = float(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None, "the trace has something there that is no number"
    return value, ""


def _limits(entry, kind, names):
    """{"max": {part: number}, ...}; a limit without a part belongs to a kind that has only one."""
    limits = {}
    for key in ("max", "min", "equal"):
        if key not in entry:
            continue
        limit = entry.pop(key)
        if not isinstance(limit, dict):
            if len(kind.parts) > 1:
                raise LauncherError(f"'{key}' needs to say of what: {{ {kind.parts[0]} = ... }}"
                                    f" (there are {', '.join(kind.parts)})")
            limit = {"": limit}
        for part in limit:
            if part not in kind.parts:
                raise LauncherError(f"'{key}' for '{part}', which this kind does not give (only {', '.join(kind.parts)})")
        limits[key] = limit if key == "equal" else {part: number(value, names) for part, value in limit.items()}
    return limits


def _arguments(entry, kind, kind_name, names):
    known = {argument.rstrip("?") for argument in kind.arguments}
    for key in entry:
        if key not in known:
            raise LauncherError(f"{kind_name} does not take '{key}'" + instead(key, sorted(known)))
    for argument in kind.arguments:
        if not argument.endswith("?") and argument not in entry:
            raise LauncherError(f"{kind_name} needs '{argument}'")
    return {key: value if key in kind.texts else number(value, names) for key, value in entry.items()}
