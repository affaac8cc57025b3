# SPDX-License-Identifier: MIT
"""A shaft that meets an end stop, and an encoder that dies at the same speed: both are named by what is true of the plant."""
import numpy as np
import pytest

from launcher import simulate
from launcher.drive import load_drive

TEKNIC, EC45, HUB, ABB = "teknic_m2310p", "maxon_ec45flat", "hoverboard_350w", "abb_m2bj100l"
STOP, FREEZE = ("load_coulomb", "3 * max_torque_Nm"), ("encoder_freeze", "1")
LOCK, SOFT = ("lock", "1"), ("load_coulomb", "1.2 * max_torque_Nm")


def first_fault(tmp_path, motor, command, meets, source=0, lines=(), run_s=None, load=0.0, after_s=1.0):
    """(name, ms after it happened, rpm of the shaft then); the drive goes on for so long behind it, or until a fault."""
    aligned, on = source == 0, "OPERATION_ENABLED"
    run_s = run_s or 0.4 + load_drive(motor, aligned=aligned).names()["ramp_time_s"]
    steps = [{"t_s": 0.13, "console": f"set angle_source {source}"}, *({"t_s": 0.14, "console": line} for line in lines),
             {"t_s": 0.15, "console": "on"}, {"t_s": 0.05, "after_state": on, "console": command},
             {"t_s": run_s - 0.1, "after_state": on, "event": "load_nm", "args": [f"{load} * rated_torque_Nm"]},
             {"t_s": run_s, "after_state": on, "event": meets[0], "args": [meets[1]]},
             {"t_s": run_s + after_s, "after_state": on, "event": "end"}, {"t_s": 0.06, "after_state": "FAULT", "event": "end"}]
    result = simulate({"key": "stop", "end_s": 8, "preamble_s": 0.05, "step": steps}, motor, out_dir=tmp_path, aligned=aligned)
    trace, states = result.trace, {name: code for code, name in result.enums["state"].items()}
    met_s = trace["t_s"][np.flatnonzero(trace["state"] == states[f"AXIS_{on}"])[0]] + run_s
    rows = np.flatnonzero(trace["fault"])
    row = rows[0] if len(rows) else -1
    name = result.enums["fault"][int(trace["fault"][row])].removeprefix("FAULT_")
    return name, (trace["t_s"][row] - met_s) * 1e3, trace["speed_rad_s"][row] * 30 / np.pi, result


@pytest.mark.parametrize("motor, share, meets, source", [
    (TEKNIC, 0.125, STOP, 0), (TEKNIC, -0.4, LOCK, 0), (TEKNIC, 0.02, STOP, 0), (TEKNIC, 0.125, LOCK, 2), (EC45, 0.1, STOP, 0),
    (EC45, -0.4, LOCK, 0), (HUB, 0.3, LOCK, 0), (ABB, 0.15, STOP, 0)])
def test_a_stop_is_a_stall(motor, share, meets, source, tmp_path):
    rpm = share * load_drive(motor).names()["speed_max_rpm"]
    name, after_ms, now_rpm, _ = first_fault(tmp_path, motor, f"speed {rpm:.0f}", meets, source)
    assert name == "STALL" and 0 < after_ms < 700 and abs(now_rpm) < 30


@pytest.mark.parametrize("motor, share", [(TEKNIC, 0.125), (TEKNIC, -0.4), (EC45, 0.1), (HUB, 0.3), (ABB, -0.15)])
@pytest.mark.parametrize("load", [0.0, 0.8])
def test_counts_that_stand_while_the_shaft_turns_are_a_dead_encoder(motor, share, load, tmp_path):
    rpm = share * load_drive(motor).names()["speed_max_rpm"]
    name, after_ms, now_rpm, _ = first_fault(tmp_path, motor, f"speed {rpm:.0f}", FREEZE, load=load if share > 0 else -load)
    assert name == "ENCODER_DEAD" and 0 < after_ms < 25 and abs(now_rpm) > 30


def test_whoever_lets_a_stall_pass_pushes_on(tmp_path):
    name, _, now_rpm, result = first_fault(tmp_path, TEKNIC, "speed 500", STOP, lines=["reaction stall warn"])
    assert name == "NONE" and abs(now_rpm) < 1 and result.console.count("warning: stall") == 1
    assert np.abs(result.trace["i_q_ref_A"][-100:]).min() > 0.9 * result.scenario.names["i_max_A"]


@pytest.mark.parametrize("command", ["torque 3", "torque -2"])
def test_torque_against_a_stop_is_no_fault(command, tmp_path):
    name, _, now_rpm, _ = first_fault(tmp_path, TEKNIC, command, STOP, run_s=0.12)
    assert name == "NONE" and abs(now_rpm) < 1


def test_a_stop_on_the_way_to_a_position_is_a_following_error(tmp_path):
    name, after_ms, _, _ = first_fault(tmp_path, TEKNIC, "pp by 40000", STOP, run_s=0.15, after_s=0.3)
    assert name == "FOLLOWING_ERROR" and after_ms < 100


def test_a_block_is_found_at_once_when_homing_meets_it(tmp_path):
    name, _, _, result = first_fault(tmp_path, TEKNIC, "hm block", LOCK, lines=["set home_rpm 400"], run_s=0.5)
    assert name == "NONE" and "homed" in result.console
