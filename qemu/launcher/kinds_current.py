# SPDX-License-Identifier: MIT
"""Kinds of figures: currents, and the angle of the field."""
import numpy as np

from . import signals
from .errors import LauncherError
from .kind import Kind

PHASES = "abc"


def _i_d_deviation(run, from_s, to_s):
    window = run.trace.between(from_s, to_s)
    return _of_rated(run, window["i_d_true_A"] - window["i_d_ref_A"])


def _i_d_in_operation(run, from_s=None, to_s=None):
    window = run.window(from_s, to_s)
    rows = run.in_operation(window)
    return _of_rated(run, (window["i_d_true_A"] - window["i_d_ref_A"])[rows])


def _of_rated(run, deviation):
    rated = run.rated("rated_current_a")
    return np.sqrt(np.mean(deviation ** 2)) / rated * 100, np.abs(deviation).max() / rated * 100


def _distortion(run, from_s, to_s):
    window = run.trace.between(from_s, to_s)
    angle = run.electrical_angle(window)
    return max(signals.distortion_percent(window[f"i_{phase}_A"], angle) for phase in PHASES)


def _distortion_with_ripple(run, from_s, to_s):
    window = run.trace.between(from_s, to_s)
    angle = run.electrical_angle(window)
    return max(signals.distortion_with_ripple_percent(window[f"i_{phase}_mean_A"], window[f"i_{phase}_rms_A"], angle)
               for phase in PHASES)


def _peak_current_a(run, from_s=None, to_s=None):
    window = run.window(from_s, to_s)
    return max(window[f"i_{phase}_peak_A"].max() for phase in PHASES)


def _peak_current(run, from_s=None, to_s=None):
    return _peak_current_a(run, from_s, to_s) / run.names["i_max_A"] * 100


def _angle_error(run, from_s=None, to_s=None):
    window = run.window(from_s, to_s)
    believed = run.column(window, "angle_fw_rad")
    rows = run.in_operation(window)
    error = np.degrees(believed - run.electrical_angle(window))[rows]
    error = (error + 180) % 360 - 180
    return abs(error.mean()), np.abs(error).max()


def _observed_angle_error(run, from_s=None, to_s=None):
    """While the observer leads: its angle is the field's. How much of the time that is, beside it."""
    window = run.window(from_s, to_s)
    leads = run.column(window, "observer_leads") > 0.5
    rows = run.in_operation(window)
    if not (leads & rows).any():
        raise LauncherError("the observer never led in the window")
    error = np.degrees(run.column(window, "angle_fw_rad") - run.electrical_angle(window))[leads & rows]
    error = (error + 180) % 360 - 180
    return np.sqrt((error ** 2).mean()), np.abs(error).max(), 100 * (leads & rows).sum() / rows.sum()


# ---- steps of the current ------------------------------------------------------------------------------------------

def _current_step(run, at_s, to_s):
    """(t, i_q, start, final) of the step of the firmware's reference that falls into the window; t counts from it.

    The first sample that shows the new reference is the one whose voltages already answer it. The start and final values
    are means of the plant's current, so a small gain error of the sensors is no overshoot.
    """
    window = run.trace.between(at_s, to_s)
    reference = window["i_q_ref_A"]
    changes = np.flatnonzero(np.diff(reference))
    if len(changes) == 0 or changes[0] < 20:
        raise LauncherError("no step of i_q_ref_A in the window, or none with 20 samples before it")
    k = changes[0] + 1
    i_q = window["i_q_true_A"]
    final = i_q[-max(len(i_q[k:]) // 4, 2):].mean()
    return window["t_s"][k:] - window["t_s"][k], i_q[k:], i_q[:k].mean(), final


def _step_rise(run, at_s, to_s):
    rise = signals.step_response(*_current_step(run, at_s, to_s))[0]
    return None if rise is None else rise * 1e6


def _step_overshoot(run, at_s, to_s):
    return signals.step_response(*_current_step(run, at_s, to_s))[1]


KINDS = {
    "i_d_deviation": Kind(_i_d_deviation, ["from_s", "to_s"], "% of rated",
                          "i_d of the plant at the sampling instants less the firmware's reference", ("rms", "largest")),
    "i_d_in_operation": Kind(_i_d_in_operation, ["from_s?", "to_s?"], "% of rated",
                             "as i_d_deviation, over all samples in operation from 5 ms after it began", ("rms", "largest")),
    "distortion": Kind(_distortion, ["from_s", "to_s"], "% of fundamental",
                       "true phase current at the sampling instants, where the ripple is zero: all that is neither mean nor"
                       " fundamental, harmonics and inter-harmonics, worst phase"),
    "distortion_with_ripple": Kind(_distortion_with_ripple, ["from_s", "to_s"], "% of fundamental",
                                   "the same of the continuous current, from its means and effective values"),
    "peak_current": Kind(_peak_current, ["from_s?", "to_s?"], "% of i_max", "largest |phase current|, continuous, not sampled"),
    "peak_current_a": Kind(_peak_current_a, ["from_s?", "to_s?"], "A", "largest |phase current|, continuous, not sampled"),
    "angle_error": Kind(_angle_error, ["from_s?", "to_s?"], "deg el.",
                        "field angle the firmware uses for a sample against the rotor's at its instant, in operation from 5 ms"
                        " after it began",
                        ("mean", "largest")),
    "observed_angle_error": Kind(_observed_angle_error, ["from_s?", "to_s?"], "deg el.",
                                 "the observer's angle for a sample against the rotor's at its instant, while it leads; and for"
                                 " how many percent of the time it does", ("rms", "largest", "leads")),
    "step_rise": Kind(_step_rise, ["at_s", "to_s"], "us",
                      "true i_q, 10-90 %, from the step of the firmware's reference"),
    "step_overshoot": Kind(_step_overshoot, ["at_s", "to_s"], "% of step", "true i_q beyond its final value, of the step"),
}
