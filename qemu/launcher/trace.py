# SPDX-License-Identifier: MIT
"""The trace of a run: one row a sample of the currents, columns by name, plus what follows from the plant's own truth."""
import math

import numpy as np

from .errors import LauncherError
from .paths import shown
from .recording import read_recording

# columns the twin always writes, in any order; the probes of the firmware follow
PLANT_COLUMNS = ("t_s", "v_a_V", "v_b_V", "v_c_V", "i_a_A", "i_b_A", "i_c_A", "theta_mech_rad", "speed_rad_s", "torque_Nm",
                 "load_Nm", "vbus_V", "duty_a", "duty_b", "duty_c", "gates", "gate_live", "winding_C", "i_a_rms_A", "i_b_rms_A",
                 "i_c_rms_A", "i_a_peak_A", "i_b_peak_A", "i_c_peak_A", "torque_mean_Nm", "load_speed_rad_s", "magnet_C",
                 "i_a_mean_A", "i_b_mean_A", "i_c_mean_A", "hall")


class Trace(dict):
    """Column name -> numpy array, all of one length."""

    @property
    def rows(self):
        return len(self["t_s"])

    def between(self, from_s, to_s):
        """The rows with from_s <= t_s < to_s, as a Trace of views."""
        first, last = np.searchsorted(self["t_s"], [from_s, to_s])
        if last - first < 2:
            raise LauncherError(f"the trace has no samples in {from_s:g}..{to_s:g} s")
        return Trace({name: column[first:last] for name, column in self.items()})


def load_trace(path):
    """Reads the twin's trace and checks that it is whole."""
    trace = Trace(read_recording(path, "trace"))
    missing = [name for name in PLANT_COLUMNS if name not in trace]
    if missing:
        raise LauncherError(f"{shown(path)} has no column '{missing[0]}'")
    if trace.rows < 2:
        raise LauncherError(f"{shown(path)} has no samples")
    return trace


def add_truth(trace, pole_pairs):
    """Adds what a perfect observer would see: speed_rpm, and the plant's i_d_true_A, i_q_true_A.

    Amplitude-invariant Clarke and Park transforms with the rotor's true electrical angle (0: magnet flux along phase A).
    """
    trace["speed_rpm"] = trace["speed_rad_s"] * 30 / math.pi
    theta = pole_pairs * trace["theta_mech_rad"]
    alpha = (2 * trace["i_a_A"] - trace["i_b_A"] - trace["i_c_A"]) / 3
    beta = (trace["i_b_A"] - trace["i_c_A"]) / math.sqrt(3)
    trace["i_d_true_A"] = alpha * np.cos(theta) + beta * np.sin(theta)
    trace["i_q_true_A"] = beta * np.cos(theta) - alpha * np.sin(theta)
    return trace
