# SPDX-License-Identifier: MIT
"""Judgements of the campaign's parts, on traces that are made up: what is right passes, and each way to be wrong fails."""
import json
import math
import re
from types import SimpleNamespace

import numpy as np
import pytest

from campaign.made_up import DRIVE, MOTOR, OPERATION, POLE_PAIRS, READY, SWITCHED_ON, made_up
from launcher import part_again, part_detune, part_saliency, part_start, part_stop, part_supervision, part_wiring, parts
from launcher.campaign import file_name
from launcher.errors import LauncherError
from launcher.figures import Figure
from launcher.part import PartCase, angle_error_deg, mean_angle_deg
from launcher.part_report import as_markdown, counts, report_part, worst_cases
from launcher.parts import PARTS, is_part, parse, plan_part, run_part_case
from launcher.tone import amplitudes

# ---- angles ----------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("offset", [0, 2.5, -170, 179, 180, 181, -359])
def test_angles_are_compared_around_the_circle(offset):
    run = made_up(offset_deg=offset, speed_rpm=100)
    error = mean_angle_deg(angle_error_deg(run, run.window()))
    assert math.cos(math.radians(error - offset)) == pytest.approx(1) and -180 <= error <= 180


# ---- start -----------------------------------------------------------------------------------------------------------

def start(allowed=(), **run):
    return part_start.judge(made_up(**run), allowed)


def test_a_start_at_the_right_angle_passes():
    verdict = start(offset_deg=2.9, speed_rpm=lambda t: 100.0 * (t > 0.9))
    assert verdict.passed and verdict.outcome == "operation"
    assert verdict.figures["offset error standing, deg el."] == pytest.approx(2.9)
    assert verdict.figures["time to operation, s"] == pytest.approx(0.68)


def test_a_standing_rotor_may_be_anywhere_within_a_count(monkeypatch):
    monkeypatch.setitem(DRIVE.motor["encoder"], "counts_per_rev", 64)
    within = 180 * POLE_PAIRS / 64
    verdict = start(offset_deg=within + 2.9, speed_rpm=lambda t: 100.0 * (t > 0.9))
    assert "turning" in verdict.why and "standing" not in verdict.why
    assert "standing" in start(offset_deg=within + 3.1).why


def test_an_angle_that_goes_wrong_while_turning_fails():
    slipping = start(speed_rpm=lambda t: 100.0 * (t > 0.95), seen=lambda angle: angle + 0.03 * (angle - POLE_PAIRS * 0.3))
    assert not slipping.passed and "turning" in slipping.why and "standing" not in slipping.why


def test_a_fault_needs_a_reason_that_is_true():
    off = {"began_s": None, "fault": "LOAD_TOO_HIGH", "fault_s": 0.5, "end_s": 0.6}
    assert start(("LOAD_TOO_HIGH",), **off).passed
    assert "is no reason here" in start((), **off).why and "is no reason here" in start(("ROTOR_BLOCKED",), **off).why
    assert "the bridge is on" in start(("LOAD_TOO_HIGH",), **off, on_in_fault=True).why
    later = start(("LOAD_TOO_HIGH",), fault="LOAD_TOO_HIGH", fault_s=1.0, end_s=1.1)
    assert "after it had begun to operate" in later.why, "a reason that is found in operation comes too late"


def test_a_rotor_that_is_thrown_about_fails():
    verdict = start(speed_rpm=lambda t: 600.0 if 0.3 < t < 0.38 else 0.0)
    assert "the rotor moved by 11" in verdict.why and verdict.figures["movement, deg"] == pytest.approx(285, abs=5)
    assert start(speed_rpm=lambda t: 600.0 if 0.3 < t < 0.37 else 0.0).passed
    driven = made_up(speed_rpm=lambda t: 600.0 if 0.3 < t < 0.38 else 0.0)
    assert part_start.judge(driven, (), bounded=False).passed, "a load that drives it may add to that"


