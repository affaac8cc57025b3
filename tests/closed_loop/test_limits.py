# SPDX-License-Identifier: MIT
"""Limits in closed loop: a supply that does not sink, a brake chopper, torque control without load, rated torque by reluctance."""
import numpy as np
import pytest

from launcher import simulate
from launcher.drive import load_drive

RPM = np.pi / 30
NO_SINK = {"inverter": {"supply": {"supply_sinks": 0}}}
UP_S = 1.05  # the drive is on
THREE = ["teknic_m2310p", "abb_m2bj100l", "maxon_ec45flat"]
TORQUE_Q15 = "axes[0].torque.torque_q15"


def play(tmp_path, motor, steps, end_s, **kwargs):
    scenario = {"key": "limits", "end_s": end_s, "preamble_s": 0.05,
                "step": sorted([{"t_s": 0.15, "console": "on"}, *steps], key=lambda step: step["t_s"])}
    result = simulate(scenario, motor=motor, out_dir=tmp_path, **{"plant": "ideal", "spread": 0, **kwargs})
    assert result.figures["refused by the drive"].passed is not False, result.figures["refused by the drive"].value
    return result


def fast_then(tmp_path, motor, command, after_s, **kwargs):
    """Full speed, then a command; (result, its time)."""
    names = load_drive(motor).names()
    then_s = UP_S + names["max_ramp_time_s"] + 0.3
    steps = [{"t_s": UP_S, "console": "speed {speed_max_rpm}"}, {"t_s": then_s, "console": command}]
    return play(tmp_path, motor, steps, then_s + after_s, **kwargs), then_s


def faults(result):
    return {result.enums["fault"][int(code)] for code in np.unique(result.trace["fault"])} - {"FAULT_NONE"}


def rpm(part):
    return part["speed_rad_s"] / RPM


def assert_braked(result, then_s):
    """No fault, the bus below v_max with something to spare; the drive never drove on while it had to brake."""
    assert not faults(result)
    after = result.trace.between(then_s + 2e-3, result.trace["t_s"][-1])
    assert after["vbus_V"].max() < 0.99 * result.drive.params["v_max_mv"] / 1000
    braking = rpm(after) > 0.02 * result.drive.params["speed_max_rpm"]
    assert after["i_q_ref_A"][braking].max() <= 0 and after["i_q_ref_A"][braking].min() < 0


@pytest.mark.parametrize("motor", THREE)
def test_quick_stop_on_a_supply_that_does_not_sink(motor, tmp_path):
    """Not four times slower than on one that does: what the bus does not take the windings burn."""
    result, then_s = fast_then(tmp_path, motor, "quickstop", 1.0, overrides=NO_SINK)
    assert_braked(result, then_s)
    off = next(t for t, state in zip(result.trace["t_s"], result.trace["state"])
               if t > then_s + 2e-3 and result.enums["state"][int(state)] == "AXIS_SWITCH_ON_DISABLED")
    shortest_s = result.scenario.names["max_ramp_time_s"] / 4
    assert shortest_s <= off - then_s < 5 * shortest_s
    assert abs(rpm(result.trace.between(off, off + 1e-3))[0]) < 40


@pytest.mark.parametrize("motor", THREE)
def test_reversal_on_a_supply_that_does_not_sink(motor, tmp_path):
    names = load_drive(motor).names()
    result, then_s = fast_then(tmp_path, motor, "speed -{speed_max_rpm}", 2 * names["max_ramp_time_s"] + 1.2, overrides=NO_SINK)
    assert_braked(result, then_s)
    end = result.trace["t_s"][-1]
    assert rpm(result.trace.between(end - 0.1, end)).mean() == pytest.approx(-names["speed_max_rpm"], rel=0.005)


def test_a_heavy_rotor_is_braked_to_its_end(tmp_path):
    """Five seconds were once all that a stop got, after which the motor was let go of. It is let go of at stop_max_ms."""
    heavy = {"motor": {"load": {"inertia_ratio": 300}}, "params": {"ramp_rpm_s": 2000}, **NO_SINK}
    steps = [{"t_s": UP_S, "console": "speed 2000"}, {"t_s": 3.0, "console": "quickstop"}]
    result = play(tmp_path, "teknic_m2310p", steps, 9.5, overrides=heavy)
    assert not faults(result)
    speed_then = rpm(result.trace.between(2.99, 3.0)).mean()
    assert result.enums["state"][int(result.trace.between(8.2, 8.21)["state"][0])] == "AXIS_QUICK_STOP"
    assert speed_then > 500


def test_a_stop_ends_after_stop_max_ms(tmp_path):
    heavy = {"motor": {"load": {"inertia_ratio": 300}}, "params": {"ramp_rpm_s": 2000, "stop_max_ms": 400}}
    steps = [{"t_s": UP_S, "console": "speed 2000"}, {"t_s": 3.0, "console": "quickstop"}]
    result = play(tmp_path, "teknic_m2310p", steps, 3.6, overrides=heavy)
    state = result.trace.between(3.0, 3.6)
    running = state["t_s"][np.array([result.enums["state"][int(code)] == "AXIS_QUICK_STOP" for code in state["state"]])]
    assert running[-1] - running[0] == pytest.approx(0.4, abs=2e-3)


def test_with_a_chopper_the_stop_is_as_short_as_may_be(tmp_path):
    """The set point of the bus lies above the chopper's threshold, so it is the chopper that takes the power."""
    result, then_s = fast_then(tmp_path, "estun_emj04apb22", "quickstop", 0.5, plant="ideal,+supply,+bus")
    assert_braked(result, then_s)
    after = result.trace.between(then_s, result.trace["t_s"][-1])
    assert after["vbus_V"].max() > 1.1 * result.scenario.names["vbus_V"]
    stopped_s = after["t_s"][np.flatnonzero(np.abs(rpm(after)) < 40)[0]] - then_s
    assert stopped_s == pytest.approx(result.scenario.names["max_ramp_time_s"] / 4, rel=0.1)
    assert np.abs(after["i_d_ref_A"]).max() < 0.5 * result.scenario.names["i_max_A"]


@pytest.mark.parametrize("sign", ["", "-"])
@pytest.mark.parametrize("motor", THREE)
def test_torque_without_load_ends_at_the_largest_speed(motor, sign, tmp_path):
    result = play(tmp_path, motor, [{"t_s": UP_S, "console": f"torque {sign}{{i_max_A}}"}], UP_S + 1.0)
    assert not faults(result)
    largest = np.abs(rpm(result.trace)).max()
    assert 0.98 * result.drive.params["speed_max_rpm"] < largest < 1.03 * result.drive.params["speed_max_rpm"]
