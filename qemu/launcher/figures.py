# SPDX-License-Identifier: MIT
"""The figures of a run: each [[figure]] of a scenario file is one measurement and, with a limit, one verdict.

The measurements look at the plant's truth (what an oscilloscope and a torque shaft would show), not at what the firmware
believes, unless a column of the firmware is asked for by name.
"""
import math
import re
from dataclasses import dataclass

import numpy as np

from . import signals
from .errors import LauncherError
from .expression import evaluate, number


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


@dataclass
class Run:
    """What a measurement may look at."""
    trace: object
    console: str
    drive: object
    enums: dict
    loop_starts_s: object = ()  # of the current loop's interrupts, by the twin's log


def measure(scenario, run):
    """{figure name: Figure} in the scenario's order."""
    results = {}
    for index, entry in enumerate(scenario.figures):
        where = f"scenario {scenario.key}: figure {index + 1}"
        figure = _measure_one(dict(entry), run, where)
        if figure.name in results:
            raise LauncherError(f"{where}: the name '{figure.name}' is taken")
        results[figure.name] = figure
    return results


def _measure_one(entry, run, where):
    name, kind = entry.pop("name", None), entry.pop("kind", None)
    if not isinstance(name, str) or kind not in KINDS:
        raise LauncherError(f"{where}: needs a name and a kind (known: {', '.join(sorted(KINDS))})")
    function, arguments, unit, method = KINDS[kind]
    names = run.drive.names()
    try:
        limits = {key: number(entry.pop(key), names) for key in ("max", "min") if key in entry}
        equal = entry.pop("equal", None)
        unit = entry.pop("unit", unit)
        known = {argument.rstrip("?") for argument in arguments}
        for key in entry:
            if key not in known:
                raise LauncherError(f"{kind} does not take '{key}' (it takes {', '.join(sorted(known))})")
        for argument in arguments:
            if not argument.endswith("?") and argument not in entry:
                raise LauncherError(f"{kind} needs '{argument}'")
        values = {key: value if key in _TEXT_ARGUMENTS else number(value, names) for key, value in entry.items()}
    except LauncherError as error:
        raise LauncherError(f"{where} ({name}): {error}") from error
    note = ""
    try:
        value = function(run, **values)
    except LauncherError as error:  # the run does not show what was to be measured: the figure fails, the others count
        value, note = None, str(error)
    if isinstance(value, (np.floating, np.integer)):
        value = float(value)
    return Figure(name, kind, value, unit, method, equal=equal, note=note, **limits)


# ---- speed ---------------------------------------------------------------------------------------------------------

def _speed_error(run, from_s, to_s, reference_rpm):
    return abs(run.trace.between(from_s, to_s)["speed_rpm"].mean() - reference_rpm) / abs(reference_rpm) * 100


def _speed_overshoot(run, from_s, to_s, target_rpm, base_rpm=None):
    """Beyond the target, seen from where the speed came from, in percent of the target (or of base_rpm)."""
    speed = run.trace.between(from_s, to_s)["speed_rpm"]
    direction = 1.0 if target_rpm >= speed[0] else -1.0
    return max(0.0, (direction * (speed - target_rpm)).max()) / abs(base_rpm or target_rpm) * 100


def _load_dip(run, from_s, to_s, reference_rpm):
    speed = run.trace.between(from_s, to_s)["speed_rpm"]
    return np.abs(speed - reference_rpm).max() / abs(reference_rpm) * 100


def _recovery(run, from_s, to_s, reference_rpm, band_percent=1.0):
    window = run.trace.between(from_s, to_s)
    smooth = _moving_mean(window["speed_rpm"], 20)
    settled = signals.settling_time(window["t_s"], smooth - reference_rpm, band_percent / 100 * abs(reference_rpm))
    return None if settled is None else settled * 1000


def _moving_mean(y, width):
    """Mean over `width` samples (1 ms), so that encoder and cogging ripple does not count as not settled."""
    padded = np.concatenate([np.full(width - 1, y[0]), y])
    total = np.cumsum(np.concatenate([[0.0], padded]))
    return (total[width:] - total[:-width]) / width


# ---- current -------------------------------------------------------------------------------------------------------

def _i_d_deviation(run, from_s, to_s, reference_A=0.0):
    deviation = run.trace.between(from_s, to_s)["i_d_true_A"] - reference_A
    return np.abs(deviation).max() / run.drive.motor["rating"]["rated_current_a"] * 100


def _thd(run, from_s, to_s, harmonics=40):
    window = run.trace.between(from_s, to_s)
    angle = run.drive.motor["electrical"]["pole_pairs"] * window["theta_mech_rad"]
    return max(signals.thd_percent(window[f"i_{phase}_A"], angle, int(harmonics)) for phase in "abc")


