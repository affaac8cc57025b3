# SPDX-License-Identifier: MIT
"""PART=supervision, stopping: a quick stop and a reversal from full speed on a supply that takes nothing back.

WHAT is quickstop/no_chopper, quickstop/chopper, reversal/no_chopper or reversal/chopper. Without a chopper what the motor gives
back has to go into its own losses, so that it takes longer; with one there is no reason to.
"""
import numpy as np

from .errors import LauncherError
from .kinds_speed import moving_mean
from .part import OPERATION, PartCase, Setup, Verdict, event, first_fault, late, late_s, scenario

NAME = "supervision"
WHATS = tuple(f"{how}/{brake}" for how in ("quickstop", "reversal") for brake in ("no_chopper", "chopper"))
START_LONGEST_S = 10.0
LONGEST_S = 20.0          # without a chopper
CHOPPED_SLOWER = 1.5      # with one: times the ramp
NEAR_SHARE = 0.1          # of the speed: so near to its end a ramp rounds off
SIGN_TOLERANCE = 0.15     # of rated torque: ripple, and the torque that carries friction before the command
SMOOTHED_S = 0.02         # a speed loop that works swings around what the ramp takes, a limiter pushes for longer
COMMAND_TAKES_S = 0.02


def plan(motors):
    """All four with every motor."""
    return [PartCase(NAME, motor, what) for motor in motors for what in WHATS]


def setup(what, drive):
    """The run of one case."""
    if what not in WHATS:
        raise LauncherError(f"no case '{what}' of supervision; there are CAUSE/SPEED/LOAD (slip60/speed100/load50) and"
                            f" {', '.join(WHATS)}")
    how, brake = what.split("/")
    names = drive.names()
    rpm = round(min(names["rated_speed_rpm"], names["speed_max_rpm"]))
    ramp_s = rpm / names["ramp_rpm_s"]
    command_s = 0.1 + ramp_s + names["settle_s"] + 0.1
    ideal_s = ramp_s if how == "quickstop" else 2 * ramp_s
    in_time_s = LONGEST_S if brake == "no_chopper" else CHOPPED_SLOWER * ideal_s + names["settle_s"]
    steps = [late(0.1, console=f"speed {rpm}"),
             late(command_s, console="quickstop" if how == "quickstop" else f"speed -{rpm}"),
             late(command_s + in_time_s, **event("end"))]
    if how == "quickstop":
        steps += [{"t_s": 0.05, "after_state": f"{OPERATION} QUICK_STOP {end}", **event("end")}
                  for end in ("READY", "SWITCH_ON_DISABLED")]
    target = 0 if how == "quickstop" else -rpm
    return Setup(scenario(what, steps, START_LONGEST_S + command_s + in_time_s),
                 lambda run: judge(run, rpm, target, command_s, in_time_s),
                 {"overrides": {"inverter": {"supply": supply(drive, brake == "chopper")}}})


def supply(drive, chopper):
    """A supply that does not sink; the chopper takes twice rated power between the bus and its limit."""
    names = drive.names()
    vbus_v, room_v = names["vbus_V"], names["v_max_V"] - names["vbus_V"]
    power_w = 2 * names["rated_torque_Nm"] * names["rated_speed_rpm"] * names["rad_s_per_rpm"]
    brake = {"chopper_ohm": vbus_v ** 2 / power_w, "chopper_on_v": vbus_v + 0.6 * room_v,
             "chopper_off_v": vbus_v + 0.5 * room_v}
    return {"supply_sinks": 0, **(brake if chopper else dict.fromkeys(brake, 0.0))}


def judge(run, rpm, target_rpm, command_s, in_time_s):
    """It gets there in time, without a fault, the bus below its limit, and the torque never against the command."""
    began, fault = late_s(run, command_s), first_fault(run)
    if began is None or began >= run.trace["t_s"][-1]:
        return Verdict("failed before", f"{fault or 'no operation'} before the command")
    after = run.window(began, None)
    there = np.flatnonzero(after["speed_rpm"] <= target_rpm + NEAR_SHARE * rpm)
    took_s = float(after["t_s"][there[0]] - began) if len(there) else None
    braking_s = None if took_s is None else max(took_s, 2 * COMMAND_TAKES_S)
    braking = run.window(began + COMMAND_TAKES_S, None if took_s is None else began + braking_s)
    bus_v, rated_nm = float(after["vbus_V"].max()), run.rated("rated_torque_nm")
    against_nm = float(moving_mean(braking["torque_mean_Nm"], max(1, round(SMOOTHED_S / run.period_s))).max())
    figures = {"took, s": took_s, "highest bus voltage, % of v_max": 100 * bus_v / run.names["v_max_V"],
               "torque against the command, % of rated": 100 * max(0.0, against_nm) / rated_nm}
    wrong = [fault] if fault else []
    if took_s is None or took_s > in_time_s:
        wrong.append(f"not there after {in_time_s:.1f} s")
    if bus_v >= run.names["v_max_V"]:
        wrong.append(f"the bus rose to {bus_v:.1f} V ({run.names['v_max_V']:.1f})")
    if against_nm > SIGN_TOLERANCE * rated_nm:
        wrong.append(f"torque against the command: {against_nm:.3g} N m")
    return Verdict(fault or ("late" if took_s is None else "stopped"), "; ".join(wrong), figures)
