# SPDX-License-Identifier: MIT
"""Judgements of PART=sensorless, on traces that are made up: what is right passes, and each way to be wrong fails."""
import numpy as np
import pytest

from campaign.made_up import DRIVE, FAULT, OPERATION, PERIOD_S, SWITCHED_ON, made_up
from launcher import part_flying, part_lost, part_sensorless
from launcher.drive import load_drive
from launcher.part import ON_S

RPM = 600
COMMAND_S = 0.8 + PERIOD_S + part_sensorless.COMMAND_S  # of a run that is in operation at 0.8 s


def run(led=True, **changes):
    """Up to speed in a tenth of a second behind the command."""
    given = {"speed_rpm": lambda t: RPM * min(1.0, max(0.0, (t - COMMAND_S) * 10)), "torque_Nm": np.zeros_like,
             "observer_leads": lambda t: np.full(len(t), float(led))}
    return made_up(**{**given, **changes})


def stays_off(console="", **changes):
    made = run(began_s=None, gate_live=lambda t: np.zeros(len(t)), **changes)
    made.console = console
    return made


@pytest.mark.parametrize("what", ("flying/-60", "start/90/free", "start/0/hoist20"))
def test_the_drive_is_told_that_it_has_no_sensor(what):
    assert part_sensorless.setup(what, DRIVE).arguments["overrides"]["params"]["angle_source"] == 1


# ---- start -----------------------------------------------------------------------------------------------------------

def start(allowed=(), driven=False, **changes):
    return part_sensorless.judge(run(**changes), RPM, allowed, driven)


def test_a_start_that_reaches_its_speed_passes():
    verdict = start()
    assert verdict.passed and verdict.outcome == "runs"
    assert verdict.figures["time to operation, s"] == pytest.approx(0.8 - ON_S)
    assert verdict.figures["backwards, deg el."] == 0 and verdict.figures["angle error in the end, deg rms"] < 1e-6


def test_a_fault_is_right_only_if_it_is_true_of_the_load():
    off = {"fault": "LOCK_LOST", "fault_s": 1.2, "end_s": 1.5}
    assert start(part_sensorless.LOADED, **off).passed
    assert "is no reason here" in start(**off).why
    assert "the bridge is on" in start(part_sensorless.LOADED, on_in_fault=True, **off).why


def test_only_a_load_that_drives_may_turn_it_backwards():
    back = {"fault": "LOCK_LOST", "fault_s": 1.4, "speed_rpm": lambda t: -200.0 if t > COMMAND_S else 0.0}
    assert start(part_sensorless.LOADED, driven=True, **back).passed
    assert "backwards by" in start(part_sensorless.LOADED, **back).why
    assert "backwards by" in start(part_sensorless.LOADED, driven=True, speed_rpm=back["speed_rpm"]).why


@pytest.mark.parametrize("motor, given", (("lot:107", True), ("teknic_m2310p", False), ("thor_pmsyrm", False)))
def test_who_takes_the_encoder_off_a_reluctant_machine_gives_it_injection(motor, given):
    """A fifth of v_min; thor's file has its own."""
    drive = load_drive(motor)
    told = part_sensorless.setup("start/45/free", drive).arguments["overrides"]["params"]
    assert ("injection_mv" in told) == given
    assert not given or told["injection_mv"] == pytest.approx(0.2 * drive.params["v_min_mv"], abs=1)


def test_a_refusal_has_to_say_why_and_nothing_moves():
    said = "> on\nerror: reluctance outweighs the magnets\n"
    refused = part_sensorless.judge(stays_off(said), RPM, (), False)
    assert refused.passed and refused.outcome == "refused"
    assert not part_sensorless.judge(stays_off("> on\nerror: no\n"), RPM, (), False).passed
    assert not part_sensorless.judge(run(began_s=None), RPM, (), False).passed, "the bridge was on"


# ---- flying start ----------------------------------------------------------------------------------------------------

CAUGHT_S = ON_S + 0.04


def flying(injects=False, began_s=CAUGHT_S, **changes):
    off_s = changes.get("fault_s", 9.0)
    live = {"gate_live": lambda t: ((t >= ON_S) & (t < off_s)).astype(float), "speed_rpm": RPM, "began_s": began_s}
    return part_flying.judge(run(**{**live, **changes}), RPM, injects)


RATED_NM = DRIVE.motor["rating"]["rated_torque_nm"]


def test_too_slow_to_be_caught_it_starts_as_from_rest():
    late_lead = flying(began_s=1.2, observer_leads=lambda t: (t > 1.5).astype(float))
    assert late_lead.passed and late_lead.outcome == "started"