def _peak_current(run, from_s=None, to_s=None):
    window = _window(run, from_s, to_s)
    peak = max(np.abs(window[f"i_{phase}_A"]).max() for phase in "abc")
    return peak / (run.drive.params["i_max_ma"] / 1000) * 100


def _peak_current_a(run, from_s=None, to_s=None):
    window = _window(run, from_s, to_s)
    return max(np.abs(window[f"i_{phase}_A"]).max() for phase in "abc")


def _current_step(run, at_s, to_s):
    """(t, i_q, start, final) of the step of the firmware's reference that falls into the window; t counts from it.

    The first sample that shows the new reference is the one whose voltages already answer it. The start and final values
    are means of the plant's current, so a small gain error of the sensors is no overshoot.
    """
    window = run.trace.between(at_s, to_s)
    reference = window["i_q_ref_A"]
    changes = np.flatnonzero(np.diff(reference))
    if len(changes) == 0 or changes[0] < 20:
        raise LauncherError("no step of i_q_ref_A in the window, or none with 1 ms before it")
    k = changes[0] + 1
    i_q = window["i_q_true_A"]
    final = i_q[-max(len(i_q[k:]) // 4, 2):].mean()
    return window["t_s"][k:] - window["t_s"][k], i_q[k:], i_q[:k].mean(), final


def _step_rise(run, at_s, to_s):
    rise = signals.step_response(*_current_step(run, at_s, to_s))[0]
    return None if rise is None else rise * 1e6


def _step_overshoot(run, at_s, to_s):
    return signals.step_response(*_current_step(run, at_s, to_s))[1]


def _step_bandwidth(run, at_s, to_s):
    t, i_q, start, final = _current_step(run, at_s, to_s)
    measured = signals.bandwidth_from_step(t, i_q, start, final)
    if measured is None:
        rise = signals.step_response(t, i_q, start, final)[0]
        measured = None if not rise else 0.35 / rise
    return measured


# ---- protection ----------------------------------------------------------------------------------------------------

def _since(run, since):
    """Seconds from a number, or the first sample for which the expression over columns and drive names holds."""
    names = {**run.drive.names(), **run.trace}
    value = evaluate(since, names) if isinstance(since, str) else float(since)
    if np.ndim(value) == 0:
        return float(value)
    hits = np.flatnonzero(value)
    if len(hits) == 0:
        raise LauncherError(f"'{since}' never holds")
    return float(run.trace["t_s"][hits[0]])


def _bridge_off(run, since, after_s=0.0):
    """PWM periods from `since` (+ after_s) to the first sample with all six gates off. The trace resolves one period."""
    start = _since(run, since) + after_s
    t = run.trace["t_s"]
    first = int(np.searchsorted(t, start))
    off = np.flatnonzero((run.trace["gates"][first:] == 0) & (run.trace["gate_live"][first:] == 0))
    if len(off) == 0:
        return None
    return max(0.0, (t[first + off[0]] - start) / (t[1] - t[0]))


def _gates_on_after(run, from_s, to_s):
    """How many samples in the window find a gate on."""
    return int(np.count_nonzero(run.trace.between(from_s, to_s)["gates"]))


def _first_fault(run, from_s=None, to_s=None):
    """The name of the first cause the firmware latched in the window, or NONE."""
    window = _window(run, from_s, to_s)
    hits = np.flatnonzero(window["fault"])
    return "NONE" if len(hits) == 0 else _enumerator(run, "fault", window["fault"][hits[0]])


def _all_faults(run, from_s=None, to_s=None):
    """Every cause seen in the window, in order: nothing else may follow the first one."""
    codes = _window(run, from_s, to_s)["fault"]
    changes = codes[np.concatenate([[True], np.diff(codes) != 0])]
    return " ".join(_enumerator(run, "fault", code) for code in changes if code != 0) or "NONE"


def _state_at(run, at_s):
    index = min(int(np.searchsorted(run.trace["t_s"], at_s)), run.trace.rows - 1)
    return _enumerator(run, "state", run.trace["state"][index])


def _enumerator(run, column, code):
    """FAULT_OVERVOLTAGE -> OVERVOLTAGE, as the firmware's own enum says."""
    name = run.enums.get(column, {}).get(int(code), str(int(code)))
    return re.sub(r"^[A-Z]+?_", "", name)


def _overruns(run):
    """Current-loop interrupts that did not come once per PWM period, by the twin's log, and overrun faults."""
    count = sum(1 for code in np.unique(run.trace["fault"]) if _enumerator(run, "fault", code) == "LOOP_OVERRUN")
    if len(run.loop_starts_s) > 1:
        period_s = float(np.median(np.diff(run.trace["t_s"])))
        count += int(np.count_nonzero(np.round(np.diff(run.loop_starts_s) / period_s) != 1))
    return count


# ---- anything else -------------------------------------------------------------------------------------------------

def _window(run, from_s, to_s):
    t = run.trace["t_s"]
    return run.trace.between(t[0] if from_s is None else from_s, t[-1] + 1 if to_s is None else to_s)


def _column(run, column, from_s=None, to_s=None):
    window = _window(run, from_s, to_s)
    value = np.asarray(evaluate(column, {**run.drive.names(), **window}), dtype=float)
    return np.broadcast_to(value, window["t_s"].shape)


def _mean(run, column, from_s=None, to_s=None):
    return _column(run, column, from_s, to_s).mean()


def _maximum(run, column, from_s=None, to_s=None):
    return _column(run, column, from_s, to_s).max()


def _minimum(run, column, from_s=None, to_s=None):
    return _column(run, column, from_s, to_s).min()


def _rms(run, column, from_s=None, to_s=None):
    return math.sqrt(np.square(_column(run, column, from_s, to_s)).mean())


def _console(run, pattern):
    """How often a regular expression matches the console transcript."""
    try:
        return len(re.findall(pattern, run.console, re.MULTILINE))
    except re.error as error:
        raise LauncherError(f"'{pattern}': {error}") from error


_TEXT_ARGUMENTS = {"since", "column", "pattern"}

# kind -> (function, arguments ("?" marks one that may be left out), unit, method as the report states it)
KINDS = {
    "speed_error": (_speed_error, ["from_s", "to_s", "reference_rpm"], "%",
                    "mean of the true speed over the window against the command"),
    "speed_overshoot": (_speed_overshoot, ["from_s", "to_s", "target_rpm", "base_rpm?"], "%",
                        "largest true speed beyond the command"),
    "load_dip": (_load_dip, ["from_s", "to_s", "reference_rpm"], "%",
                 "largest deviation of the true speed after the load step"),
    "recovery": (_recovery, ["from_s", "to_s", "reference_rpm", "band_percent?"], "ms",
                 "until the true speed, averaged over 1 ms, stays within 1 % of the command"),
    "i_d_deviation": (_i_d_deviation, ["from_s", "to_s", "reference_A?"], "% of rated",
                      "largest |i_d - reference| of the plant at the sampling instants"),
    "thd": (_thd, ["from_s", "to_s", "harmonics?"], "%",
            "true phase current at the sampling instants over whole electrical periods, harmonics 2..40 against the "
            "rotor angle, worst phase"),
    "peak_current": (_peak_current, ["from_s?", "to_s?"], "% of limit", "largest true phase current against i_max"),
    "peak_current_a": (_peak_current_a, ["from_s?", "to_s?"], "A", "largest true phase current at the sampling instants"),
    "step_rise": (_step_rise, ["at_s", "to_s"], "us", "true i_q, 10-90 %, from the step of the firmware's reference"),
    "step_overshoot": (_step_overshoot, ["at_s", "to_s"], "%", "true i_q beyond its final value, of the step"),
    "step_bandwidth": (_step_bandwidth, ["at_s", "to_s"], "Hz",
                       "-3 dB of the Fourier transform of the step response's derivative (0.35/rise if it has none)"),
    "bridge_off": (_bridge_off, ["since", "after_s?"], "PWM periods", "from the cause to all six gates off"),
    "gates_on_after": (_gates_on_after, ["from_s", "to_s"], "samples", "samples with any gate on"),
    "first_fault": (_first_fault, ["from_s?", "to_s?"], "", "first cause latched by the firmware"),
    "all_faults": (_all_faults, ["from_s?", "to_s?"], "", "all causes latched by the firmware, in order"),
    "state_at": (_state_at, ["at_s"], "", "state of the drive"),
    "overruns": (_overruns, [], "", "current-loop interrupts that did not come once a period, by the twin's log"),
    "mean": (_mean, ["column", "from_s?", "to_s?"], "", "mean over the window"),
    "maximum": (_maximum, ["column", "from_s?", "to_s?"], "", "largest value in the window"),
    "minimum": (_minimum, ["column", "from_s?", "to_s?"], "", "smallest value in the window"),
    "rms": (_rms, ["column", "from_s?", "to_s?"], "", "root mean square over the window"),
    "console": (_console, ["pattern"], "matches", "regular expression in the console transcript"),
}
