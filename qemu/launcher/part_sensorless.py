# SPDX-License-Identifier: MIT
"""PART=sensorless: without an encoder the drive starts, catches a rotor that turns, and comes back after it has lost it; or
says why not. There is no third outcome.

WHAT is start/ANGLE/LOAD: start/45/friction50 has the rotor at 45 degrees electrical and friction of 50 % of rated torque on it,
hoist50 a hoist that a ratchet holds at standstill. Where there is a load, i_align is i_max.
flying/SPEED is part_flying.py's, lost/CAUSE part_lost.py's. The encoder's lines are cut in all of them.
"""
import re

import numpy as np

from . import part_flying, part_lost
from .errors import LauncherError
from .part import (ON_S, OPERATION, PartCase, Setup, Verdict, angle_error_deg, bridge_is_off, event, fault_s, first_fault, late,
                   late_s, matches, numbers, operation_s, scenario)
from .refusals import refusals

NAME = "sensorless"
REFUSAL = "reluctance"
INJECTION_SHARE = 0.2
LOADS = ("free", "friction50", "friction100", "hoist50")
SEEDS = 8
COMMAND_S, RUN_S, LONGEST_S = 0.1, 0.8, 12.0
BACKWARDS_MAX_DEG = 90.0  # electrical, from the command on
SPEED_ERROR_MAX = 0.05    # of the command, mean of the last 0.2 s
ANGLE_RMS_MAX_DEG = 10.0  # of those, where the observer leads
WATCH_S = 0.2
LOADED = ("OUT_OF_STEP", "LOCK_LOST", "LOAD_TOO_HIGH")
DRIVEN = (*LOADED, "OVERCURRENT")  # a hoist that is let down turns the rotor whatever the drive does


def plan(motors, options):
    """ANGLES and LOADS thin out the starts."""
    wanted = [f"{angle:g}" for angle in numbers(options.get("angles") or "", "ANGLES", 0, 360)] or [
        f"{angle}" for angle in range(0, 360, 5)]
    loads = (options.get("loads") or "").replace(",", " ").split() or LOADS
    starts = [PartCase(NAME, motor, f"start/{angle}/{load}") for motor in motors for load in loads for angle in wanted]
    return starts + [PartCase(NAME, motor, what) for motor in motors for what in (*part_flying.WHATS, *part_lost.WHATS)]


def setup(what, drive):
    """The run of one case."""
    kind, _, rest = what.partition("/")
    if kind == "flying":
        return part_flying.setup(rest, drive)
    if kind == "lost":
        return part_lost.setup(rest, drive)
    match = re.fullmatch(r"([\d.]+)/(free|(hoist|friction)(\d{1,3}))", rest)
    if kind != "start" or match is None:
        raise LauncherError(f"'{what}' is none of start/ANGLE/free, friction50 or hoist50, flying/PERCENT, lost/CAUSE")
    angle, load = numbers(match[1], "angle", 0, 360)[0], int(match[4] or 0)
    names = drive.names()
    params = {"angle_source": 1, **({"i_align_ma": drive.params["i_max_ma"]} if load else {}), **_injection(drive)}
    rpm, up_s = names["work_rpm"], COMMAND_S + names["field_ramp_s"] + RUN_S
    hoisted = match[3] == "hoist"
    allowed = () if not load else DRIVEN if hoisted else LOADED
    pulls = [{"t_s": 0.0, **event({"hoist": "load_hoist", "friction": "load_coulomb"}[match[3]],
                                  f"{load / 100} * rated_torque_Nm")}] if load else []
    steps = [{"t_s": 0.0, **event("encoder_cut", "1")}, *pulls, late(COMMAND_S, console="speed {work_rpm}"),
             late(up_s, **event("end"))]
    return Setup(scenario(f"sensorless start at {angle:g} degrees, {match[2]}", steps, LONGEST_S + up_s),
                 lambda run: judge(run, rpm, allowed, hoisted),
                 {"seed": 1 + int(angle) % SEEDS, "start_angle": angle, "overrides": {"params": params}})


def _injection(drive):
    """What docs/motors.md tells who takes the encoder off a motor whose reluctance outweighs its magnets."""
    if not drive.is_reluctant or drive.motor["control"]["injection_v"]:
        return {}
    return {"injection_mv": round(INJECTION_SHARE * drive.params["v_min_mv"])}


def judge(run, rpm, allowed, driven):
    """At the speed and with the right angle, never backwards; or off for a reason that is true of the load, and then backwards
    only if the load drives it."""
    fault, began = first_fault(run), operation_s(run)
    if not fault and began is None:
        return refused(run)
    figures = {"time to operation, s": None if began is None else began - ON_S}
    wrong = []
    commanded = late_s(run, COMMAND_S)
    if commanded is not None and commanded < run.trace["t_s"][-1] - run.period_s:
        figures["backwards, deg el."] = back = backwards_deg(run, commanded)
        wrong += [f"backwards by {back:.0f} degrees electrical"] if back > BACKWARDS_MAX_DEG and not (fault and driven) else []
    if fault:
        wrong += [] if bridge_is_off(run) else ["the bridge is on"]
        wrong += [] if matches(fault, allowed) else [f"{fault} is no reason here"]
        return Verdict(fault, "; ".join(wrong), figures)
    wrong += judge_running(run, rpm, figures)
    return Verdict("wrong" if wrong else "runs", "; ".join(wrong), figures)


def refused(run):
    """`on` may be refused where reluctance outweighs the magnets, by that name, and nothing moves."""
    answers = [refusal.answer for refusal in refusals(run.console, []) if refusal.line == "on"]
    named = any(REFUSAL in answer for answer in answers)
    live = bool(run.trace["gate_live"].any())
    return Verdict("refused" if named and not live else "undecided", "" if named and not live else
                   f"neither {OPERATION} nor a fault nor a refusal that says why")


def backwards_deg(run, from_s):
    """By how much the rotor was behind where it had been furthest ahead before its last advance: from a command forward on."""
    angle = run.electrical_angle(run.window(from_s, None))
    angle = np.degrees(np.unwrap(np.asarray(angle)))
    return float(np.max(angle[0] - angle)) if len(angle) else 0.0


def judge_running(run, rpm, figures):
    """What is wrong with how it runs in the end; adds to the figures."""
    end_s = run.trace["t_s"][-1]
    window = run.window(end_s - WATCH_S, None)
    off = abs(float(window["speed_rpm"].mean()) - rpm) / abs(rpm)
    figures["speed error in the end, %"] = 100 * off
    wrong = [f"{window['speed_rpm'].mean():.0f} instead of {rpm:.0f} rpm"] if off > SPEED_ERROR_MAX else []
    leads = window["observer_leads"] > 0.5
    if leads.all():
        rms = float(np.sqrt(np.mean(angle_error_deg(run, window) ** 2)))
        figures["angle error in the end, deg rms"] = rms
        wrong += [f"the angle is {rms:.0f} degrees off"] if rms > ANGLE_RMS_MAX_DEG else []
    if fault_s(run) is None and run.trace["state"][-1] != run.state_code(OPERATION):
        wrong.append("not in operation")
    return wrong