@pytest.mark.parametrize("outcome", ({}, {"began_s": None, "fault": "LOAD_TOO_HIGH", "fault_s": 0.5, "end_s": 0.6}))
def test_a_start_whose_current_passes_its_trip_fails(outcome):
    """Into operation or not; the gain of a sensor may be 5 % off."""
    trip_a = DRIVE.names()["i_trip_A"]
    for share, passed in ((1.04, True), (1.06, False)):
        verdict = start(("LOAD_TOO_HIGH",), i_b_peak_A=lambda t: np.where(t > 0.4, share * trip_a, 1.0), **outcome)
        assert verdict.passed == passed and ("of i_trip flowed" in verdict.why) != passed, verdict


def again(off_s=1.2, again_s=1.5, **run):
    def states(t):
        return np.where((t >= 0.8) & (t < off_s) | (t >= again_s), OPERATION, np.where(t < 0.8, SWITCHED_ON, READY))
    return part_again.judge(made_up(state=states, **run))


def test_angles_of_the_issue():
    angles = part_start.angles()
    assert {0, 5, 85, 86, 89, 90, 91, 94, 95, 175, 176, 359, 355} <= set(angles) and 84 not in angles and 360 not in angles
    assert len(angles) == len(set(angles)) == 104
    assert len(plan_part("start", [MOTOR], {})) == 104 * 4 + 8
    assert [case.what for case in plan_part("start", [MOTOR], {"angles": "0 90.5", "loads": "free"})] == ["free/0", "free/90.5"]
    for options, complaint in (({"angles": "400"}, "ANGLES '400'"), ({"loads": "hoist"}, "LOADS 'hoist'")):
        with pytest.raises(LauncherError, match=complaint):
            plan_part("start", [MOTOR], options)


# ---- wiring ----------------------------------------------------------------------------------------------------------

SWAPPED = part_wiring.WISHES["swap_AB"]
STOPPED = {"began_s": None, "fault": "PHASE_ORDER", "fault_s": 0.5, "end_s": 0.6}


def test_what_is_wrong_is_named():
    verdict = part_wiring.judge(made_up(**STOPPED), SWAPPED)
    assert verdict.passed and verdict.outcome == "named"
    neighbour = part_wiring.judge(made_up(**{**STOPPED, "fault": "ENCODER_DIRECTION"}), SWAPPED)
    assert neighbour.passed and neighbour.outcome == "ENCODER_DIRECTION"


def test_somebody_else_may_turn_the_shaft_as_fast_as_he_likes():
    wish = part_wiring.WISHES["turning_30"]
    assert wish.driven and not part_wiring.judge(made_up(**STOPPED, speed_rpm=1200), wish).passed
    named = made_up(**{**STOPPED, "fault": "STALL"}, speed_rpm=1200)
    assert part_wiring.judge(named, part_wiring.Wish(("STALL",), driven=True)).passed


@pytest.mark.parametrize("name, mirror_deg", [("right", None), ("reversed_and_AB", 120), ("reversed_and_BC", 0),
                                              ("reversed_and_CA", 240)])
def test_what_is_harmless_works_at_the_angle_that_belongs_to_it(name, mirror_deg):
    wish = part_wiring.WISHES[name]
    seen = None if mirror_deg is None else lambda angle: np.radians(mirror_deg) - angle
    assert part_wiring.judge(made_up(speed_rpm=100, seen=seen), wish).passed
    assert "offset" in part_wiring.judge(made_up(speed_rpm=100, seen=seen, offset_deg=5), wish).why
    assert "although nothing is wrong" in part_wiring.judge(made_up(**STOPPED), wish).why
    assert "no operation" in part_wiring.judge(made_up(began_s=None), wish).why
    if mirror_deg is not None:
        assert not part_wiring.judge(made_up(speed_rpm=100), wish).passed


def test_a_refusal_that_says_why_is_as_good_as_a_fault():
    def refused(words, live=0.0, wish="turning_3"):
        run = made_up(began_s=None, gate_live=lambda t: np.full(len(t), live))
        run.console = f"> on\nerror: {words}\n> "
        return part_wiring.judge(run, part_wiring.WISHES[wish])
    right = "the motor is turning; wait until it stands still"
    assert refused(right).passed and refused(right).outcome == "refused"
    assert not refused("i_max_ma must be less").passed, "another reason"
    assert not refused(right, live=1.0).passed, "the bridge was on"
    assert not refused(right, wish="swap_AB").passed, "nobody turned it"


