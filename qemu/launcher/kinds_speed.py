# SPDX-License-Identifier: MIT
"""Kinds of figures: speed and torque of the shaft."""
import numpy as np

from . import signals
from .kind import Kind

SMOOTHED_S = 1e-3


def _speed_error(run, from_s, to_s, reference_rpm):
    deviation = run.trace.between(from_s, to_s)["speed_rpm"] - reference_rpm
    return abs(deviation.mean()) / abs(reference_rpm) * 100, np.abs(deviation).max() / abs(reference_rpm) * 100


def _ramp_overshoot(run, from_s, to_s, target_rpm):
    """Beyond the target, seen from where the speed came from."""
    speed = run.trace.between(from_s, to_s)["speed_rpm"]
    direction = 1.0 if target_rpm >= speed[0] else -1.0
    return max(0.0, (direction * (speed - target_rpm)).max()) / abs(target_rpm) * 100


def _load_dip(run, from_s, to_s, reference_rpm):
    speed = run.trace.between(from_s, to_s)["speed_rpm"]
    return np.abs(speed - reference_rpm).max() / abs(reference_rpm) * 100


def _recovery(run, from_s, to_s, reference_rpm, band_percent=1.0):
    window = run.trace.between(from_s, to_s)
    error = moving_mean(window["speed_rpm"], max(1, round(SMOOTHED_S / run.period_s))) - reference_rpm
    last, band = error[-len(error) // 4:], band_percent / 100 * abs(reference_rpm)
    if abs(last.mean()) > band:
        return None
    settled = signals.settling_time(window["t_s"], error, band + np.abs(last).max())
    return None if settled is None else settled * 1000


def moving_mean(y, width):
    """So that encoder and cogging ripple does not count as not settled."""
    padded = np.concatenate([np.full(width - 1, y[0]), y])
    total = np.cumsum(np.concatenate([[0.0], padded]))
    return (total[width:] - total[:-width]) / width


def _torque_ripple(run, from_s, to_s):
    torque = run.trace.between(from_s, to_s)["torque_Nm"]
    rated = run.rated("rated_torque_nm")
    return torque.std() / rated * 100, np.ptp(torque) / rated * 100


KINDS = {
    "speed_error": Kind(_speed_error, ["from_s", "to_s", "reference_rpm"], "% of command",
                        "true speed against the command: deviation of the mean over the window, largest of any sample",
                        ("mean", "largest")),
    "ramp_overshoot": Kind(_ramp_overshoot, ["from_s", "to_s", "target_rpm"], "% of command",
                           "largest true speed beyond the command at the end of a ramp"),
    "load_dip": Kind(_load_dip, ["from_s", "to_s", "reference_rpm"], "% of command",
                     "largest deviation of the true speed after the load step"),
    "recovery": Kind(_recovery, ["from_s", "to_s", "reference_rpm", "band_percent?"], "ms",
                     "until the true speed, averaged over 1 ms, deviates from the command by no more than the band (1 %) beyond"
                     " what it still does in the last quarter of the window"),
    "torque_ripple": Kind(_torque_ripple, ["from_s", "to_s"], "% of rated",
                          "air-gap torque at the sampling instants without its mean", ("rms", "peak to peak")),
}
