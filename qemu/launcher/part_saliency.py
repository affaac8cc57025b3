# SPDX-License-Identifier: MIT
"""PART=saliency: without an encoder, by injection: the lock from every angle, and rated torque at standstill.

Of the motors those whose file tells injection_v. WHAT is lock/ANGLE; or hold1/ANGLE, hold60/ANGLE: rated torque, by step, for
so many seconds at speed 0. The angle is electrical, from phase A to the rotor's d axis. Each angle has a plant of its own, by
the seed. With /silent behind it the pulses come in drawn order; then no line of the currents' spectrum may stand out.
"""
import re

import numpy as np

from .data import load_motor
from .errors import LauncherError
from .part import (ON_S, PREAMBLE_S, PartCase, Setup, Verdict, angle_error_deg, event, first_fault, late, late_s,
                   mean_angle_deg, numbers, operation_s)
from .tone import heard

NAME = "saliency"
LOCK_MAX_DEG = 2.0      # electrical, mean of the last part of the standstill
RMS_MAX_DEG, PEAK_MAX_DEG = 5.0, 15.0
WAY_MAX_DEG = 10.0      # mechanical, away from where the load was first held
TONE_MAX_DB = 12.0      # of silent pulses: a line above the noise around it, which scatters by some 5 itself
STAND_S, SETTLE_S = 0.2, 0.5
SEEDS = 8


def angles():
    """Every 5 degrees."""
    return range(0, 360, 5)


def plan(motors, options):
    """ANGLES thins it out."""
    wanted = numbers(options.get("angles") or "", "ANGLES", 0, 360) or list(angles())
    able = [motor for motor in motors if load_motor(motor)["control"]["injection_v"] > 0]
    locks = [PartCase(NAME, motor, f"lock/{angle:g}") for motor in able for angle in wanted]
    held = [PartCase(NAME, motor, f"hold1/{angle:g}") for motor in able for angle in wanted if angle % 45 == 0]
    held += [PartCase(NAME, motor, f"hold60/{angle:g}") for motor in able for angle in (0.0, 100.0)]
    return locks + held + [PartCase(NAME, case.motor, f"{case.what}/silent") for case in locks + held]


def setup(what, drive):
    """The run of one case."""
    match = re.fullmatch(r"(lock|hold(\d{1,3}))/(\d+(?:\.\d+)?)(/silent)?", what)
    if match is None:
        raise LauncherError(f"'{what}' is neither lock/ANGLE nor holdSECONDS/ANGLE, each with or without /silent")
    seconds, degrees, silent = float(match[2] or 0), numbers(match[3], "angle", 0, 360)[0], match[4] is not None
    load = [late(STAND_S, **event("load_nm", f"{drive.names()['rated_torque_Nm']:.9g}"))] if seconds else []
    end_s = STAND_S + seconds
    steps = [{"t_s": PREAMBLE_S, **event("encoder_cut", "1")}, {"t_s": ON_S - 0.02, "console": "set angle_source 1"},
             {"t_s": ON_S, "console": "on"}, *load, late(end_s, **event("end")),
             {"t_s": 0.05, "after_state": "FAULT", "event": "end"}]
    plan = {"key": "part", "title": f"injection: {what}", "preamble_s": PREAMBLE_S, "end_s": 2.0 + end_s, "step": steps}
    return Setup(plan, lambda run: judge(run, seconds, silent),
                 {"seed": 1 + int(degrees) % SEEDS, "start_angle": degrees, "detune": f"injection_silent={int(silent)}"})


def judge(run, seconds, silent=False):
    """The angle as the plant has it: its mean at standstill, which also tells a wrong pole, and then under load."""
    fault, began = first_fault(run), operation_s(run)
    if fault or began is None:
        return Verdict(fault or "undecided", f"{fault or 'no operation'} after {run.trace['t_s'][-1]:.2f} s")
    loaded = late_s(run, STAND_S)
    standing = run.window(loaded - STAND_S / 2, loaded)
    lock = mean_angle_deg(angle_error_deg(run, standing))
    from_on = _way_deg(run.window(ON_S, loaded)) * run.drive.motor["electrical"]["pole_pairs"]
    figures = {"time to operation, s": began - ON_S, "angle error at standstill, deg el.": lock,
               "moved from on to operation, deg el.": from_on}
    wrong = [f"{lock:+.1f} degrees electrical off"] if abs(lock) > LOCK_MAX_DEG else []
    if seconds:
        wrong += _judge_load(run, loaded, figures) + _judge_sound(run, loaded, figures, silent)
    return Verdict("off" if wrong else "operation", "; ".join(wrong), figures)


def _judge_load(run, loaded, figures):
    error = angle_error_deg(run, run.window(loaded, None))
    settled = run.window(loaded + SETTLE_S, None)
    rated = run.drive.names()["rated_torque_Nm"]
    figures |= {"angle error under load, rms, deg el.": float(np.sqrt((error**2).mean())),
                "largest": float(np.abs(error).max()), "way once settled, deg": _way_deg(settled),
                "torque, percent of rated": float(100 * settled["torque_mean_Nm"].mean() / rated)}
    rms, peak, way = (figures[name] for name in ("angle error under load, rms, deg el.", "largest", "way once settled, deg"))
    off = rms > RMS_MAX_DEG or peak > PEAK_MAX_DEG
    return [text for bad, text in ((off, f"angle off by {rms:.1f} rms, {peak:.1f} at most"),
                                   (way > WAY_MAX_DEG, f"moved by {way:.1f} degrees")) if bad]


def _judge_sound(run, loaded, figures, silent):
    sound = heard(run.window(loaded + SETTLE_S, None), run.period_s)
    figures |= {"largest line of a current, mA": 1000 * sound.line_a, "above the noise around it, dB": sound.above_db,
                "all from a tenth of the sampling rate on, mA rms": 1000 * sound.rms_a}
    tone = silent and sound.above_db > TONE_MAX_DB
    return [f"a tone of {sound.line_hz:.0f} Hz, {sound.above_db:.0f} dB above the noise"] if tone else []


def _way_deg(window):
    """The largest mechanical angle away from the first row's."""
    angle = window["theta_mech_rad"]
    return float(np.degrees(np.abs(angle - angle[0]).max()))
