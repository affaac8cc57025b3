# SPDX-License-Identifier: MIT
"""An offset that is remembered and no longer the rotor's, by the plant's truth: named with its size before the shaft turns, and
forgotten; one that is right costs a moment. And which way the drive calls forward."""
import re

import numpy as np
import pytest

from launcher import simulate
from launcher.drive import load_drive

from rigs.steps import event, faults, typed

MOST_SHARE = 0.2
PACE_S = 0.032  # `on` takes effect so many times behind the line, with what it works out once more or less
OFF_S, CHANGE_S, AGAIN_S, SPEED_S = 0.5, 0.6, 0.7, 1.3 + 2 * PACE_S
SIZE_DEG = 12
RIGHT_S, RIGHT_SWINGS = 0.25 + PACE_S, 5  # of a heavy rotor about i_max_ma: docs/faults.md
NAMED_SWINGS = 8  # seven pushes of 9/16 and rests of 1/16, half a one to the second place, and what a rest takes longer


def asked_rpm(motor):
    names = load_drive(motor).names()
    return min(max(300, names["low_rpm"]), names["work_rpm"])


def swing_s(motor):
    names = load_drive(motor).names()
    stiffness = names["pole_pairs"] * names["torque_per_ampere"] * names["i_max_A"]
    return 2 * np.pi * np.sqrt(names["inertia_kgm2"] / stiffness)


def speed_s(motor):
    """When the speed is asked for: a wrong offset is named by then."""
    return max(SPEED_S, AGAIN_S + 0.2 + PACE_S + NAMED_SWINGS * swing_s(motor))


def play(tmp_path, motor, changes, more=(), end_s=None, first=(), **how):
    """On with an offset that is right, off, something is changed, on again, and a speed is asked for. `changes` while off."""
    end_s = end_s or speed_s(motor) + 0.3
    steps = [*first, typed(0.15, "on"), typed(OFF_S, "off"), *(event(CHANGE_S, *change) for change in changes),
             typed(AGAIN_S, "on"), typed(speed_s(motor), f"speed {asked_rpm(motor)}"), typed(end_s - 0.02, "fault"), *more]
    return simulate({"key": "offset", "end_s": end_s, "preamble_s": 0.05, "expect_refusal": ".*",
                     "step": sorted(steps, key=lambda step: step["t_s"])}, motor, out_dir=tmp_path, aligned=True, **how)


def slip(motor, error_deg, **how):
    """An encoder that is turned on its shaft: so far are the magnets off then."""
    names = load_drive(motor, **how).names()
    return "encoder_slip", str(round(-error_deg / 360 * names["encoder_counts"] / names["pole_pairs"]))


def shaft(result, from_s, to_s):
    """(degrees that it moved, largest speed in rpm)"""
    part = result.trace.between(from_s, to_s)
    angle = part["theta_mech_rad"]
    rpm = np.abs(np.gradient(angle, part["t_s"])) * 30 / np.pi
    return float(np.degrees(np.ptp(angle))), float(rpm.max())


def said_deg(result):
    return int(re.search(r"the magnets are (-?\d+) degrees from where", result.console)[1])


def started_s(result, from_s):
    """How long the bridge was on before operation, the first time after that."""
    part = result.trace.between(from_s, result.trace["t_s"][-1])
    codes = {name.removeprefix("AXIS_"): code for code, name in result.enums["state"].items()}
    on = np.flatnonzero(part["gate_live"] > 0)[0]
    return float(part["t_s"][np.flatnonzero(part["state"] == codes["OPERATION_ENABLED"])[0]] - part["t_s"][on])


def error_deg(result, from_s, to_s):
    part = result.trace.between(from_s, to_s)
    off = part["angle_fw_rad"] - result.drive.motor["electrical"]["pole_pairs"] * part["theta_mech_rad"]
    return float(np.degrees(np.angle(np.mean(np.exp(1j * off)))))


def away(x, y):
    return abs((x - y + 180) % 360 - 180)


def check_named(result, motor):
    assert faults(result) == ["FAULT_OFFSET"], result.console[-400:]
    moved_deg, rpm = shaft(result, CHANGE_S + 0.01, result.trace["t_s"][-1])
    assert rpm < MOST_SHARE * asked_rpm(motor), (moved_deg, rpm)
    assert not result.trace.between(speed_s(motor), result.trace["t_s"][-1])["gates"].any(), "it was named before"


