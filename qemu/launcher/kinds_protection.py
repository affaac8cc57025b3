# SPDX-License-Identifier: MIT
"""Kinds of figures: states, faults, and how long the bridge stays on after a cause."""
import re

import numpy as np

from .errors import LauncherError
from .expression import evaluate
from .kind import Kind
from .signals import whole_periods


def _since(run, since):
    """Seconds from a number, or the first sample for which the expression over columns and names holds."""
    value = evaluate(since, {**run.names, **run.trace}) if isinstance(since, str) else float(since)
    if np.ndim(value) == 0:
        return float(value)
    hits = np.flatnonzero(value)
    if len(hits) == 0:
        raise LauncherError(f"'{since}' never holds")
    return float(run.trace["t_s"][hits[0]])


def _bridge_off(run, since, after_s=0.0):
    start = _since(run, since) + after_s
    t = run.trace["t_s"]
    first = int(np.searchsorted(t, start))
    off = np.flatnonzero((run.trace["gates"][first:] == 0) & (run.trace["gate_live"][first:] == 0))
    return None if len(off) == 0 else whole_periods(start, _off_s(run, first + off[0]), run.pwm_period_s)


def _off_s(run, row):
    """When the bridge is off that a row shows so. A reset takes the PWM's samples along: behind a gap, for as long as no sample
    says when the program runs again, by how long the high sides conducted in it."""
    t = run.trace["t_s"]
    before_s = t[max(row - 1, 0)]
    gap_s = t[row] - before_s
    if gap_s < 1.5 * run.pwm_period_s:
        return t[row]
    return before_s + gap_s * max(run.trace[f"duty_{phase}"][row] for phase in "abc")


def _gates_on_after(run, from_s, to_s):
    return int(np.count_nonzero(run.trace.between(from_s, to_s)["gates"]))


def _first_fault(run, from_s=None, to_s=None):
    """The name of the first cause the firmware latched in the window, or NONE."""
    window = run.window(from_s, to_s)
    hits = np.flatnonzero(window["fault"])
    return "NONE" if len(hits) == 0 else enumerator(run, "fault", window["fault"][hits[0]])


def _all_faults(run, from_s=None, to_s=None):
    """Every cause seen in the window, in order: nothing else may follow the first one."""
    codes = run.window(from_s, to_s)["fault"]
    changes = codes[np.concatenate([[True], np.diff(codes) != 0])]
    return " ".join(enumerator(run, "fault", code) for code in changes if code != 0) or "NONE"


def _state_at(run, at_s):
    index = min(int(np.searchsorted(run.trace["t_s"], at_s)), run.trace.rows - 1)
    return enumerator(run, "state", run.trace["state"][index])


def _state(run, from_s, to_s):
    """The one state of the whole window, or what came after it and when."""
    window = run.trace.between(from_s, to_s)
    changes = np.flatnonzero(np.diff(window["state"])) + 1
    first = enumerator(run, "state", window["state"][0])
    if len(changes) == 0:
        return first
    return f"{first}, then {enumerator(run, 'state', window['state'][changes[0]])} at {window['t_s'][changes[0]]:.4f} s"


def enumerator(run, column, code):
    """FAULT_OVERVOLTAGE -> OVERVOLTAGE, as the firmware's own enum says."""
    name = run.enums.get(column, {}).get(int(code), str(int(code)))
    return re.sub(r"^[A-Z]+?_", "", name)


def _overruns(run):
    """Samples that were not followed by one current-loop interrupt, by the twin's log, and overrun faults."""
    count = sum(1 for code in np.unique(run.trace["fault"]) if enumerator(run, "fault", code) == "LOOP_OVERRUN")
    if len(run.loop_starts_s) > 1:
        samples_s = run.trace.between(run.loop_starts_s[0], run.loop_starts_s[-1])["t_s"]
        count += int(np.count_nonzero(np.diff(np.searchsorted(run.loop_starts_s, samples_s)) != 1))
    return count


def _console(run, pattern):
    """How often a regular expression matches the console transcript."""
    try:
        return len(re.findall(pattern, run.console, re.MULTILINE))
    except re.error as error:
        raise LauncherError(f"'{pattern}': {error}") from error


KINDS = {
    "bridge_off": Kind(_bridge_off, ["since", "after_s?"], "PWM periods",
                       "whole periods, rounded up, from the cause to the first sample with all six gates off",
                       texts=("since",)),
    "gates_on_after": Kind(_gates_on_after, ["from_s", "to_s"], "samples", "samples with any gate on"),
    "first_fault": Kind(_first_fault, ["from_s?", "to_s?"], "", "first cause latched by the firmware"),
    "all_faults": Kind(_all_faults, ["from_s?", "to_s?"], "", "all causes latched by the firmware, in order"),
    "state_at": Kind(_state_at, ["at_s"], "", "state of the drive"),
    "state": Kind(_state, ["from_s", "to_s"], "", "state of the drive in the whole window"),
    "overruns": Kind(_overruns, [], "", "current-loop interrupts that did not come once a period, by the twin's log"),
    "console": Kind(_console, ["pattern"], "matches", "regular expression in the console transcript", texts=("pattern",)),
}
