# SPDX-License-Identifier: MIT
"""PART=sensorless, lost/CAUSE: at working speed something happens that an observer may not bear. It bears it, or says within
20 ms of losing the rotor that it has; and, told to try again, it runs again 200 ms after that where the rotor still turns.

CAUSE: load100 (rated torque at once), sag (the supply gives 80 % for 50 ms), R2 (twice the resistance that is told, and
half of rated torque), thrown (somebody turns the shaft the other way for 5 ms), stuck (holds it).
"""
import numpy as np

from .errors import LauncherError
from .part import (ON_S, OPERATION, PREAMBLE_S, Setup, Verdict, angle_error_deg, event, fault_s, first_fault, late, late_s,
                   matches, operation_s)

CAUSES = ("load100", "sag", "R2", "thrown", "stuck")
WHATS = tuple(f"lost/{cause}" for cause in CAUSES)
LOST_DEG, FOUND_S, AGAIN_S = 60.0, 0.02, 0.2
COMMAND_S, WATCH_S, LONGEST_S = 0.1, 1.0, 12.0
NAMES = ("LOCK_LOST", "OUT_OF_STEP", "SPEED_DEVIATION", "OVERCURRENT", "UNDERVOLTAGE", "OPEN_PHASE")
RETRIES = {"retry_count": 3, "retry_delay_ms": 10, "angle_source": 1}


def _steps(cause, names, at_s):
    rad_s = names["work_rpm"] * np.pi / 30
    if cause == "load100":
        return [late(at_s, **event("load_hoist", "rated_torque_Nm"))]
    if cause == "sag":
        return [late(at_s, **event("supply_v", "0.8 * vbus_V")), late(at_s + 0.05, **event("supply_v", "vbus_V"))]
    if cause == "R2":
        return [late(at_s, **event("load_hoist", "0.5 * rated_torque_Nm"))]
    if cause == "thrown":
        return [late(at_s, **event("spin_rad_s", f"{-rad_s:.9g}")), late(at_s + 0.005, **event("spin", "off"))]
    if cause == "stuck":
        return [late(at_s, **event("lock", "1"))]
    raise LauncherError(f"no cause '{cause}'; there are: {', '.join(CAUSES)}")


def setup(what, drive):
    """The run of one case."""
    names = drive.names()
    at_s = COMMAND_S + names["field_ramp_s"] + 2 * names["settle_s"] + 0.2
    end_s = at_s + WATCH_S + 2 * names["ramp_time_s"]
    steps = [{"t_s": 0.0, **event("encoder_cut", "1")}, {"t_s": ON_S, "console": "on"},
             late(COMMAND_S, console="speed {work_rpm}"), *_steps(what, names, at_s), late(end_s, **event("end"))]
    plan = {"key": "part", "title": f"sensorless, {what}", "preamble_s": PREAMBLE_S, "end_s": LONGEST_S + end_s, "step": steps}
    return Setup(plan, lambda run: judge(run, names["work_rpm"], at_s, what),
                 {"overrides": {"params": RETRIES}, "detune": "resistance_mohm*0.5" if what == "R2" else ""})


def judge(run, rpm, at_s, cause):
    """Borne, or found in time by a name that fits; then running again in time, unless the rotor is held."""
    from .part_sensorless import judge_running, refused

    began, fault, found_s = operation_s(run), first_fault(run), fault_s(run)
    if began is None:
        return Verdict(fault, f"{fault} is no reason here") if fault else refused(run)
    cause_s = late_s(run, at_s)
    if fault and found_s < cause_s:
        return Verdict(fault, f"{fault} before anything happened")
    figures, wrong = {}, []
    if not fault:
        wrong = judge_running(run, rpm, figures)
        return Verdict("wrong" if wrong else "borne", "; ".join(wrong), figures)
    lost_s = _lost_s(run, cause_s, found_s)
    figures["found after, ms"] = 1000 * (found_s - lost_s)
    wrong += [] if matches(fault, NAMES) else [f"{fault} is no name for it"]
    wrong += [] if found_s - lost_s <= FOUND_S else [f"found after {1000 * (found_s - lost_s):.0f} ms"]
    if cause == "stuck":
        return Verdict(fault, "; ".join(wrong), figures)
    again_s = _again_s(run, found_s)
    figures["again after, ms"] = None if again_s is None else 1000 * (again_s - found_s)
    if again_s is None or again_s - found_s > AGAIN_S:
        wrong.append("not running again" if again_s is None else f"again after {1000 * (again_s - found_s):.0f} ms")
    wrong += judge_running(run, rpm, figures)
    return Verdict("wrong" if wrong else "again", "; ".join(wrong), figures)


def _lost_s(run, from_s, to_s):
    """When the field's angle was first so far off that torque turns round soon; the cause's instant at the earliest."""
    if to_s - from_s < 2 * run.period_s:
        return to_s
    window = run.window(from_s, to_s)
    off = np.flatnonzero(np.abs(angle_error_deg(run, window)) > LOST_DEG)
    return float(window["t_s"][off[0]]) if len(off) else to_s


def _again_s(run, from_s):
    window = run.window(from_s + run.period_s, None)
    runs = (window["state"] == run.state_code(OPERATION)) & (window["observer_leads"] > 0.5)
    off = np.flatnonzero(window["state"] != run.state_code(OPERATION))
    hits = np.flatnonzero(runs[off[0]:]) if len(off) else ()
    return float(window["t_s"][off[0] + hits[0]]) if len(hits) else None
