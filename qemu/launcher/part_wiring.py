# SPDX-License-Identifier: MIT
"""PART=wiring: what is connected or told wrongly is found and named before the rotor passes 5 % of rated speed (20 % where the
encoder counts nothing).

Of what cannot be told apart by looking at currents and counts (a turned encoder and two exchanged phases; pole pairs and
counts whose ratio is the same) either name will do; what the case is really called comes first.
"""
import re
from dataclasses import dataclass, replace

import numpy as np

from .errors import LauncherError, choice
from .params import detuned
from .part import (ON_S, PartCase, Setup, Verdict, angle_error_deg, bridge_is_off, event, fault_s, first_fault, late, matches,
                   mean_angle_deg, operation_s, scenario)
from .refusals import refusals

NAME = "wiring"
SPEED_MAX_SHARE = 0.05   # of rated speed
OFFSET_MAX_DEG = 3.0
DEAD_SHARE = 0.2         # where the encoder counts nothing: the firmware cannot see the speed either
LONGEST_S, STAND_S, TURN_S = 35.0, 0.1, 1.0
STARTS = 3               # or as long as so many starts with what is told: few pole pairs and a slow motor take long
DRIVEN_S = 3.0           # somebody who turns the shaft goes on doing so: there is nothing to wait for
# A count that is 2 % off shows when the index has come twice: so many turns at less than the speed allowed, then faster.
SLOW_SHARE, SLOW_TURNS = 0.04, 2.2

# Pole pairs decide which speeds and bandwidths are possible: with others than the motor's `on` may be refused, nothing moving.
BEYOND = "pole_pairs|speed_bw_hz"
REVERSED = ("encoder_reverse", "1")
DIRECTION, RATIO = ("ENCODER_DIRECTION", "PHASE_ORDER"), ("POLE_PAIRS", "ENCODER_COUNTS")


@dataclass(frozen=True)
class Wish:
    """What is wrong: events from the first instant, what the firmware is told, and the faults that say so (none: harmless).

    seen_deg   of exchanged phases: the angle whose half is the mirror in which the firmware sees the rotor
    """
    faults: tuple
    events: tuple = ()
    detune: str = ""
    driven: bool = False  # somebody else turns the shaft
    refusal: str = ""     # `on` may also be refused with words that match this
    seen_deg: float = None
    start_deg: float = 50.0


def _told(faults, detune, refusal=""):
    return Wish(faults, detune=detune, refusal=refusal)


WISHES = {
    "right": Wish(()),
    "counts*0.98": _told(RATIO[::-1], "encoder_counts*0.98"), "counts*1.02": _told(RATIO[::-1], "encoder_counts*1.02"),
    "counts*1.024": _told(RATIO[::-1], "encoder_counts*1.024"), "counts*0.5": _told(RATIO[::-1], "encoder_counts*0.5"),
    "counts*2": _told(RATIO[::-1], "encoder_counts*2"),
    "encoder_reversed": Wish(DIRECTION, (REVERSED,)),
    "swap_AB": Wish(DIRECTION[::-1], (("phase_swap", "AB"),)), "swap_BC": Wish(DIRECTION[::-1], (("phase_swap", "BC"),)),
    "swap_CA": Wish(DIRECTION[::-1], (("phase_swap", "CA"),)),
    "reversed_and_AB": Wish((), (REVERSED, ("phase_swap", "AB")), seen_deg=120),
    "reversed_and_BC": Wish((), (REVERSED, ("phase_swap", "BC")), seen_deg=0),
    "reversed_and_CA": Wish((), (REVERSED, ("phase_swap", "CA")), seen_deg=240),
    "open_A": Wish(("OPEN_PHASE",), (("phase_open", "A", "1"),)), "open_B": Wish(("OPEN_PHASE",), (("phase_open", "B", "1"),)),
    "open_C": Wish(("OPEN_PHASE",), (("phase_open", "C", "1"),)),
    "encoder_frozen": Wish(("ENCODER_DEAD",), (("encoder_freeze", "1"),)),
    "encoder_cut": Wish(("ENCODER",), (("encoder_cut", "1"),)),
    "locked": Wish(("ROTOR_BLOCKED",), (("lock", "1"),)),
    "brake": Wish(("ROTOR_BLOCKED", "LOAD_TOO_HIGH"), (("load_coulomb", "5 * max_torque_Nm"),)),
    "turning_3": Wish(("ROTOR_TURNING",), (("spin_rad_s", "0.03 * rated_speed_rpm * rad_s_per_rpm"),), driven=True,
                      refusal="turning"),
    "turning_30": Wish(("ROTOR_TURNING",), (("spin_rad_s", "0.3 * rated_speed_rpm * rad_s_per_rpm"),), driven=True,
                      refusal="turning"),
    "turning_back_10": Wish(("ROTOR_TURNING",), (("spin_rad_s", "-0.1 * rated_speed_rpm * rad_s_per_rpm"),), driven=True,
                      refusal="turning"),
    "sensor_A_negative": Wish(("SENSOR_SIGN", "CURRENT_SUM"), (("sensor_gain", "A", "-1"),)),
    "sensor_B_negative": Wish(("SENSOR_SIGN", "CURRENT_SUM"), (("sensor_gain", "B", "-1"),)),
    **{f"sensors_{order}": Wish(("SENSORS_EXCHANGED",), (("sensor_order", order),))
       for order in ("BAC", "ACB", "CBA", "BCA", "CAB")},
    "sensors_BAC_and_A_negative": Wish(("SENSORS_EXCHANGED", "CURRENT_SUM"),
                                       (("sensor_order", "BAC"), ("sensor_gain", "A", "-1"))),
}


