# SPDX-License-Identifier: MIT
"""Scenario files: what happens when, and what must hold. Everything is relative to the motor, so one serves them all.

    title = "..."            end_s = 4.7            preamble_s = 0.05     (leave out: the parameters are not typed)
    base = ["common/at_load"]      steps and figures of other files to have as well
    [[step]]   t_s = 1.3, and either   console = "speed 1500"
                               or      event = "load_nm", args = ["rated_torque_Nm"]
    [[figure]] name = "...", kind = "speed_error", ... , and limits: max = 0.5 and/or min = ..., or equal = ...

In console texts an expression in braces is replaced, `torque {0.1 * rated_current_A:.2f}`, and "@parameters" types all
`set` lines again; arguments of events and of figures may be expressions as they are. In poke and poke_rom, `&name` is the
address of a variable or function of the image and `*name` the first 16 bits of code of a function.
"""
import re
from dataclasses import dataclass

from .data import find, read_toml
from .drive import preamble
from .errors import LauncherError
from .expression import fill, number
from .paths import SCENARIOS, shown

_PHASE, _PAIR, _FLAG, _NUMBER, _WORD = "phase", "pair", "flag", "number", "word"

# event kind -> the forms of its arguments; "number|off" takes either
EVENTS = {
    "load_nm": [_NUMBER], "lock": [_FLAG], "spin_rad_s": [_NUMBER], "spin": ["off"],
    "supply_v": [_NUMBER], "supply_sinks": [_FLAG],
    "sensor_add": [_PHASE, _NUMBER], "sensor_gain": [_PHASE, _NUMBER], "sensor_offset": [_PHASE, _NUMBER],
    "sensor_stuck": [_PHASE, "number|off"], "driver_fault": [_FLAG], "short": [_PAIR, "number|off"],
    "encoder_cut": [_FLAG], "encoder_freeze": [_FLAG], "encoder_illegal": [], "encoder_slip": [_NUMBER],
    "irq_delay": [_NUMBER], "irq_block": [_FLAG], "watchdog_reset": [], "phase_open": [_PHASE, _FLAG],
    "phase_swap": ["pair|off"], "chopper": [_FLAG],
    "poke": [_WORD, _WORD], "poke_rom": [_WORD, _WORD],
}
_FORMS = {_PHASE: r"[ABC]", _PAIR: r"AB|BC|CA", "pair|off": r"AB|BC|CA|off", _FLAG: r"[01]",
          _WORD: r"[&*]?[\w.\[\]]+", "off": r"off"}


@dataclass
class Step:
    """One thing that happens: `text` is typed, or the event `kind` with `args` takes place."""
    t_s: float
    kind: str
    args: list
    text: str = ""


@dataclass
class Scenario:
    key: str
    title: str
    end_s: float
    preamble_s: float
    steps: list
    figures: list


def load_scenario(source, drive):
    """A scenario by name, path or as a dict of the same form, resolved for the drive."""
    if isinstance(source, dict):
        key, raw, where = source.get("key", "scenario"), source, "scenario"
    else:
        path = find(source, SCENARIOS, "scenario")
        key, raw, where = path.stem, read_toml(path), shown(path)
    for entry in raw:
        if entry not in ("key", "title", "end_s", "preamble_s", "base", "step", "figure"):
            raise LauncherError(f"{where}: unknown entry '{entry}'")
    names = drive.names()
    steps, figures = [], []
    for part, part_where in [*_bases(raw.get("base", []), where), (raw, where)]:
        for index, entry in enumerate(_entries(part, "step", part_where)):
            steps += _steps(entry, drive, f"{part_where}: step {index + 1}")
        figures += [dict(entry) for entry in _entries(part, "figure", part_where)]
    end_s = _seconds(raw, "end_s", names, where)
    preamble_s = _seconds(raw, "preamble_s", names, where) if "preamble_s" in raw else None
    for step in steps:
        if not 0 <= step.t_s <= end_s:
            raise LauncherError(f"{where}: a step at {step.t_s:g} s is outside 0..{end_s:g} s")
    steps.sort(key=lambda step: step.t_s)
    return Scenario(key=key, title=str(raw.get("title", key)), end_s=end_s, preamble_s=preamble_s, steps=steps,
                    figures=figures)


def _bases(names, where):
    """The contents of the base files: steps and figures only, no further bases."""
    parts = []
    for name in names if isinstance(names, list) else [names]:
        path = SCENARIOS / f"{name}.toml"
        part = read_toml(path)
        if set(part) - {"step", "figure"}:
            raise LauncherError(f"{where}: base {name} may have only [[step]] and [[figure]]")
        parts.append((part, shown(path)))
    return parts


def _entries(part, key, where):
    entries = part.get(key, [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise LauncherError(f"{where}: write [[{key}]]")
    return entries


def _seconds(raw, key, names, where):
    if key not in raw:
        raise LauncherError(f"{where}: '{key}' is missing")
    try:
        value = number(raw[key], names)
    except LauncherError as error:
        raise LauncherError(f"{where}: {key}: {error}") from error
    if not 0 <= value <= 3600:
        raise LauncherError(f"{where}: {key} {value:g} is outside 0..3600 s")
    return value


def _steps(entry, drive, where):
    """One entry is one step, but for "@parameters"."""
    if entry.get("console") == "@parameters":
        t_s = _seconds(entry, "t_s", drive.names(), where)
        return [Step(t_s, "console", [], text) for text in preamble(drive)]
    return [_step(entry, drive.names(), where)]


def _step(entry, names, where):
    unknown = set(entry) - {"t_s", "console", "event", "args", "note"}
    if unknown:
        raise LauncherError(f"{where}: unknown key '{sorted(unknown)[0]}'")
    if ("console" in entry) == ("event" in entry):
        raise LauncherError(f"{where}: give either 'console' or 'event'")
    t_s = _seconds(entry, "t_s", names, where)
    try:
        if "console" in entry:
            if not isinstance(entry["console"], str):
                raise LauncherError("console takes a text")
            text = fill(entry["console"], names)
            if not text.isprintable():
                raise LauncherError("console text must be one printable line")
            return Step(t_s, "console", [], text)
        return Step(t_s, entry["event"], event_args(entry["event"], entry.get("args", []), names))
    except LauncherError as error:
        raise LauncherError(f"{where}: {error}") from error


def event_args(kind, args, names):
    """The arguments of an event as words for the twin, checked against EVENTS."""
    if kind not in EVENTS:
        raise LauncherError(f"unknown event '{kind}' (known: {', '.join(sorted(EVENTS))})")
    forms = EVENTS[kind]
    if not isinstance(args, list) or len(args) != len(forms):
        raise LauncherError(f"event {kind} takes {len(forms)} arguments")
    return [_argument(kind, form, value, names) for form, value in zip(forms, args)]


def _argument(kind, form, value, names):
    if form == _NUMBER or (form == "number|off" and value != "off"):
        return format(number(value, names), ".9g")
    word = str(value)
    if word == "off" and form == "number|off":
        return word
    if not re.fullmatch(_FORMS[form], word):
        raise LauncherError(f"event {kind}: '{word}' is not a {form}")
    return word