TURNED = [("teknic_m2310p", 48), ("teknic_m2310p", -120), ("maxon_ec22", 20), ("estun_emj04apb22", 180),
          ("mjbots_mj5208", 90), ("abb_m2bj100l", 33), ("maxon_ec45flat", -90), ("rctimer_gbm5208", 16), ("qs138_3kw", -20)]


@pytest.mark.parametrize("motor, error", TURNED)
def test_an_encoder_turned_on_its_shaft_is_named_with_its_size(motor, error, tmp_path):
    result = play(tmp_path, motor, [slip(motor, error)])
    check_named(result, motor)
    assert away(said_deg(result), error) <= SIZE_DEG


@pytest.mark.parametrize("motor", ("teknic_m2310p", "estun_emj04apb22", "mjbots_mj5208"))
@pytest.mark.parametrize("change", [("phase_swap", "BC"), ("phase_swap", "AB"), ("encoder_reverse", "1")])
def test_wires_exchanged_while_off_are_named(motor, change, tmp_path):
    check_named(play(tmp_path, motor, [change]), motor)


def test_the_next_one_aligns(tmp_path):
    more = [typed(1.8, "clear"), typed(1.85, "on"), typed(4.6, "speed 500"), typed(5.0, "status")]
    result = play(tmp_path, "teknic_m2310p", [slip("teknic_m2310p", -120)], more, end_s=5.1)
    assert faults(result) == ["FAULT_OFFSET"]
    assert abs(error_deg(result, 4.9, 5.1)) < 3 and started_s(result, 1.85) > 1
    assert result.trace.between(5.05, 5.1)["speed_rpm"].mean() == pytest.approx(500, rel=0.02)


@pytest.mark.parametrize("motor", ("teknic_m2310p", "maxon_ec22", "estun_emj04apb22", "rctimer_gbm5208"))
def test_one_that_is_right_costs_a_moment(motor, tmp_path):
    result = play(tmp_path, motor, [])
    assert not faults(result), result.console[-400:]
    moved_deg, rpm = shaft(result, CHANGE_S, speed_s(motor))
    assert started_s(result, AGAIN_S) < max(RIGHT_S, RIGHT_SWINGS * swing_s(motor)) and rpm < MOST_SHARE * asked_rpm(motor)
    assert moved_deg * result.drive.motor["electrical"]["pole_pairs"] < 15
    assert result.trace["speed_rpm"][-100:].mean() == pytest.approx(asked_rpm(motor), rel=0.05)


def test_where_a_push_does_not_tell_it_is_aligned_each_time(tmp_path):
    """Reluctance outweighs the magnets."""
    motor = "thor_pmsyrm"
    end_s = AGAIN_S + load_drive(motor).on_time_s + 0.5
    result = play(tmp_path, motor, [slip(motor, -48)], end_s=end_s)
    assert not faults(result) and abs(error_deg(result, end_s - 0.2, end_s)) < 3
    assert started_s(result, AGAIN_S) > RIGHT_SWINGS * swing_s(motor)


@pytest.mark.parametrize("motor, share", [("teknic_m2310p", 0.3), ("teknic_m2310p", -0.5), ("estun_emj04apb22", 0.5)])
@pytest.mark.parametrize("error", (0, 40, -30))
def test_a_hoist_held_by_its_ratchet_hides_nothing(motor, share, error, tmp_path):
    load = ("load_hoist", f"{share} * rated_torque_Nm")
    held = [event(CHANGE_S - 0.04, "lock", "1"), event(CHANGE_S + 0.04, "lock", "0")]  # until it rests on the ratchet
    result = play(tmp_path, motor, [load, slip(motor, error)], held)
    assert faults(result) == (["FAULT_OFFSET"] if error else []), result.console[-300:]


def test_a_retry_does_not_repeat_it(tmp_path):
    """Neither of this fault nor of one that a wrong offset looks like."""
    result = play(tmp_path, "teknic_m2310p", [slip("teknic_m2310p", 60)], end_s=2.5,
                  first=[typed(0.1, "set retry_count 3"), typed(0.12, "set retry_delay_ms 10")])
    check_named(result, "teknic_m2310p")


