# SPDX-License-Identifier: MIT
"""PART=start: from every angle and under load, the drive finds the rotor or says why not, and stays off.

WHAT is LOAD/ANGLE: hoist20/45 is a hoist with 20 % of rated torque, which pulls against positive rotation and which a ratchet
holds at standstill; friction20/45 is friction of that size; inertia100/45 is 100 times the rotor's inertia, rigidly coupled;
free/45 is none of these; again/45 is part_again.py's. The angle is electrical, from phase A to the
rotor's d axis.
"""
import re

from . import part_again
from .errors import LauncherError
from .part import (ON_S, OPERATION, PartCase, Setup, Verdict, angle_error_deg, bridge_is_off, event, excursion_deg, fault_s,
                   first_fault, late, late_s, matches, mean_angle_deg, numbers, operation_s, scenario)

NAME = "start"
OFFSET_MAX_DEG = 3.0       # electrical; at standstill more, by what the sensor leaves open: half a count
MOVEMENT_MAX_DEG = 1080.0  # electrical: ALIGNMENT_TURNS of firmware/commission/alignment.h, to either side
LONGEST_S = 15.0
STAND_S, TURN_S = 0.1, 0.5  # at standstill, then turning: each is judged
DECIDED_S = 0.05           # of these, the last part of the standstill
PEAK_MAX = 1.05            # times i_trip: what the gain of a sensor may be off
SEEDS = 8                  # the plants that the angles go round
LOADS = ("free", "hoist20", "hoist50", "friction20")
# reasons for staying off that are true of a load
ALLOWED = {"free": (), "inertia": (), "hoist": ("LOAD_TOO_HIGH",), "friction": ("LOAD_TOO_HIGH", "ROTOR_BLOCKED")}


def angles():
    """Every 5 degrees, and every degree within 5 of 0, 90, 180 and 270."""
    near = {(quarter + away) % 360 for quarter in (0, 90, 180, 270) for away in range(-5, 6)}
    return sorted(near | set(range(0, 360, 5)))


def plan(motors, options):
    """ANGLES and LOADS thin it out."""
    wanted = [f"{angle:g}" for angle in numbers(options.get("angles") or "", "ANGLES", 0, 360)] or [f"{a}" for a in angles()]
    loads = (options.get("loads") or "").replace(",", " ").split() or LOADS
    cases = [PartCase(NAME, motor, f"{load}/{angle}") for motor in motors for load in map(_checked, loads) for angle in wanted]
    return cases + ([] if options.get("angles") or options.get("loads") else part_again.plan(motors))


def _checked(load):
    match = re.fullmatch(r"free|(hoist|friction)\d{1,3}|inertia\d{1,3}(\.\d)?", load)
    if match is None:
        raise LauncherError(f"LOADS '{load}' is none of free, hoist20, friction20 (percent of rated torque), inertia100 (times"
                            " the rotor's)")
    return load


def setup(what, drive):
    """The run of one case."""
    load, _, angle = what.partition("/")
    if load == "again":
        return part_again.setup(what, drive)
    kind, size = re.fullmatch(r"([a-z]+)([\d.]*)", _checked(load)).groups()
    degrees = numbers(angle, "angle", 0, 360)[0]
    torque_nm = drive.names()["rated_torque_Nm"] * float(size or 0) / 100
    pulls = {"hoist": "load_hoist", "friction": "load_coulomb"}.get(kind)
    steps = [{"t_s": 0.0, **event(pulls, f"{torque_nm:.9g}")}] if pulls else []
    steps += [late(STAND_S, console="speed {low_rpm}"), late(STAND_S + TURN_S, **event("end"))]
    return Setup(scenario(f"start at {degrees:g} degrees, {load}", steps, LONGEST_S),
                 lambda run: judge(run, ALLOWED[kind], kind != "hoist"),
                 {"seed": 1 + int(degrees) % SEEDS, "start_angle": degrees, **_inertia(kind, size)})


def _inertia(kind, size):
    if kind != "inertia":
        return {}
    return {"overrides": {"motor": {"load": {"inertia_ratio": float(size), "stiffness_nm_rad": 0.0}}}}


def judge(run, allowed, bounded=True):
    """In operation with the right offset, or off with a reason that is true; there is no third outcome.

    bounded   the rotor moves no further than the method needs; a load that drives it may add to that
    """
    fault, began = first_fault(run), operation_s(run)
    end_s = next(t for t in (began, fault_s(run), run.trace["t_s"][-1]) if t is not None)
    moved = excursion_deg(run, None, end_s + run.period_s)
    figures = {"time to operation, s": None if began is None else began - ON_S, "movement, deg": moved,
               "movement, deg el.": moved * run.drive.motor["electrical"]["pole_pairs"]}
    figures["peak current, % of i_trip"] = peak = 100 * peak_share(run)
    beyond = [f"{peak:.0f} % of i_trip flowed"] if peak > 100 * PEAK_MAX else []
    if fault:
        why = _of_fault(run, fault, began, allowed)
        return Verdict(fault, "; ".join([*([why] if why else []), *beyond]), figures)
    if began is None:
        return Verdict("undecided", f"neither {OPERATION} nor a fault after {run.trace['t_s'][-1]:.1f} s", figures)
    turning = late_s(run, STAND_S)
    windows = {"standing": run.window(turning - DECIDED_S, turning), "turning": run.window(turning + TURN_S / 2, None)}
    count = run.drive.motor["control"]["angle_source"] == 0
    unseen_deg = {"standing": run.drive.sensed_deg / (2 if count else 1), "turning": 0.0}
    wrong = list(beyond)
    for name, window in windows.items():
        error = mean_angle_deg(angle_error_deg(run, window))
        figures[f"offset error {name}, deg el."] = error
        wrong += [f"offset {error:+.1f} degrees electrical {name}"] if abs(error) > OFFSET_MAX_DEG + unseen_deg[name] else []
    if bounded and figures["movement, deg el."] > MOVEMENT_MAX_DEG:
        wrong.append(f"the rotor moved by {figures['movement, deg el.']:.0f} degrees electrical")
    return Verdict("misaligned" if wrong else "operation", "; ".join(wrong), figures)


def peak_share(run):
    """The largest current of a phase, of i_trip."""
    return max(float(run.trace[f"i_{phase}_peak_A"].max()) for phase in "abc") / run.names["i_trip_A"]


def _of_fault(run, fault, began, allowed):
    if not bridge_is_off(run):
        return f"{fault}, and the bridge is on"
    if began is not None:
        return f"{fault} {fault_s(run) - began:.2f} s after it had begun to operate"
    return "" if matches(fault, allowed) else f"{fault} is no reason here ({' or '.join(allowed) or 'there is none'})"
