# SPDX-License-Identifier: MIT
"""A part of the campaign: cases that are each judged by outside truth, and what such a judgement looks at.

The truth is the plant's: the rotor's angle, its speed and torque, the currents, whether the bridge was on. Of the firmware only
what it says counts: its state, the first fault, and where it believes the field to be, which is held against the rotor.
"""
import fnmatch
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .campaign import file_name
from .errors import LauncherError
from .kinds_protection import enumerator

OPERATION = "OPERATION_ENABLED"
PREAMBLE_S, ON_S = 0.05, 0.12  # the parameters are typed, then `on`


@dataclass(frozen=True)
class PartCase:
    """One run of a part; `what` says which, in words between slashes."""
    part: str
    motor: str
    what: str

    @property
    def key(self):
        return f"{self.part}:{self.motor}/{self.what}"

    @property
    def command(self):
        """What repeats it."""
        return f'make campaign CASE="{self.key}"'

    def file(self, folder):
        return Path(folder) / file_name(self.key)


@dataclass
class Setup:
    """How a case is played and judged: the scenario, more arguments of simulate(), and judge(run), which gives a Verdict.

    follow   in place of judge: follow(run, play) gives a Verdict; play(scenario, **arguments) is the Result of another run
    """
    scenario: dict
    judge: object
    arguments: dict = field(default_factory=dict)
    follow: object = None


@dataclass
class Verdict:
    """What came of a case. `outcome` is a word or two to count by; `why` says what is wrong, empty if nothing is."""
    outcome: str
    why: str = ""
    figures: dict = field(default_factory=dict)  # name with unit -> number

    @property
    def passed(self):
        return not self.why


def scenario(title, steps, end_s):
    """A run that begins with the parameters and `on`, and ends soon after a fault."""
    return {"key": "part", "title": title, "preamble_s": PREAMBLE_S, "end_s": end_s,
            "step": [{"t_s": ON_S, "console": "on"}, *steps, {"t_s": 0.05, "after_state": "FAULT", "event": "end"}]}


def late(t_s, **what):
    """A step that waits for operation."""
    return {"t_s": t_s, "after_state": OPERATION, **what}


def event(kind, *args):
    """The part of a step that says what happens to the plant."""
    return {"event": kind, "args": list(args)}


# ---- what a trace shows ----------------------------------------------------------------------------------------------

def first_fault(run):
    """The first cause that the firmware latched, or an empty string."""
    hits = np.flatnonzero(run.trace["fault"])
    return "" if len(hits) == 0 else enumerator(run, "fault", run.trace["fault"][hits[0]])


def fault_s(run):
    """When, or None."""
    hits = np.flatnonzero(run.trace["fault"])
    return None if len(hits) == 0 else float(run.trace["t_s"][hits[0]])


def operation_s(run):
    """When the drive was first in operation, or None."""
    hits = np.flatnonzero(run.trace["state"] == run.state_code(OPERATION))
    return None if len(hits) == 0 else float(run.trace["t_s"][hits[0]])


def late_s(run, t_s):
    """The instant of a step that waited for operation, as late() had it: the twin sees a state one period after its row."""
    began = operation_s(run)
    return None if began is None else began + run.period_s + t_s


def bridge_is_off(run):
    """Whether the run ends with the bridge off."""
    return not run.trace["gates"][-1] and not run.trace["gate_live"][-1]


def angle_error_deg(run, window, seen=lambda angle_rad: angle_rad):
    """The firmware's field angle less the rotor's d axis in each row of a window, -180...180 electrical degrees.

    seen   what the rotor's angle is to the firmware, whose phases may be connected otherwise
    """
    if "angle_fw_rad" not in window:
        raise LauncherError("the trace does not show the firmware's field angle")
    error = window["angle_fw_rad"] - seen(run.electrical_angle(window))
    return np.degrees((error + np.pi) % (2 * np.pi) - np.pi)


def mean_angle_deg(degrees):
    """The mean of angles, which need not lie on one side of 180."""
    return float(np.degrees(np.angle(np.mean(np.exp(1j * np.radians(degrees))))))


def excursion_deg(run, from_s, to_s):
    """The largest mechanical angle that the rotor was away from where it stood first."""
    angle = run.window(from_s, to_s)["theta_mech_rad"]
    return float(np.degrees(np.abs(angle - angle[0]).max()))


def matches(name, patterns):
    """Whether a name is among these, each of which may hold a *."""
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def numbers(text, what, low, high):
    """Numbers separated by blanks, each within its range, or a clear line."""
    values = []
    for word in str(text).replace(",", " ").split():
        if not re.fullmatch(r"[-+]?\d+(\.\d+)?", word) or not low <= float(word) <= high:
            raise LauncherError(f"{what} '{word}' is not a number from {low:g} to {high:g}")
        values.append(float(word))
    return values
