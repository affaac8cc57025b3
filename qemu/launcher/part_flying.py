# SPDX-License-Identifier: MIT
"""PART=sensorless, flying/SPEED: a rotor that turns already, at so many percent of rated speed, is caught, and turned the way
the command says. SPEED may be negative: it windmills backwards. Somebody turns the shaft until `on`, and lets go then.
"""
import numpy as np

from .errors import LauncherError
from .part import ON_S, Setup, Verdict, angle_error_deg, bridge_is_off, event, first_fault, late, numbers, operation_s, scenario

PERCENTS = (100, 80, 60, 40, 30, 20, 15, 10, 5)
WHATS = tuple(f"flying/{sign * percent}" for percent in PERCENTS for sign in (1, -1)) + ("flying/0",)
LOCKED_S = 0.05           # from the first time that the bridge was on
TORQUE_MAX_SHARE = 0.1    # of rated, until then, beyond what the shaft had before
ANGLE_MAX_DEG = 15.0      # mean of its magnitude from the tenth millisecond of operation on, for as long
COMMAND_S, RUN_S, LONGEST_S = 0.1, 0.8, 12.0
TURNS = "ROTOR_TURNING"   # a motor that needs injection is not caught: what that has to know is measured at rest
BEGUN_S = 0.0007          # the speed loop's first step comes after that


def setup(what, drive):
    """The run of one case."""
    share = numbers(what, "flying", -100, 100)[0] / 100
    if abs(share) > 1:
        raise LauncherError(f"flying/{what}: at most 100 %")
    names = drive.names()
    rated_rpm = min(names["rated_speed_rpm"], names["speed_max_rpm"])
    turning_s = (abs(share) * rated_rpm + names["work_rpm"]) / names["ramp_rpm_s"] + 2 * names["field_ramp_s"] + RUN_S
    steps = [{"t_s": 0.0, **event("encoder_cut", "1")},
             {"t_s": 0.0, **event("spin_rad_s", f"{share * rated_rpm * np.pi / 30:.9g}")},
             {"t_s": ON_S + 0.001, **event("spin", "off")},
             late(COMMAND_S, console="speed {work_rpm}"), late(COMMAND_S + turning_s, **event("end"))]
    return Setup(scenario(f"sensorless, turning at {100 * share:g} %", steps, LONGEST_S + turning_s),
                 lambda run: judge(run, names["work_rpm"], drive.params.get("injection_mv", 0) != 0),
                 {"overrides": {"params": {"angle_source": 1}}})


def judge(run, rpm, injects):
    """Caught within its time, softly and at the right angle; or, too slow for that, started as from rest. Then it runs. A motor
    that `injects` is told to wait, as long as it is seen to turn."""
    from .part_sensorless import judge_running, refused

    fault, began = first_fault(run), operation_s(run)
    if fault:
        named = injects and fault == TURNS and began is None
        wrong = "" if named else f"{fault} is no reason here"
        return Verdict(fault, wrong if bridge_is_off(run) else f"{fault}, and the bridge is on")
    if began is None:
        return refused(run)
    t = run.trace["t_s"]
    on_s = float(t[np.flatnonzero(run.trace["gate_live"])[0]])
    figures, wrong = {}, []
    window = run.window(began, began + run.period_s * 3)
    caught = bool((window["observer_leads"] > 0.5).any()) and not injects
    if caught:
        wrong += judge_catch(run, on_s, began, figures)
    wrong += judge_running(run, rpm, figures)
    return Verdict("wrong" if wrong else "caught" if caught else "started", "; ".join(wrong), figures)


def judge_catch(run, on_s, began, figures):
    """What is wrong with how it was caught; adds to the figures."""
    rated_nm, before = run.rated("rated_torque_nm"), run.window(ON_S - 0.02, ON_S)
    during = run.window(on_s - 0.001, began + BEGUN_S)
    moved = np.abs(during["torque_Nm"] - before["torque_Nm"].mean()) / rated_nm
    after = run.window(began + 0.01, began + 0.02)
    leads = after["observer_leads"] > 0.5  # or the field has taken over: then the angle is the load's
    off = float(np.abs(angle_error_deg(run, after))[leads].mean()) if leads.any() else 0.0
    figures |= {"caught after, ms": 1000 * (began - on_s), "torque until then, % of rated": 100 * float(moved.max()),
                "angle error then, deg": off if leads.any() else None}
    wrong = [] if began - on_s <= LOCKED_S else [f"caught after {1000 * (began - on_s):.0f} ms"]
    wrong += [] if moved.max() <= TORQUE_MAX_SHARE else [f"{100 * moved.max():.0f} % of rated torque until it was caught"]
    return wrong + ([] if off <= ANGLE_MAX_DEG else [f"the angle was {off:.0f} degrees off"])