def test_every_number_of_pole_pairs_up_to_twice_is_told():
    whats = {case.what for case in plan_part("wiring", [MOTOR], {})}
    assert {f"pole_pairs={n}" for n in (1, 2, 3, 5, 6, 7, 8)} <= whats and not whats & {"pole_pairs=4", "pole_pairs=9"}
    assert {"counts*0.98", "counts*1.02", "counts*1.024", "counts*0.5", "counts*2"} <= whats


# ---- supervision -----------------------------------------------------------------------------------------------------

SLIP = {"rpm": 2000, "cause_s": 0.2, "in_time_s": 0.02, "faults": ("ENCODER_SLIP",), "may_hold": False}
FOUND = {"speed_rpm": 2000, "fault": "ENCODER_SLIP", "fault_s": 1.011, "end_s": 1.1}  # the cause is at 1.001


def test_what_it_can_hold_it_may_hold():
    limits = {**SLIP, "may_hold": True}
    assert part_supervision.judge(made_up(speed_rpm=lambda t: 2000 - 500 * (1.0 < t < 1.2)), **limits).outcome == "held"
    stopped = part_supervision.judge(made_up(speed_rpm=lambda t: 400 * (t < 1.05)), **{**limits, "rpm": 400})
    assert "no fault" in stopped.why, "a motor that stands still does not hold its speed"


@pytest.mark.parametrize("what", sorted({case.what for case in plan_part("supervision", [MOTOR], {})}))
def test_every_case_of_supervision_makes_a_scenario(what):
    from launcher.scenario import load_scenario

    setup = part_supervision.setup(what, DRIVE)
    plan = load_scenario(setup.scenario, DRIVE)
    assert plan.late and plan.may_end_early and max(step.t_s for step in plan.late) < plan.end_s


# ---- stopping --------------------------------------------------------------------------------------------------------

STOP = {"rpm": 2000, "target_rpm": 0, "command_s": 0.2, "in_time_s": 0.8}


def braking(t):
    return max(0.0, 2000 - max(0.0, t - 1.001) * 4000)


def test_supplies_that_do_not_sink():
    bare, braked = part_stop.supply(DRIVE, False), part_stop.supply(DRIVE, True)
    assert bare["supply_sinks"] == braked["supply_sinks"] == 0 and not bare["chopper_ohm"]
    assert 24 < braked["chopper_off_v"] < braked["chopper_on_v"] < DRIVE.names()["v_max_V"]
    assert 24 ** 2 / braked["chopper_ohm"] == pytest.approx(2 * 0.2724 * 4000 * math.pi / 30)


# ---- what each of them says of one that is right but for a change ----

JUDGED = {
    "start": lambda **change: start(**change),
    "again": lambda **change: again(**change),
    "wiring": lambda **change: part_wiring.judge(made_up(**{**STOPPED, **change}), SWAPPED),
    "slip": lambda **change: part_supervision.judge(made_up(**{**FOUND, **change}), **SLIP),
    "stop": lambda **change: part_stop.judge(made_up(**{"speed_rpm": braking, **change}), **STOP),
    "reversal": lambda **change: part_stop.judge(made_up(**{"speed_rpm": braking, **change}), **{
        **STOP, "target_rpm": -2000, "in_time_s": 0.9}),
}


