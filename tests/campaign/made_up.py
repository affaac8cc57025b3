# SPDX-License-Identifier: MIT
"""Traces that no run has left: what a judge of the campaign's parts is to see, and nothing else."""
import math

import numpy as np

from launcher.drive import load_drive
from launcher.kind import Run
from launcher.trace import Trace

MOTOR = "teknic_m2310p"
DRIVE = load_drive(MOTOR)
POLE_PAIRS = 4
PERIOD_S = 1e-3
READY, SWITCHED_ON, OPERATION, FAULT = 2, 3, 4, 7
FAULTS = ["NONE", "ENCODER_SLIP", "LOAD_TOO_HIGH", "OPEN_PHASE", "PHASE_ORDER", "ENCODER_DIRECTION", "STALL", "OVERVOLTAGE",
          "LOCK_LOST", "OUT_OF_STEP", "ROTOR_TURNING"]
ENUMS = {"state": {READY: "DRIVE_READY", SWITCHED_ON: "DRIVE_SWITCHED_ON", OPERATION: "DRIVE_OPERATION_ENABLED",
                   FAULT: "DRIVE_FAULT"}, "fault": {code: f"FAULT_{name}" for code, name in enumerate(FAULTS)}}


def made_up(end_s=2.0, began_s=0.8, fault="", fault_s=None, offset_deg=0.0, speed_rpm=0.0, on_in_fault=False, seen=None,
            **columns):
    """A run that goes into operation at began_s (None: never) and ends in a fault, if any; speed_rpm may be a function."""
    t = np.arange(0.0, end_s, PERIOD_S)
    began_s, fault_s = (math.inf if when is None else when for when in (began_s, fault_s))
    state = np.where(t >= fault_s, FAULT, np.where(t >= began_s, OPERATION, SWITCHED_ON))
    speed = np.array([speed_rpm(time) for time in t]) if callable(speed_rpm) else np.full(len(t), float(speed_rpm))
    theta = 0.3 + np.cumsum(speed) * PERIOD_S * math.pi / 30
    electrical = POLE_PAIRS * theta
    live = (t < fault_s) | on_in_fault
    trace = Trace({"t_s": t, "state": state, "fault": np.where(t >= fault_s, FAULTS.index(fault or "NONE"), 0),
                   "theta_mech_rad": theta, "speed_rpm": speed, "gates": np.where(live, 21, 0), "gate_live": live.astype(float),
                   "angle_fw_rad": (seen(electrical) if seen else electrical) + np.radians(offset_deg),
                   "vbus_V": np.full(len(t), 24.0), "torque_mean_Nm": np.zeros(len(t)),
                   **{f"i_{phase}_peak_A": np.full(len(t), 5.0) for phase in "abc"}})
    trace.update({name: value(t) for name, value in columns.items()})
    return Run(trace, "", DRIVE, ENUMS, DRIVE.names())