def test_one_that_injects_waits_for_rest_by_name():
    waits = {"fault": "ROTOR_TURNING", "fault_s": 0.5, "began_s": None}
    assert flying(True, **waits).passed
    assert not flying(False, **waits).passed
    assert "the bridge is on" in flying(True, on_in_fault=True, **{**waits, "gate_live": lambda t: np.ones(len(t))}).why


# ---- a lock that is lost ---------------------------------------------------------------------------------------------

AT_S, LOST_S, AGAIN_S = 0.5, 1.4, 1.5


def lost(cause="thrown", found_s=LOST_S + 0.015, again_s=AGAIN_S, fault="LOCK_LOST", **changes):
    def state(t):
        runs = (t >= 0.8) & ((t < found_s) | (t >= again_s))
        return np.where(runs, OPERATION, np.where(t < 0.8, SWITCHED_ON, FAULT))

    def seen(angle):
        t = np.arange(len(angle)) * PERIOD_S
        return angle + np.radians(90) * ((t >= LOST_S) & (t < again_s))
    made = run(fault=fault, fault_s=found_s, **{"state": state, "seen": seen, **changes})
    return part_lost.judge(made, RPM, AT_S, cause)


def test_a_rotor_that_is_held_need_not_run_again():
    held = {"again_s": 9.0, "speed_rpm": lambda t: RPM * (t < LOST_S)}
    assert lost("stuck", **held).passed and not lost("thrown", **held).passed
    assert not lost("stuck", found_s=LOST_S + 0.03, **held).passed


def test_what_is_borne_needs_no_fault():
    borne = part_lost.judge(run(), RPM, AT_S, "sag")
    assert borne.passed and borne.outcome == "borne"
    assert not part_lost.judge(run(speed_rpm=0.9 * RPM), RPM, AT_S, "sag").passed
    assert "is no reason here" in part_lost.judge(run(began_s=None, fault="STALL", fault_s=0.7), RPM, AT_S, "sag").why


# ---- what each of them says of one that is right but for a change ----

JUDGED = {"start": start, "flying": flying, "lost": lost}


@pytest.mark.parametrize("part, changes, why", [
    ("start", {"speed_rpm": 0.93 * RPM}, "instead of 600 rpm"), ("start", {"speed_rpm": -RPM}, "instead of 600 rpm"),
    ("start", {"offset_deg": 10.5}, "degrees off"), ("start", {"offset_deg": 180.0}, "degrees off"),
    ("start", {"speed_rpm": lambda t: RPM if t > 1.3 else -60 * (t > COMMAND_S)}, "backwards by"),
    ("start", {"state": lambda t: np.where((t < 0.8) | (t >= 1.9), SWITCHED_ON, OPERATION)}, "not in operation"),
    ("flying", {"began_s": ON_S + 0.06}, "caught after"),
    ("flying", {"torque_Nm": lambda t: 0.12 * RATED_NM * ((t > ON_S) & (t < CAUGHT_S))}, "% of rated torque until"),
    ("flying", {"seen": lambda angle: angle + np.radians(20) * (np.arange(len(angle)) * PERIOD_S < 1)},
     "the angle was 20 degrees off"),
    ("flying", {"speed_rpm": 0.9 * RPM}, "instead of"), ("flying", {"fault": "LOCK_LOST", "fault_s": 1.0}, "is no reason here"),
    ("lost", {"found_s": LOST_S + 0.023}, "found after"), ("lost", {"fault": "STALL"}, "is no name for it"),
    ("lost", {"again_s": LOST_S + 0.25}, "again after"), ("lost", {"again_s": 9.0}, "not running again"),
    ("lost", {"found_s": 1.1}, "before anything happened"), ("lost", {"speed_rpm": 0.8 * RPM}, "instead of"),
])
def test_one_that_is_wrong_fails_and_says_why(part, changes, why):
    verdict = JUDGED[part](**changes)
    assert not verdict.passed and why in verdict.why and (part != "start" or verdict.outcome == "wrong")


@pytest.mark.parametrize("part, changes, outcome, figures", [
    ("start", {"led": False, "offset_deg": 40}, "runs", {}),  # where the observer does not lead its angle is not judged
    ("flying", {}, "caught", {"caught after, ms": 40}),
    ("flying", {"torque_Nm": lambda t: np.full(len(t), -0.5 * RATED_NM)}, "caught", {}),  # what pulled before is no jerk
    ("lost", {}, "again", {"found after, ms": 15, "again after, ms": 85}),
])
def test_one_that_is_right_passes_with_its_figures(part, changes, outcome, figures):
    verdict = JUDGED[part](**changes)
    assert verdict.passed and verdict.outcome == outcome
    assert {name: verdict.figures[name] for name in figures} == pytest.approx(figures, abs=2.1)
