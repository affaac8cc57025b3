# SPDX-License-Identifier: MIT
"""What a kind of figure is, and what it may look at.

The measurements look at the plant's truth (what an oscilloscope and a torque shaft would show), not at what the firmware
believes, unless a column of the firmware is asked for by name.
"""
from dataclasses import dataclass, field

import numpy as np

from .errors import LauncherError
from .probes import code_of

AFTERMATH_S = 0.005  # of the alignment, which is no part of the operation


@dataclass
class Kind:
    """function(run, **arguments) gives one value, or one for each of `parts`."""
    function: object
    arguments: list  # "?" marks one that may be left out
    unit: str
    method: str      # as the report states it
    parts: tuple = ("",)
    texts: tuple = ()  # arguments that are no numbers


@dataclass
class Run:
    """A finished run."""
    trace: object
    console: str
    drive: object
    enums: dict
    names: dict               # of the drive and of the scenario's labels, for expressions
    steps: list = field(default_factory=list)
    loop_starts_s: object = ()  # of the current loop's interrupts, by the twin's log
    figures: dict = field(default_factory=dict)  # what the scenario itself has measured

    @property
    def pwm_period_s(self):
        """Until the first `on` it has one sample, whatever is set."""
        return float(np.median(np.diff(self.trace["t_s"][:100])))

    @property
    def period_s(self):
        """From a sample to the next."""
        return float(np.median(np.diff(self.trace["t_s"])))

    def window(self, from_s=None, to_s=None):
        """The rows of a stretch of time, by default of all."""
        t = self.trace["t_s"]
        return self.trace.between(t[0] if from_s is None else from_s, t[-1] + 1 if to_s is None else to_s)

    def state_code(self, name):
        """The number of a state of the drive; -1 when the image has none of that name."""
        return code_of(self.enums.get("state", {}), name)

    def in_operation(self, window):
        """Which rows of a window find the drive in operation; a complaint when none does.

        The first of each stretch are left out: the current of the alignment is still there.
        """
        rows = window["state"] == self.state_code("OPERATION_ENABLED")
        last_out = np.maximum.accumulate(np.where(rows, -np.inf, window["t_s"]))
        rows &= window["t_s"] - last_out > AFTERMATH_S
        if not rows.any():
            raise LauncherError("the drive was never in operation in the window")
        return rows

    def electrical_angle(self, window):
        return self.drive.motor["electrical"]["pole_pairs"] * window["theta_mech_rad"]

    def rated(self, key):
        return self.drive.motor["rating"][key]

    def column(self, window, name):
        if name not in window:
            raise LauncherError(f"the trace has no column '{name}'")
        return window[name]