def wishes_of(pole_pairs):
    """{name: Wish}: the list, and every number of pole pairs from 1 to twice the motor's."""
    told = {f"pole_pairs={n}": _told(RATIO, f"pole_pairs={n}", BEYOND) for n in range(1, 2 * pole_pairs + 1) if n != pole_pairs}
    return {**WISHES, **told}


def plan(motors, _options):
    """Every wish with every motor."""
    from .data import load_motor

    return [PartCase(NAME, motor, what) for motor in motors
            for what in wishes_of(load_motor(motor)["electrical"]["pole_pairs"])]


def setup(what, drive):
    """The run of one case."""
    wishes = wishes_of(drive.motor["electrical"]["pole_pairs"])
    if what not in wishes:
        raise LauncherError(f"no wiring '{what}'; there are: {choice(what, wishes)}")
    wish = wishes[what]
    steps = [{"t_s": 0.0, **event(*words)} for words in wish.events]
    slow_rpm = max(1, round(SLOW_SHARE * drive.names()["rated_speed_rpm"]))
    slow_s = SLOW_TURNS * 60 / slow_rpm
    steps += [late(STAND_S, console=f"speed {slow_rpm}"), late(STAND_S + slow_s, console="speed {low_rpm}"),
              late(STAND_S + slow_s + TURN_S, **event("end"))]
    longest_s = DRIVEN_S if wish.driven else max(LONGEST_S, STARTS * told_on_time_s(drive, wish.detune))
    return Setup(scenario(what, steps, longest_s + slow_s), lambda run: judge(run, wish),
                 {"detune": wish.detune, "start_angle": wish.start_deg})


def told_on_time_s(drive, detune):
    """How long a start takes with what the drive is told."""
    return replace(drive, params=detuned(drive.params, detune)[0]).on_time_s


def _refused(run, wish):
    """Whether `on` was refused for the right reason, so that the bridge was never on."""
    answers = [refusal.answer for refusal in refusals(run.console, []) if refusal.line == "on"]
    right = bool(wish.refusal) and any(re.search(wish.refusal, answer) for answer in answers)
    return right and not run.trace["gate_live"].any()


def judge(run, wish):
    """The right name before 5 % of rated speed; or operation with the right angle where nothing is wrong."""
    fault, began = first_fault(run), operation_s(run)
    until_s = fault_s(run) if fault else run.trace["t_s"][-1]
    limit_rpm = (DEAD_SHARE if "ENCODER_DEAD" in wish.faults else SPEED_MAX_SHARE) * run.rated("rated_speed_rpm")
    fastest_rpm = float(np.abs(run.window(None, until_s + run.period_s)["speed_rpm"]).max())
    figures = {"time to decision, s": (until_s if fault else began or until_s) - ON_S,
               "speed until then, % of rated": 100 * fastest_rpm / run.rated("rated_speed_rpm")}
    if not wish.faults:
        return _harmless(run, wish, fault, began, figures)
    if not fault and _refused(run, wish):
        return Verdict("refused", figures=figures)
    if not fault:
        return Verdict("not found", f"no fault; the rotor reached {fastest_rpm:.0f} rpm", figures)
    wrong = [] if matches(fault, wish.faults) else [f"{fault} instead of {' or '.join(wish.faults)}"]
    if fastest_rpm > limit_rpm and not wish.driven:
        wrong.append(f"{fastest_rpm:.0f} rpm were reached before ({limit_rpm:.0f} are allowed)")
    wrong += [] if bridge_is_off(run) else ["the bridge is on"]
    return Verdict("named" if fault == wish.faults[0] else fault, "; ".join(wrong), figures)


def _harmless(run, wish, fault, began, figures):
    if fault or began is None:
        return Verdict(fault or "undecided", f"{fault or 'no operation'} although nothing is wrong", figures)
    seen = (lambda angle_rad: angle_rad) if wish.seen_deg is None else (lambda angle_rad: np.radians(wish.seen_deg) - angle_rad)
    error = mean_angle_deg(angle_error_deg(run, run.window(run.trace["t_s"][-1] - TURN_S / 2, None), seen))
    figures["offset error turning, deg el."] = error
    wrong = f"offset {error:+.1f} degrees electrical" if abs(error) > OFFSET_MAX_DEG else ""
    return Verdict("misaligned" if wrong else "operation", wrong, figures)
