# SPDX-License-Identifier: MIT
"""Kinds of figures: the closed current loop by swept sine, as a frequency-response analyser measures it.

The twin adds a sine to what the current sensors see (event sensor_sine), along an axis of the locked rotor. The loop
answers with the negative of it: true current = -T * injected, T the closed loop from what is sensed to the current, with
converter, computing and modulator in it. Everything is taken at the sampling instants.
"""
import numpy as np

from .errors import LauncherError
from .kind import Kind
from .signals import Loop, response_at

SETTLE_SHARE = 0.3  # of the time a frequency lasts, before it is looked at
_AXES = {"d": "i_d_true_A", "q": "i_q_true_A"}
_TOLD = ["axis", "from_s", "to_s"]


def sweep(run, axis, from_s, to_s):
    """The Loop measured between two times, from the scenario's own sensor_sine steps."""
    if axis not in _AXES:
        raise LauncherError(f"axis '{axis}' is neither d nor q")
    starts = [step for step in run.steps if step.kind == "sensor_sine" and from_s <= step.t_s <= to_s]
    found = {}
    for step, following in zip(starts, starts[1:]):
        amplitude_a, hz = float(step.args[0]), float(step.args[1])
        if amplitude_a > 0:
            found[hz] = _closed_at(run, _AXES[axis], step.t_s, following.t_s, amplitude_a, hz)
    if len(found) < 3:
        raise LauncherError("fewer than three frequencies of sensor_sine in the window")
    hz = np.array(sorted(found))
    return Loop(hz, np.array([found[f] for f in hz]))


def _closed_at(run, column, start_s, end_s, amplitude_a, hz):
    window = run.trace.between(start_s + SETTLE_SHARE * (end_s - start_s), end_s)
    if (window["t_s"][-1] - window["t_s"][0]) * hz < 0.9:
        raise LauncherError(f"{hz:g} Hz does not last for a period")
    return -response_at(window["t_s"] - start_s, window[column], hz) / amplitude_a


def _bandwidth(run, axis, from_s, to_s):
    return sweep(run, axis, from_s, to_s).bandwidth_hz()


def _lag_frequency(run, axis, from_s, to_s):
    return sweep(run, axis, from_s, to_s).lag_hz()


def _phase_margin(run, axis, from_s, to_s):
    return sweep(run, axis, from_s, to_s).phase_margin_deg()


def _sensitivity(run, axis, from_s, to_s):
    return sweep(run, axis, from_s, to_s).sensitivity_peak()


def _kind(function, unit, method):
    return Kind(function, _TOLD, unit, f"swept sine in closed loop, rotor locked: {method}", texts=("axis",))


KINDS = {
    "sweep_bandwidth": _kind(_bandwidth, "Hz", "where |T| falls below -3 dB"),
    "sweep_lag": _kind(_lag_frequency, "Hz", "where T lags by 90 degrees"),
    "sweep_phase_margin": _kind(_phase_margin, "deg", "of L = T / (1 - T) where |L| = 1"),
    "sweep_sensitivity": _kind(_sensitivity, "", "largest |1 - T|"),
}
