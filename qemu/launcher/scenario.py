# SPDX-License-Identifier: MIT
"""Scenario files: what happens when, and what must hold. Everything is relative to the motor, so one serves them all.

    title = "..."            end_s = "off + 0.05"         preamble_s = 0.05     (leave out: the parameters are not typed)
    watchdog_s = 0.1               the design's time-out of the watchdog; leave out: the guide's least, 32.2 s
    base = ["common/at_load"]      steps and figures of other files to have as well
    expect_refusal = "regex"       lines of the console that the drive must refuse; any other refusal fails the run
    [let]      pull_Nm = "min(rated_torque_Nm, 2)"                names for expressions that are needed more than once
    [[step]]   t_s = "up + ramp_time_s + 0.6", label = "load", and either   console = "speed {work_rpm}"
                                                               or           event = "load_nm", args = ["rated_torque_Nm"]
    [[figure]] name = "...", kind = "speed_error", ... , and limits: max = 0.5 and/or min = ..., or equal = ...

Times, arguments of events and of figures are numbers or expressions over the names of the drive (Drive.names()) and over
labels, in whatever order they are written; a label is the instant of its step, which need not do anything. In console texts
and in the title an expression in braces is replaced, `torque {0.1 * rated_current_A:.2f}`, and "@parameters" types all `set`
lines again. In poke and poke_rom, `&name` is the address of a variable or function of the image and `*name` the first 16
bits of code of a function.

theory = "weakening" or "overmodulation" adds base_rpm, weak_x, weak_rpm, weak_sag_rpm, weak_max_rpm and weak_overspeed_rpm
(weakening.py) to the names.

A step with after_state = "OPERATION_ENABLED" waits for that state, or for several in turn, "OPERATION_ENABLED READY"; its t_s
counts from there. The event "end" ends the run before end_s, which is then the latest end.

A step with a label may have hold_for = "OPERATION_ENABLED": it and all that is planned for later happen as much earlier or
later as the state is reached before or after its t_s, and its label is the instant when it was. So a start takes as long as it
takes. A second one waits for its states once the first was reached: hold_for = "FAULT OPERATION_ENABLED". A run in which a
state is never reached ends late, with failures.

A step that repeats itself has `each = { hz = [50, 100] }`, which is a name for its expressions, `every_s`, how long each
lasts, and may have `end_label`, the instant after the last.
"""
import functools
import re
from dataclasses import dataclass, field, replace

from .data import find, read_toml
from .drive import preamble
from .errors import LauncherError, instead
from .expression import fill, number
from .paths import SCENARIOS, shown
from .timeline import Timeline
from .weakening import overmodulation_names, weakening_names

HOLD_MORE = 4        # times what is planned until the last hold: then the run ends without it
LATE_STATES_MAX = 4  # as qemu/twin/config.h has it
WATCHDOG_S = (0.005, 85)  # the start takes some milliseconds; 26 bits of 1.28 us each

_PHASE, _PAIR, _FLAG, _NUMBER, _WORD, _INPUT, _HEX, _FRAME = (
    "phase", "pair", "flag", "number", "word", "input", "hex", "frame")

