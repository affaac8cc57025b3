# SPDX-License-Identifier: MIT
"""What supervision finds on the motor in the twin: the first fault, when, and what shaft and currents did until then."""
import math
import re

import numpy as np
import pytest
from launcher import simulate
from launcher.drive import load_drive

from rigs.loaded_run import play

TEKNIC = "teknic_m2310p"
OVERSHOOT = 0.03  # of i_trip, within the sample period in which it is passed


CASES = [
    # motor, speed, load, what happens, fault, within ms
    (TEKNIC, 1.0, 0.5, ("encoder_slip", 30), "ENCODER_SLIP", 20),
    (TEKNIC, 1.0, 0.5, ("encoder_slip", 180), "ENCODER_SLIP", 20),
    (TEKNIC, 0.1, 1.0, ("encoder_slip", -90), "ENCODER_SLIP", 20),
    ("abb_m2bj100l", 0.5, 1.0, ("encoder_slip", 60), "ENCODER_SLIP", 20),
    (TEKNIC, 1.0, 0.5, ("encoder_freeze", 1), "ENCODER_DEAD", 20),
    (TEKNIC, 0.1, 1.0, ("encoder_freeze", 1), "ENCODER_DEAD", 20),
    (TEKNIC, 0.5, 1.0, ("phase_open", "A", 1), "OPEN_PHASE", 30),
    ("maxon_ec22", 0.1, 1.0, ("phase_open", "C", 1), "OPEN_PHASE", 30),
    (TEKNIC, 0.5, 0.1, ("load_nm", "2 * rated_torque_Nm"), "SPEED_DEVIATION", 100),
    ("abb_m2bj100l", 0.1, 1.0, ("load_nm", "2 * rated_torque_Nm"), "SPEED_DEVIATION", 100),
]


@pytest.mark.parametrize("motor, share, load, happens, fault, within_ms", CASES)
def test_the_right_fault_comes_first_and_in_time(motor, share, load, happens, fault, within_ms, tmp_path):
    _, seen = play(tmp_path, motor, share, load, happens)
    assert seen.fault == fault and 0 <= seen.after_ms <= within_ms and not seen.still_on, seen
    assert seen.error_percent < 20 and seen.peak_share <= 1 + OVERSHOOT, seen


def test_a_controlled_stop_brings_the_shaft_to_rest_before_the_bridge_is_off(tmp_path):
    """Nobody speaks after the last command."""
    result, seen = play(tmp_path, TEKNIC, 0.25, 0.0, ("load_nm", "0"), until_s=0.7,
                        overrides={"params": {"command_timeout_ms": 900}})
    assert seen.fault == "COMMAND_TIMEOUT" and not seen.still_on
    trace = result.trace
    off = np.flatnonzero((trace["gate_live"][:-1] > 0) & (trace["gate_live"][1:] == 0))[-1]
    assert abs(trace["speed_rad_s"][off]) * 30 / math.pi < 40
    assert trace["t_s"][off] - trace["t_s"][np.flatnonzero(trace["fault"])[0]] > 0.03
    assert "fault: command time-out" in result.console


def test_a_warning_is_announced_once_and_the_motor_runs_on(tmp_path):
    result, seen = play(tmp_path, TEKNIC, 0.5, 0.1, ("load_nm", "1.7 * rated_torque_Nm"), ["reaction speed_deviation warn"])
    assert seen.fault == "NONE" and seen.still_on
    assert result.console.count("warning: speed deviation") == 1


def test_an_inertia_told_five_times_too_large_softens_the_speed_loop(tmp_path):
    result, seen = play(tmp_path, TEKNIC, 0.25, 0.5, ("load_nm", "0"), detune="inertia_gmm2*5")
    assert seen.fault == "NONE" and seen.still_on and result.console.count("warning: oscillation") == 1


def test_a_hot_winding_is_seen_by_its_sensor_and_stops_the_motor(tmp_path):
    result, seen = play(tmp_path, TEKNIC, 0.25, 0.3, ("temperature_c", "140"))
    assert seen.fault == "OVERTEMPERATURE" and seen.after_ms < 110
    assert seen.error_percent < 26, "the quick stop is under way"
    assert "fault: over-temperature" in result.console


@pytest.mark.parametrize("celsius", (-55, 300))
def test_a_temperature_sensor_that_is_open_or_shorted_is_warned_of_until_it_is_mended(celsius, tmp_path):
    """While off, too; the model protects, so nothing is too hot."""
    steps = [{"t_s": 0.15, "event": "temperature_c", "args": [str(celsius)]}, {"t_s": 2.6, "console": "status"},
             {"t_s": 2.7, "event": "temperature_c", "args": ["off"]}, {"t_s": 5.2, "console": "status"}]
    result = simulate({"key": "sensor", "end_s": 5.3, "preamble_s": 0.05, "step": steps}, TEKNIC, out_dir=tmp_path,
                      plant="ideal", spread=0)
    broken, mended = result.console.split("> status")[1:]
    assert result.console.split("> status")[0].count("warning: temperature sensor") == 1
    assert broken.count("warning: temperature sensor") == 1 and "warning" not in mended
    assert re.findall("fault: (.*)", result.console) == ["none"] * 2


WARM = {"winding": ("OVERTEMPERATURE", {"winding_tau_s": 1, "winding_share_pct": 99, "t_max_c": 130}, "i_rated_ma"),
        "stage": ("INVERTER_OVERLOAD", {"inverter_tau_ms": 500}, "inverter_ma")}


@pytest.mark.parametrize("motor, source, warm", [
    ("estun_emj04apb22", 0, "winding"), ("lot:28", 0, "stage"),
    ("hoverboard_350w", 2, "winding")])
def test_a_speed_that_heat_takes_is_not_the_loads_fault(motor, source, warm, tmp_path):
    """The model holds back current that friction takes, little by little; told a small mass, it does within two seconds. What
    it names is not too hot yet: it would never be."""
    fault, params, rated = WARM[warm]
    overrides = {"params": {**params, rated: round(800 * load_drive(motor).names()["rated_current_A"])}}
    names = load_drive(motor, overrides, aligned=source == 0).names()
    loaded_s = 0.05 + names["ramp_time_s"] + 0.2
    steps = [{"t_s": 0.14, "console": f"set angle_source {source}"}, {"t_s": 0.15, "console": "on"},
             {"t_s": 0.05, "after_state": "OPERATION_ENABLED", "console": "speed {work_rpm}"},
             {"t_s": loaded_s, "after_state": "OPERATION_ENABLED", "event": "load_coulomb", "args": ["0.9 * rated_torque_Nm"]},
             {"t_s": 0.01, "after_state": "FAULT", "console": "fault"}, {"t_s": 0.08, "after_state": "FAULT", "event": "end"}]
    result = simulate({"key": "warm", "end_s": loaded_s + 5, "preamble_s": 0.05, "step": steps}, motor, out_dir=tmp_path,
                      overrides=overrides, aligned=source == 0)
    trace = result.trace
    row = np.flatnonzero(trace["fault"])[0]
    assert result.enums["fault"][int(trace["fault"][row])] == f"FAULT_{fault}", result.console[-300:]
    assert trace["i_q_ref_A"][row] < 0.7 * names["i_max_A"]
    held = trace.between(loaded_s + 0.5, loaded_s + 0.6)["speed_rpm"]
    assert abs(held.mean() / names["work_rpm"] - 1) < 0.05 and trace["speed_rpm"][row] < 0.9 * names["work_rpm"]
    found = re.search(r"found: winding at (\d+) degC", result.console)
    assert warm == "stage" or 120 < int(found[1]) < 130, result.console[-300:]
