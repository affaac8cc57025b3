# SPDX-License-Identifier: MIT
"""PART=supervision: what goes wrong while the motor turns is found in time and named.

WHAT is CAUSE/SPEED/LOAD, slip60/speed100/load50: the encoder loses 60 degrees electrical at 100 % of rated speed with a hoist
of 50 % of rated torque on the shaft. Causes: slipN, freeze, open_A, overload (twice rated torque). Stopping on a supply that
takes nothing back is part_stop.py's.
"""
import re

import numpy as np

from .errors import LauncherError
from .part import PartCase, Setup, Verdict, bridge_is_off, event, fault_s, first_fault, late, late_s, matches, scenario

NAME = "supervision"
CAUSES = ("slip30", "slip60", "slip90", "slip120", "slip180", "freeze", "open_A", "overload")
SHARES_SPEED, SHARES_LOAD = (10, 50, 100), (0, 50, 100)
SPEED_ERROR_MAX_SHARE = 0.2  # of rated speed, until the fault
PEAK_MAX = 1.05              # times i_trip: what the gain of a sensor may be off
HELD_MAX_SHARE = 0.2         # of the command, in the end: it carries on
FOUND_MAX_S = 0.02           # slip and freeze at rated speed
START_LONGEST_S = 10.0
WATCH_S, WATCH_TURNS = 1.0, 2.2  # after the cause, whichever is longer
ENCODER, OPEN = ("ENCODER_SLIP", "ENCODER*"), ("OPEN_PHASE",)
OVERLOAD = ("SPEED_DEVIATION", "FOLLOWING*", "STALL", "SATURAT*", "OVERLOAD*", "*I2T*")


def plan(motors, _options):
    """Each cause at each speed and load."""
    from . import part_stop

    cases = [PartCase(NAME, motor, f"{cause}/speed{speed}/load{load}") for motor in motors for cause in CAUSES
             for speed in SHARES_SPEED for load in SHARES_LOAD]
    return cases + part_stop.plan(motors)


def setup(what, drive):
    """The run of one case."""
    from . import part_stop

    match = re.fullmatch(r"(slip|freeze|open_[ABC]|overload)(\d*)/speed(\d+)/load(\d+)", what)
    if match is None:
        return part_stop.setup(what, drive)
    kind, size, speed, load = match[1], int(match[2] or 0), int(match[3]) / 100, int(match[4]) / 100
    names = drive.names()
    rpm = max(1, round(speed * min(names["rated_speed_rpm"], names["speed_max_rpm"])))
    loaded_s = 0.1 + rpm / names["ramp_rpm_s"] + names["settle_s"]
    cause_s = loaded_s + names["settle_s"] + 0.1
    watch_s = max(WATCH_S, WATCH_TURNS * 60 / rpm)
    steps = [late(0.1, console=f"speed {rpm}"), late(loaded_s, **event("load_hoist", f"{load} * rated_torque_Nm")),
             late(cause_s, **_cause(kind, size, names)), late(cause_s + watch_s, **event("end"))]
    in_time_s = FOUND_MAX_S if kind in ("slip", "freeze") and speed >= 1 else watch_s
    faults = {"slip": ENCODER, "freeze": ENCODER, "overload": OVERLOAD}.get(kind, OPEN)
    may_hold = kind == "overload" or (kind.startswith("open") and load == 0)
    limits = {"rpm": rpm, "cause_s": cause_s, "in_time_s": in_time_s, "faults": faults, "may_hold": may_hold}
    return Setup(scenario(what, steps, START_LONGEST_S + cause_s + watch_s), lambda run: judge(run, **limits))


def _cause(kind, size, names):
    if kind == "slip":
        return event("encoder_slip", round(names["encoder_counts"] / names["pole_pairs"] * size / 360))
    if kind == "freeze":
        return event("encoder_freeze", "1")
    if kind == "overload":
        return event("load_hoist", "2 * rated_torque_Nm")
    return event("phase_open", kind[-1], "1")


def judge(run, rpm, cause_s, in_time_s, faults, may_hold):
    """The right fault in time, the speed near its command until then, the current within its trip at any time.

    may_hold   there need be no fault if the speed keeps to its command, or comes back to it
    """
    began, fault, at_s = late_s(run, cause_s), first_fault(run), fault_s(run)
    if began is None or began >= run.trace["t_s"][-1] or (fault and at_s < began):
        return Verdict("failed before", f"{fault or 'no operation'} before the cause")
    rated_rpm, after = run.rated("rated_speed_rpm"), run.window(began, None)
    until_s = at_s + run.period_s if fault else None
    away_rpm = float(np.abs(run.window(began, until_s)["speed_rpm"] - rpm).max())
    peak_a = max(float(after[f"i_{phase}_peak_A"].max()) for phase in "abc")
    figures = {"found after, ms": 1000 * (at_s - began) if fault else None, "speed error until then, % of rated":
               100 * away_rpm / rated_rpm, "peak current, % of i_trip": 100 * peak_a / run.names["i_trip_A"]}
    left_rpm = abs(float(run.window(run.trace["t_s"][-1] - WATCH_S / 4, None)["speed_rpm"].mean()) - rpm)
    held = may_hold and left_rpm <= HELD_MAX_SHARE * rpm
    wrong = [] if fault or held else [f"no fault, and the speed is {left_rpm:.0f} rpm off"]
    if fault:
        wrong += [] if matches(fault, faults) else [f"{fault} instead of {' or '.join(faults)}"]
        wrong += [] if at_s - began <= in_time_s else [f"found after {1000 * (at_s - began):.1f} ms ({1000 * in_time_s:.0f})"]
        wrong += [] if bridge_is_off(run) else ["the bridge is on"]
    if away_rpm > SPEED_ERROR_MAX_SHARE * rated_rpm:
        wrong.append(f"the speed was {away_rpm:.0f} rpm off")
    if peak_a > PEAK_MAX * run.names["i_trip_A"]:
        wrong.append(f"{peak_a:.1f} A with i_trip {run.names['i_trip_A']:.1f} A")
    return Verdict(fault or ("no fault" if wrong else "held"), "; ".join(wrong), figures)