@pytest.mark.parametrize("part, change, complaint", [
    *(("start", {"offset_deg": offset}, "degrees electrical standing") for offset in (3.2, -3.2, 90, 180)),
    ("start", {"began_s": None}, "neither"),
    ("again", {"again_s": 1.87}, "it took 0.47 s"), ("again", {"offset_deg": 4}, "offset +4.0 degrees"),
    ("again", {"again_s": 9}, "did not operate again"),
    ("again", {"speed_rpm": lambda t: 20.0 if 1.42 < t < 1.46 else 0.0}, "the rotor moved by 1"),
    ("again", {"off_s": 9}, "was not switched off"), ("again", {"fault": "STALL", "fault_s": 1.45}, "STALL"),
    ("again", {"off_s": 0.1, "again_s": 9}, "it never operated"),
    ("wiring", {"fault": "STALL"}, "STALL instead of PHASE_ORDER or ENCODER_DIRECTION"),
    ("wiring", {"on_in_fault": True}, "the bridge is on"),
    *(("wiring", {"speed_rpm": rpm}, "201 rpm were reached before") for rpm in (201, -201)),
    ("wiring", {"fault": "", "fault_s": None}, "no fault"),
    ("wiring", {"fault": "", "fault_s": None, "began_s": 0.3}, "no fault"),
    ("slip", {"fault": "STALL"}, "STALL instead of ENCODER_SLIP"), ("slip", {"fault_s": 1.022}, "found after 21.0 ms"),
    ("slip", {"fault_s": None, "fault": ""}, "no fault"), ("slip", {"on_in_fault": True}, "the bridge is on"),
    ("slip", {"speed_rpm": lambda t: 2000 if t < 1.005 else 1199}, "the speed was 801 rpm off"),
    ("slip", {"fault_s": 0.9}, "before the cause"), ("slip", {"began_s": None, "fault_s": 0.5}, "before the cause"),
    ("slip", {"i_b_peak_A": lambda t: np.where(t > 1.05, 16.0, 1.0)}, "16.0 A with i_trip 15.0 A"),
    ("stop", {"speed_rpm": 2000}, "not there after 0.8 s"), ("stop", {"fault": "OVERVOLTAGE", "fault_s": 1.2}, "OVERVOLTAGE"),
    ("stop", {"vbus_V": lambda t: 24 + 12.0 * (t > 1.3)}, "the bus rose to 36.0 V"),
    ("stop", {"torque_mean_Nm": lambda t: 0.05 * (t > 1.2)}, "torque against the command"),
    ("stop", {"began_s": None}, "before the command"),
    ("stop", {"speed_rpm": lambda t: max(0.0, 2000 - max(0.0, t - 1.001) * 2000)}, "not there after 0.8 s"),
    ("reversal", {}, "not there"),
])
def test_one_that_is_wrong_fails_and_says_why(part, change, complaint):
    verdict = JUDGED[part](**change)
    assert not verdict.passed and complaint in verdict.why
    assert part != "start" or verdict.outcome == ("misaligned" if "offset_deg" in change else "undecided")


RIGHT = {"again": "again", "slip": "ENCODER_SLIP", "wiring": "named", "stop": "stopped", "reversal": "stopped"}


@pytest.mark.parametrize("part, change, figure, expected", [
    ("again", {}, "time to operation again, s", 0.1), ("slip", {}, "found after, ms", 10), ("stop", {}, "took, s", 0.45),
    ("wiring", {"speed_rpm": lambda t: 500.0 if t > 0.55 else 0.0}, None, None),  # behind the fault
    ("slip", {"speed_rpm": lambda t: 2000 if t < 1.02 else 900}, None, None),  # likewise it may coast
    ("stop", {"torque_mean_Nm": lambda t: 0.2 * (t > 1.47)}, None, None),  # to hold the speed reached
    ("reversal", {"speed_rpm": lambda t: max(-2000, 2000 - max(0, t - 1.001) * 5000)}, None, None),
])
def test_one_that_is_right_passes_with_its_figure(part, change, figure, expected):
    verdict = JUDGED[part](**change)
    assert verdict.passed and verdict.outcome == RIGHT[part]
    assert figure is None or verdict.figures[figure] == pytest.approx(expected, rel=0.05)


# ---- detune ----------------------------------------------------------------------------------------------------------

def test_detuned_runs_keep_the_limits_but_those_of_quality():
    def judged(kind, value):
        run = made_up()
        run.figures = {"f": Figure("f", kind, value, "%", "", max=5.0)}
        return part_detune.judge(run)
    assert judged("speed_error", 4.0).passed and judged("load_dip", 40.0).passed
    assert "f: 6 %, limit <= 5" in judged("speed_error", 6.0).why and not judged("all_faults", None).passed


