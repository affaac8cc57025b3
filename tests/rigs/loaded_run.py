# SPDX-License-Identifier: MIT
"""A run up to speed and load, in which something happens: the first fault, when, and what shaft and currents did until then."""
import math

import numpy as np
from launcher import simulate
from launcher.drive import load_drive

RUN_UP_S = 0.1
UNTIL_S = {"load_nm": 0.3, "temperature_c": 0.3}


def play(tmp_path, motor, share, load, happens, lines=(), overrides=None, detune="", until_s=None, later=(), judge=None):
    """Runs up to a share of the largest speed, loads the shaft with a share of rated torque, and then something happens.

    later   what comes so many seconds after that: (seconds, the rest of a scenario's step)
    """
    names = load_drive(motor, overrides, detune=detune, aligned=True).names()
    rpm = round(share * names["speed_max_rpm"])
    up_s = 0.15 + names["on_time_s"]
    loaded_s = up_s + abs(rpm) / names["ramp_rpm_s"] + RUN_UP_S
    at_s = loaded_s + 0.12
    kind, *args = happens
    if kind == "encoder_slip":
        args = [round(args[0] / 360 * names["encoder_counts"] / names["pole_pairs"])]
    steps = [{"t_s": 0.14, "console": line} for line in lines]
    steps += [{"t_s": 0.15, "console": "on"}, {"t_s": up_s, "console": f"speed {rpm}"},
              {"t_s": loaded_s, "event": "load_nm", "args": [f"{load} * rated_torque_Nm"]},
              {"t_s": at_s, "event": kind, "args": [str(arg) for arg in args]}]
    steps += [{"t_s": at_s + after_s, **what} for after_s, what in later]
    end_s = at_s + (until_s or UNTIL_S.get(kind, 0.06))
    result = simulate({"key": "supervision", "end_s": end_s, "preamble_s": 0.05, "step": steps}, motor, out_dir=tmp_path,
                      overrides=overrides, detune=detune, aligned=True)
    return result, (judge or Outcome)(result, names, rpm, at_s)


class Outcome:
    def __init__(self, result, names, rpm, at_s):
        trace, codes = result.trace, result.trace["fault"]
        rows = np.flatnonzero(np.diff(codes, prepend=0))
        found = [(result.enums["fault"][int(codes[row])], trace["t_s"][row]) for row in rows if codes[row]]
        self.fault = found[0][0].removeprefix("FAULT_") if found else "NONE"
        self.after_ms = (found[0][1] - at_s) * 1e3 if found else math.inf
        on = (trace["t_s"] >= at_s) & (trace["gate_live"] > 0)
        self.still_on = bool(trace["gate_live"][-1] > 0)
        error = np.abs(trace["speed_rad_s"] * 30 / math.pi - rpm)[on]
        self.error_percent = 100 * error.max() / names["speed_max_rpm"] if on.any() else 0.0
        peak = max(np.abs(trace[f"i_{phase}_A"])[on].max() for phase in "abc") if on.any() else 0.0
        self.peak_share = peak / names["i_trip_A"]

    def __repr__(self):
        return f"{self.fault} after {self.after_ms:.2f} ms, speed error {self.error_percent:.1f} %, peak {self.peak_share:.2f}"
