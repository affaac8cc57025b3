# SPDX-License-Identifier: MIT
"""PART=start, the second time: with an index the offset outlives switching off, so that the next start needs no alignment.

WHAT is again/ANGLE: on, a turn past the index, stop, off, on. The second start looks whether the offset is still the rotor's,
and hardly moves it for that; one in which reluctance outweighs the magnets is aligned again.
"""
import numpy as np

from .errors import LauncherError
from .part import (ON_S, OPERATION, PartCase, Setup, Verdict, angle_error_deg, event, first_fault, late, mean_angle_deg,
                   numbers, scenario)

NAME = "start"
ANGLES = (0, 45, 90, 135, 180, 225, 270, 315)
OFF = f"{OPERATION} SWITCH_ON_DISABLED"
PAUSE_S, STAND_S = 0.2, 0.1   # off; in operation again
TURNS = 1.3                   # surely past the index
OFFSET_MAX_DEG = 3.0          # electrical
MOVEMENT_MAX_DEG = 15.0       # electrical
LONGEST_S = 0.45              # of the second start: the sensors' zeros are measured again, and the offset is held against it
FIRST_LONGEST_S = 15.0


def plan(motors):
    """A few angles: the second start does not know of them."""
    return [PartCase(NAME, motor, f"again/{angle}") for motor in motors for angle in ANGLES]


def setup(what, drive):
    """The run of one case."""
    degrees = numbers(what.partition("/")[2], "angle", 0, 360)
    if len(degrees) != 1:
        raise LauncherError(f"'{what}' is not again/ANGLE")
    names = drive.names()
    ramp_s = names["low_rpm"] / names["ramp_rpm_s"]
    stop_s = 0.1 + ramp_s + TURNS * 60 / names["low_rpm"]
    off_s = stop_s + ramp_s + names["settle_s"]
    steps = [late(0.1, console="speed {low_rpm}"), late(stop_s, console="speed 0"), late(off_s, console="off"),
             {"t_s": PAUSE_S, "after_state": OFF, "console": "on"},
             {"t_s": PAUSE_S + FIRST_LONGEST_S, "after_state": OFF, **event("end")},
             {"t_s": STAND_S, "after_state": f"{OFF} {OPERATION}", **event("end")}]
    return Setup(scenario(what, steps, ON_S + 2 * FIRST_LONGEST_S + off_s + PAUSE_S), judge, {"start_angle": degrees[0]})


def judge(run):
    """In operation again, soon, where it stood, at the right angle."""
    fault, t = first_fault(run), run.trace["t_s"]
    operates = run.trace["state"] == run.state_code(OPERATION)
    changes = np.flatnonzero(np.diff(operates.astype(int))) + 1  # on, off, on
    if fault or len(changes) < 3:
        missing = ("it never operated", "it was not switched off", "it did not operate again")[min(len(changes), 2)]
        return Verdict(fault or "undecided", fault or missing)
    on_s = float(t[changes[1]]) + run.period_s + PAUSE_S
    began_s = float(t[changes[2]])
    angle = run.window(on_s, began_s + STAND_S)["theta_mech_rad"]
    moved = float(np.degrees(np.ptp(angle))) * run.drive.motor["electrical"]["pole_pairs"]
    error = mean_angle_deg(angle_error_deg(run, run.window(began_s + STAND_S / 2, None)))
    figures = {"time to operation again, s": began_s - on_s, "movement again, deg el.": moved,
               "offset error again, deg el.": error}
    aligns = run.drive.is_reluctant  # no push tells whether its offset is right
    wrong = [] if began_s - on_s <= (FIRST_LONGEST_S if aligns else LONGEST_S) else [f"it took {began_s - on_s:.2f} s"]
    wrong += [] if moved <= MOVEMENT_MAX_DEG or aligns else [f"the rotor moved by {moved:.1f} degrees electrical"]
    wrong += [] if abs(error) <= OFFSET_MAX_DEG else [f"offset {error:+.1f} degrees electrical"]
    return Verdict("not again" if wrong else "again", "; ".join(wrong), figures)