@pytest.mark.parametrize("why", ("forget", "stall"))
def test_what_forgets_it(why, tmp_path):
    """By command; and behind a start by memory, by a fault that a wrong offset looks like, whatever has caused it."""
    if why == "forget":
        changes, more, again_s = [], [typed(0.65, "forget")], AGAIN_S
    else:
        changes = []
        more = [event(1.2, "lock", "1"), typed(2.1, "clear"), event(2.15, "lock", "0"), typed(2.2, "on")]
        again_s = 2.2
    result = play(tmp_path, "teknic_m2310p", changes, more, end_s=again_s + 2.8)
    assert faults(result) == ([] if why == "forget" else ["FAULT_STALL"])
    assert started_s(result, again_s) > 1, "it has aligned"


INDEX = [("teknic_m2310p", 48), ("teknic_m2310p", -120), ("estun_emj04apb22", 20), ("maxon_ec22", 180)]


@pytest.mark.parametrize("motor, moved", INDEX)
def test_an_index_that_was_moved_while_it_was_off(motor, moved, tmp_path):
    """Saved, powered off, turned by hand past the index, on."""
    envm, pole_pairs = tmp_path / "envm", load_drive(motor).motor["electrical"]["pole_pairs"]
    index_rad = load_drive(motor).motor["encoder"].get("index_angle_rad", 0.0)
    turn_s = 60 / 300 * 1.3
    steps = [typed(0.15, "on"), typed(0.45, "speed 300"), typed(0.7 + turn_s, "speed 0"), typed(1.0 + turn_s, "off"),
             typed(1.2 + turn_s, "save")]
    kept = simulate({"key": "kept", "end_s": 1.6 + turn_s, "preamble_s": 0.05, "step": steps}, motor, aligned=True, envm=envm,
                    out_dir=tmp_path / "first", spread=0)
    assert "save 1" in kept.console, kept.console[-300:]
    overrides = {"motor": {"encoder": {"index_angle_rad": index_rad + float(np.radians(moved) / pole_pairs)}}}
    steps = [event(0.1, "spin_rad_s", "14"), event(0.62, "spin_rad_s", "0"), event(0.66, "spin", "off"),
             typed(AGAIN_S, "on"), typed(SPEED_S, f"speed {asked_rpm(motor)}"), typed(SPEED_S + 0.28, "fault")]
    moves = {"key": "moved", "end_s": SPEED_S + 0.3, "preamble_s": 0.02, "expect_refusal": ".*", "step": steps}
    result = simulate(moves, motor, out_dir=tmp_path / "second", envm=envm, spread=0, overrides=overrides)
    assert faults(result) == ["FAULT_OFFSET"] and away(said_deg(result), moved) <= SIZE_DEG, result.console[-300:]
    assert shaft(result, AGAIN_S, SPEED_S + 0.3)[1] < MOST_SHARE * asked_rpm(motor)


@pytest.mark.parametrize("source", (0, 1, 2))
def test_the_other_direction_holds_for_every_source(source, tmp_path):
    motor = "hoverboard_350w" if source == 2 else "teknic_m2310p"
    steps = [typed(0.06, "set direction 1"), typed(0.08, f"set angle_source {source}"), typed(0.1, "on"),
             {"t_s": 0.3, "label": "started", "hold_for": "OPERATION_ENABLED"}, typed("started + 0.1", "speed 200"),
             typed("started + 1.2", "status"), {"t_s": "started + 1.3", "event": "end"}]
    result = simulate({"key": "direction", "end_s": "started + 5", "preamble_s": 0.05, "step": steps}, motor, out_dir=tmp_path)
    assert not faults(result)
    part = result.trace.between(result.trace["t_s"][-1] - 0.15, result.trace["t_s"][-1])
    assert np.gradient(part["theta_mech_rad"], part["t_s"]).mean() * 30 / np.pi == pytest.approx(-200, rel=0.05)
    assert re.search(r"speed: (19\d|20\d)\.\d+ rpm, reference 200\.", result.console), result.console[-300:]