def test_names_of_detunings():
    assert part_detune.detune_of("R*0.5_L*2") == "resistance_mohm*0.5 ld_uh*2 lq_uh*2"
    assert {part_detune.detune_of(name) for name in part_detune.NAMES} >= {"flux_uwb*2", "inertia_gmm2*5", "inertia_gmm2*0.2"}
    with pytest.raises(LauncherError, match="no detuning 'X"):
        part_detune.detune_of("X*2")
    assert {case.motor for case in plan_part("detune", [], {})} == set(part_detune.MOTORS)


# ---- keys, files, reports --------------------------------------------------------------------------------------------

# ---- saliency --------------------------------------------------------------------------------------------------------

def test_a_lock_is_right_within_two_degrees_and_at_the_right_pole():
    assert part_saliency.judge(made_up(offset_deg=1.9), 0).passed and part_saliency.judge(made_up(offset_deg=-1.9), 0).passed
    for offset in (2.1, 180, -90):
        assert "degrees electrical off" in part_saliency.judge(made_up(offset_deg=offset), 0).why
    assert not part_saliency.judge(made_up(**STOPPED), 0).passed and not part_saliency.judge(made_up(began_s=None), 0).passed


def currents(line_a=0.0):
    """Noise of 10 mA in each phase, and in one a line that changes its sign each sample."""
    noise = np.random.default_rng(3)
    return {f"i_{phase}_A": lambda t, line=line_a * (phase == "b"):
            noise.normal(0, 0.01, len(t)) + line * (1 - 2 * (np.arange(len(t)) % 2)) for phase in "abc"}


def test_a_load_is_held_if_the_angle_is_and_the_shaft_stays():
    rated = DRIVE.names()["rated_torque_Nm"]
    held = {"torque_mean_Nm": lambda t: np.full(len(t), rated), **currents()}
    verdict = part_saliency.judge(made_up(3.0, **held), 1)
    assert verdict.passed and verdict.figures["torque, percent of rated"] == pytest.approx(100)
    swings = made_up(3.0, **held)
    swings.trace["angle_fw_rad"] += np.where(swings.trace["t_s"] > 1.2, np.radians(8) * np.sin(60 * swings.trace["t_s"]), 0)
    assert "angle off by" in part_saliency.judge(swings, 1).why
    gives_way = made_up(3.0, **held, speed_rpm=lambda t: 3.0 if t > 1.6 else 0.0)
    assert "moved by" in part_saliency.judge(gives_way, 1).why


def test_a_tone_is_heard_above_the_noise_and_must_not_be_where_pulses_are_drawn():
    line, above = "largest line of a current, mA", "above the noise around it, dB"
    rms = "all from a tenth of the sampling rate on, mA rms"
    torque = {"torque_mean_Nm": lambda t: np.full(len(t), DRIVE.names()["rated_torque_Nm"])}
    tone, noise = (made_up(20.0, **torque, **currents(amplitude)) for amplitude in (0.05, 0.0))
    heard = part_saliency.judge(tone, 1)
    assert heard.passed and heard.figures[line] == pytest.approx(50, rel=0.05) and heard.figures[above] > 30
    assert heard.figures[rms] == pytest.approx(math.hypot(50, 10 * math.sqrt(0.8)), rel=0.05)
    assert re.search("a tone of (499|500) Hz", part_saliency.judge(tone, 1, True).why), "the line, or its neighbour"
    silent = part_saliency.judge(noise, 1, True)
    assert silent.passed and silent.figures[line] < 2 and silent.figures[above] < 8


def test_a_spectrum_says_what_a_sine_s_amplitude_is_and_where():
    k = np.arange(20000)
    for hz in (3000, 7333):
        hz_of, amplitude = amplitudes(0.25 * np.sin(2 * np.pi * hz * k / 20000), 1 / 20000)
        at = int(np.argmax(amplitude))
        assert hz_of[at] == pytest.approx(hz, abs=10) and amplitude[at] == pytest.approx(0.25, rel=0.16)
    with pytest.raises(LauncherError, match="takes 1024 samples"):
        amplitudes(np.zeros(1000), 1e-3)