# event kind -> the forms of its arguments; "number|off" takes either
EVENTS = {
    "load_nm": [_NUMBER], "load_fan": [_NUMBER], "load_coulomb": [_NUMBER], "load_hoist": [_NUMBER],
    "lock": [_FLAG], "spin_rad_s": [_NUMBER], "spin": ["off"], "winding_short": [_PHASE, _NUMBER, "number|off"],
    "supply_v": [_NUMBER], "supply_sinks": [_FLAG],
    "sensor_add": [_PHASE, _NUMBER], "sensor_gain": [_PHASE, _NUMBER], "sensor_offset": [_PHASE, _NUMBER],
    "sensor_stuck": [_PHASE, "number|off"], "driver_fault": [_FLAG], "sto": [_INPUT, _FLAG],
    "short": [_PAIR, "number|off"],
    "sensor_order": ["order"], "sensor_sine": [_NUMBER, _NUMBER, _NUMBER],
    "encoder_cut": [_FLAG], "encoder_freeze": [_FLAG], "encoder_illegal": [], "encoder_slip": [_NUMBER],
    "irq_delay": [_NUMBER], "irq_block": [_FLAG], "watchdog_reset": [], "power_cut": [], "phase_open": [_PHASE, _FLAG],
    "encoder_reverse": [_FLAG], "temperature_c": ["number|off"], "phase_swap": ["pair|off"], "chopper": [_FLAG],
    "hall_open": [_PHASE, _FLAG], "hall_invert": [_PHASE, _FLAG], "hall_swap": ["pair|off"],
    "fabric_other": [_FLAG], "fabric_sealed": [_FLAG], "fabric_sealed_behind": [_WORD], "fabric_hangs": [_FLAG],
    "flash_bits": [_WORD, _WORD], "pll_lost": [_FLAG], "fabric_pll_lost": [_FLAG], "memory_error": [_FLAG], "lockup_reset": [],
    "soft_reset": [], "user_reset": [], "openocd": [], "put_back": [],
    "can": [_FRAME], "can_break": [_WORD], "can_cut": [_FLAG],
    "bus": [_HEX], "keys": [_HEX], "end": [], "poke": [_WORD, _WORD], "poke_rom": [_WORD, _WORD],
}
_FORMS = {"order": r"ABC|ACB|BAC|BCA|CAB|CBA",
          _PHASE: r"[ABC]", _INPUT: r"[AB]", _PAIR: r"AB|BC|CA", "pair|off": r"AB|BC|CA|off", _FLAG: r"[01]",
          _WORD: r"[&*]?[\w.\[\]]+", "off": r"off", _HEX: r"([0-9a-f]{2})+", _FRAME: r"[0-9a-f]{1,8}#(R|([0-9a-f]{2}){0,8})"}


@dataclass
class Step:
    """One thing that happens: `text` is typed, or the event `kind` with `args` takes place."""
    t_s: float
    kind: str
    args: list
    text: str = ""
    after: tuple = ()  # states that must be seen before, in turn; then t_s counts from there


@dataclass
class Hold:
    """Whatever is planned for t_s or later waits until the drive has been in all these states, in turn."""
    label: str
    states: tuple
    t_s: float


@dataclass
class Scenario:
    key: str
    title: str
    end_s: float
    preamble_s: float
    steps: list
    figures: list
    names: dict = field(default_factory=dict)   # of the drive and of the labels
    expect_refusal: str = ""
    late: list = field(default_factory=list)    # steps that wait for a state
    holds: list = field(default_factory=list)
    watchdog_s: float = None                    # None: as the twin has it

    @property
    def may_end_early(self):
        return bool(self.holds) or any(step.kind == "end" for step in [*self.steps, *self.late])

    def split(self):
        """(steps at fixed times, steps that wait for a state, the latest end), as the twin is to have them."""
        if not self.holds:
            return self.steps, self.late, self.end_s
        ends = [] if self.end_s is None else [Step(self.end_s, "end", [])]
        fixed, late = [], list(self.late)
        for step in [*self.steps, *ends]:
            hold = next((hold for hold in reversed(self.holds) if hold.t_s <= step.t_s), None)
            if hold is None:
                fixed.append(step)
            else:
                late.append(replace(step, t_s=step.t_s - hold.t_s, after=hold.states))
        latest_s = self.end_s and self.end_s + HOLD_MORE * self.holds[-1].t_s
        return fixed, sorted(late, key=lambda step: step.t_s), latest_s


THEORIES = {"weakening": weakening_names, "overmodulation": overmodulation_names}

_ENTRIES = ("key", "theory", "title", "end_s", "preamble_s", "watchdog_s", "base", "expect_refusal", "let", "step", "figure")
_STEP_KEYS = ("t_s", "after_state", "hold_for", "label", "each", "every_s", "end_label", "console", "event", "args", "note")