def test_only_motors_that_tell_a_voltage_have_cases():
    assert {case.motor for case in plan_part("saliency", [], {})} == {"thor_pmsyrm", "baldor_ecs101m0h7ef4"}
    with pytest.raises(LauncherError, match="no case for these motors"):
        plan_part("saliency", [MOTOR], {})


def test_every_case_has_a_key_and_a_file_of_its_own():
    cases = [case for part in PARTS for case in plan_part(part, [MOTOR, "maxon_ec22", "thor_pmsyrm"], {})]
    assert all(is_part(case.key) and parse(case.key) == case for case in cases)
    assert len({file_name(case.key) for case in cases}) == len(cases)
    assert not is_part("teknic_m2310p/default/1/ld_uh*2")


@pytest.mark.parametrize("key", ["begin:m/x", "start:m", "start:m/", "start"])
def test_a_damaged_key_is_refused(key):
    with pytest.raises(LauncherError, match="is not PART:MOTOR/WHAT"):
        parse(key)


def test_an_unknown_part_or_motor_is_refused():
    with pytest.raises(LauncherError, match="no PART 'begin'; there are: start, wiring, supervision, detune"):
        plan_part("begin", [], {})
    with pytest.raises(LauncherError, match="did you mean start\\?$"):
        plan_part("strat", [], {})
    with pytest.raises(LauncherError, match="no motor 'bogus'"):
        plan_part("start", ["bogus"], {})
    with pytest.raises(LauncherError, match="WHAT 'bogus' is none of the cases of wiring, for example right"):
        plan_part("wiring", [MOTOR], {"what": "bogus"})
    assert [case.what for case in plan_part("wiring", [MOTOR], {"what": "counts*0.98 swap_*"})] == [
        "counts*0.98", "swap_AB", "swap_BC", "swap_CA"]


def test_a_run_that_could_not_be_made_fails(tmp_path):
    outcome = run_part_case(PartCase("wiring", MOTOR, "bogus"), tmp_path)
    assert not outcome["passed"] and "no wiring 'bogus'" in outcome["why"]


def test_a_run_leaves_its_verdict_and_how_long_it_was(tmp_path, monkeypatch):
    result, verdict = SimpleNamespace(trace={"t_s": np.array([0.0, 0.5, 2.5])}), start(offset_deg=2.9)
    monkeypatch.setattr(parts, "play_part_case", lambda *_: (result, verdict))
    outcome = run_part_case(PartCase("start", MOTOR, "free/90"), tmp_path)
    assert outcome == {"part": "start", "motor": MOTOR, "what": "free/90", "outcome": "operation", "passed": True, "why": "",
                       "figures": verdict.figures, "simulated_s": 2.5, "word": "works", "cause": "", "truth": ""}
    assert json.loads(next(tmp_path.glob("*.json")).read_text()) == outcome


def test_the_report_shows_outcomes_worst_cases_and_failures(tmp_path):
    cases = [PartCase("start", motor, f"free/{angle}") for motor in ("a", "b") for angle in (0, 5)]
    outcomes = {case: {"outcome": "operation", "passed": True, "why": "", "figures": {"error": -0.5 * n}}
                for n, case in enumerate(cases)}
    said = []
    assert report_part("start", outcomes, tmp_path, said.append) == 0 and "4 runs, 0 failed" in said[0]
    outcomes[cases[3]] = {"outcome": "misaligned", "passed": False, "why": "offset", "figures": {"error": 7.0}}
    assert report_part("start", outcomes, tmp_path, said.append) == 1
    assert 'FAIL make campaign CASE="start:b/free/5"' in "\n".join(said)
    page = as_markdown("start", outcomes)
    assert page == (tmp_path / "start.md").read_text() and page.startswith("# PART=start: 4 runs, 1 failed\n")
    assert page.endswith('Failures:\n\n- `make campaign CASE="start:b/free/5"`: misaligned: offset\n')
    assert "| b | 1 | 1 | 1/2 |" in counts(outcomes)
    assert '| error | 7 | 1 | `make campaign CASE="start:b/free/0"` |' in worst_cases(outcomes)
    assert report_part("start", {}, tmp_path, said.append) == 1, "nothing run is nothing shown"