def load_scenario(source, drive, held_s=None):
    """A scenario by name, path or as a dict of the same form, resolved for the drive.

    held_s   {label: seconds} of each hold_for whose states were reached, once that is known
    """
    if isinstance(source, dict):
        key, raw, where = source.get("key", "scenario"), source, "scenario"
    else:
        path = find(source, SCENARIOS, "scenario")
        key, raw, where = path.stem, read_toml(path), shown(path)
    for entry in raw:
        if entry not in _ENTRIES:
            raise LauncherError(f"{where}: unknown entry '{entry}'" + instead(entry, _ENTRIES))
    timeline = Timeline({**drive.names(), **_theory(raw, drive, where)})
    entries, figures = [], []
    for part, part_where in [*_bases(raw.get("base", []), where), (raw, where)]:
        _let(part.get("let", {}), timeline, part_where)
        entries += [(entry, f"{part_where}: step {n + 1}") for n, entry in enumerate(_entries(part, "step", part_where))]
        figures += [dict(entry) for entry in _entries(part, "figure", part_where)]
    for entry, step_where in entries:
        _label(entry, timeline, step_where, held_s)
    steps = [step for entry, step_where in entries for step in _steps(entry, drive, timeline, step_where)]
    late = sorted((step for step in steps if step.after), key=lambda step: step.t_s)
    steps = sorted((step for step in steps if not step.after), key=lambda step: step.t_s)
    plan = Scenario(key, _text(raw.get("title", key), timeline, where), _seconds(raw, "end_s", timeline, where),
                    _seconds(raw, "preamble_s", timeline, where) if "preamble_s" in raw else None, steps, figures,
                    timeline.names, _regex(raw.get("expect_refusal", ""), where), late, _holds(entries, timeline, where),
                    _watchdog_s(raw, timeline, where))
    _check(plan, drive, where)
    return plan


def _theory(raw, drive, where):
    """What a scenario may know besides the drive's names: `theory` says of what, since it takes seconds to work out."""
    if "theory" not in raw:
        return {}
    if raw["theory"] not in THEORIES:
        raise LauncherError(f"{where}: no theory '{raw['theory']}'" + instead(str(raw["theory"]), THEORIES))
    return THEORIES[raw["theory"]](drive)


def _check(plan, drive, where):
    """What the drive could not do is said before the run, unless the scenario is there to be refused."""
    limits = {**drive.params}
    for step in [*plan.steps, *plan.late]:
        if not 0 <= step.t_s <= plan.end_s:
            raise LauncherError(f"{where}: a step at {step.t_s:g} s is outside 0..{plan.end_s:g} s")
        words = step.text.split()
        if plan.expect_refusal:
            continue
        if len(words) == 3 and words[0] == "set" and re.fullmatch(r"\d{1,9}", words[2]):
            limits[words[1]] = int(words[2])
        for command, parameter, unit, scale in (("speed", "speed_max_rpm", "rpm", 1), ("torque", "i_max_ma", "A", 1000)):
            if len(words) == 2 and words[0] == command and re.fullmatch(r"[-+]?\d{1,9}(\.\d+)?", words[1]) \
                    and abs(float(words[1])) * scale > limits[parameter]:
                raise LauncherError(f"{where}: '{step.text}' at {step.t_s:g} s is beyond {drive.motor.name}'s {parameter}:"
                                    f" {limits[parameter] / scale:g} {unit}")


def _let(table, timeline, where):
    if not isinstance(table, dict):
        raise LauncherError(f"{where}: write [let]")
    for name, value in table.items():
        timeline.define(name, functools.partial(timeline.number, value), where)


def _text(text, timeline, where):
    try:
        return fill(str(text), timeline.names)
    except LauncherError as error:
        raise LauncherError(f"{where}: {error}") from error


def _regex(text, where):
    try:
        re.compile(text)
    except (re.error, TypeError) as error:
        raise LauncherError(f"{where}: expect_refusal '{text}': {error}") from error
    return text


def _bases(names, where):
    """The contents of the base files: steps and figures only, no further bases."""
    parts = []
    for name in names if isinstance(names, list) else [names]:
        path = SCENARIOS / f"{name}.toml"
        part = read_toml(path)
        if set(part) - {"let", "step", "figure"}:
            raise LauncherError(f"{where}: base {name} may have only [let], [[step]] and [[figure]]")
        parts.append((part, shown(path)))
    return parts


def _entries(part, key, where):
    entries = part.get(key, [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise LauncherError(f"{where}: write [[{key}]]")
    return entries


def _seconds(raw, key, timeline, where):
    if key not in raw:
        raise LauncherError(f"{where}: '{key}' is missing")
    return timeline.seconds(raw[key], f"{where}: {key}")


def _watchdog_s(raw, timeline, where):
    if "watchdog_s" not in raw:
        return None
    time_s = _seconds(raw, "watchdog_s", timeline, where)
    if not WATCHDOG_S[0] <= time_s <= WATCHDOG_S[1]:
        raise LauncherError(f"{where}: watchdog_s {time_s:g} is outside {WATCHDOG_S[0]:g}..{WATCHDOG_S[1]:g} s")
    return time_s


# ---- steps ---------------------------------------------------------------------------------------------------------

def _holds(entries, timeline, where):
    """In turn; each waits for the states of those before it as well."""
    holding = [entry for entry, _ in entries if "hold_for" in entry]
    if any("label" not in entry for entry in holding):
        raise LauncherError(f"{where}: a step with hold_for needs a label")
    holds, states = [], ()
    for entry in sorted(holding, key=lambda entry: timeline.names[entry["label"]]):
        states += tuple(str(entry["hold_for"]).split())
        holds.append(Hold(entry["label"], states, timeline.names[entry["label"]]))
    if holds and not all(1 <= len(hold.states) <= LATE_STATES_MAX for hold in holds):
        raise LauncherError(f"{where}: hold_for takes one to {LATE_STATES_MAX} names of states in all")
    return holds


def _label(entry, timeline, where, held_s):
    """Makes the labels of a step known; what they are is worked out later."""
    label = entry.get("label")
    if "hold_for" in entry and label in (held_s or {}):
        timeline.define(label, lambda: held_s[label], where)
    elif "label" in entry:
        timeline.define(entry["label"], lambda: _seconds(entry, "t_s", timeline, where), where)
    if "end_label" in entry:
        timeline.define(entry["end_label"], lambda: list(_instants(entry, timeline, where))[-1][0], where)


def _instants(entry, timeline, where):
    """(seconds, {name: value}) of each time a step takes place; of one that repeats itself, the end as well."""
    t_s = _seconds(entry, "t_s", timeline, where)
    if "each" not in entry:
        if "every_s" in entry or "end_label" in entry:
            raise LauncherError(f"{where}: 'every_s' and 'end_label' need 'each'")
        yield t_s, {}
        return
    each = entry["each"]
    if not isinstance(each, dict) or len(each) != 1 or not isinstance(next(iter(each.values())), list) \
            or not next(iter(each.values())):
        raise LauncherError(f"{where}: write each = {{ name = [values] }}")
    (name, values), = each.items()
    for value in values:
        more = {name: timeline.number(value)}
        yield t_s, more
        if "every_s" not in entry:
            raise LauncherError(f"{where}: 'every_s' is missing")
        t_s += timeline.seconds(entry["every_s"], f"{where}: every_s", more)
    yield t_s, {}


def _steps(entry, drive, timeline, where):
    """One entry is one step, but for "@parameters" and for one that repeats itself."""
    for key in sorted(set(entry) - set(_STEP_KEYS)):
        raise LauncherError(f"{where}: unknown key '{key}'" + instead(key, _STEP_KEYS))
    what = [key for key in ("console", "event") if key in entry]
    if len(what) > 1 or (not what and "label" not in entry):
        raise LauncherError(f"{where}: give either 'console' or 'event'")
    if not what:
        return []
    instants = list(_instants(entry, timeline, where))
    instants = instants[:-1] if "each" in entry else instants
    after = _after(entry, where)
    if entry.get("console") == "@parameters":
        return [Step(instants[0][0], "console", [], text, after) for text in preamble(drive)]
    return [_step(entry, t_s, after, {**timeline.names, **more}, where) for t_s, more in instants]


def _after(entry, where):
    states = str(entry.get("after_state", "")).split()
    if "after_state" in entry and not 1 <= len(states) <= LATE_STATES_MAX:
        raise LauncherError(f"{where}: after_state takes one to {LATE_STATES_MAX} names of states")
    return tuple(states)


def _step(entry, t_s, after, names, where):
    try:
        if "console" in entry:
            if not isinstance(entry["console"], str):
                raise LauncherError("console takes a text")
            text = fill(entry["console"], names)
            if not text.isprintable():
                raise LauncherError("console text must be one printable line")
            return Step(t_s, "console", [], text, after)
        return Step(t_s, entry["event"], event_args(entry["event"], entry.get("args", []), names), after=after)
    except LauncherError as error:
        raise LauncherError(f"{where}: {error}") from error


def event_args(kind, args, names):
    """The arguments of an event as words for the twin, checked against EVENTS."""
    if kind not in EVENTS:
        raise LauncherError(f"unknown event '{kind}'" + instead(str(kind), EVENTS))
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
