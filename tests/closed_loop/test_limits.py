# SPDX-License-Identifier: MIT
"""Limits in closed loop: supplies that do not sink, a brake chopper, torque control without load, torque by reluctance."""
import numpy as np
import pytest

from launcher import simulate
from launcher.drive import load_drive

from rigs.steps import faults, rpm

NO_SINK = {"inverter": {"supply": {"supply_sinks": 0}}}
ON_S = 0.15
THREE = ["teknic_m2310p", "abb_m2bj100l", "maxon_ec45flat"]


def play(tmp_path, motor, steps, end_s, overrides=None, **kwargs):
    scenario = {"key": "limits", "end_s": end_s, "preamble_s": 0.05,
                "step": sorted([{"t_s": ON_S, "console": "on"}, *steps], key=lambda step: step["t_s"])}
    result = simulate(scenario, motor=motor, out_dir=tmp_path, overrides=overrides, aligned=True,
                      **{"plant": "ideal", "spread": 0, **kwargs})
    assert result.figures["refused by the drive"].passed is not False, result.figures["refused by the drive"].value
    return result


def fast_then(tmp_path, motor, command, after_s, **kwargs):
    """Full speed, then a command; (result, its time)."""
    names = load_drive(motor).names()
    up = up_s(motor)
    then_s = up + names["max_ramp_time_s"] + 0.3
    steps = [{"t_s": up, "console": "speed {speed_max_rpm}"}, {"t_s": then_s, "console": command}]
    return play(tmp_path, motor, steps, then_s + after_s, **kwargs), then_s


def up_s(motor, overrides=None):
    """When the drive is on."""
    return ON_S + load_drive(motor, overrides, aligned=True).on_time_s + 0.05


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


HEAVY = {"motor": {"load": {"inertia_ratio": 300}}, "params": {"ramp_rpm_s": 2000}}


def heavy_stop(tmp_path, seconds, **params):
    """A rotor that is braked for longer than five seconds, which were once all that a stop got."""
    overrides = {**HEAVY, **NO_SINK, "params": {**HEAVY["params"], **params}}
    up = up_s("teknic_m2310p", overrides)
    steps = [{"t_s": up, "console": "speed 2000"}, {"t_s": up + 2, "console": "quickstop"}]
    result = play(tmp_path, "teknic_m2310p", steps, up + 2 + seconds, overrides=overrides)
    assert not faults(result)
    after = result.trace.between(up + 2, result.trace["t_s"][-1])
    stopping = after["state"] == {name: code for code, name in result.enums["state"].items()}["AXIS_QUICK_STOP"]
    return after, stopping


def test_a_heavy_rotor_is_braked_to_its_end(tmp_path):
    after, stopping = heavy_stop(tmp_path, 6.0)
    assert rpm(after)[0] > 500
    lasted = after["t_s"][stopping][-1] - after["t_s"][stopping][0]
    assert lasted > 5.2 or abs(rpm(after)[stopping][-1]) < 40


def test_a_stop_ends_after_stop_max_ms(tmp_path):
    after, stopping = heavy_stop(tmp_path, 0.6, stop_max_ms=400)
    running = after["t_s"][stopping]
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
    result = play(tmp_path, motor, [{"t_s": up_s(motor), "console": f"torque {sign}{{i_max_A}}"}], up_s(motor) + 1.0)
    assert not faults(result)
    largest = np.abs(rpm(result.trace)).max()
    assert 0.98 * result.drive.params["speed_max_rpm"] < largest < 1.03 * result.drive.params["speed_max_rpm"]


def test_reluctance_holds_rated_torque(tmp_path):
    """THOR needs 15 A of negative d current for it: with i_d = 0 its largest current makes half."""
    motor, names = "thor_pmsyrm", load_drive("thor_pmsyrm").names()
    load_s = up_s(motor) + names["ramp_time_s"] + 0.3
    steps = [{"t_s": up_s(motor), "console": "speed {work_rpm}"},
             {"t_s": load_s, "event": "load_nm", "args": ["rated_torque_Nm"]}]
    result = play(tmp_path, motor, steps, load_s + 0.8, plant="ideal,+saturation")
    assert not faults(result)
    held = result.trace.between(load_s + 0.6, load_s + 0.8)
    assert rpm(held).mean() == pytest.approx(names["work_rpm"], rel=0.005)
    assert np.hypot(held["i_d_ref_A"], held["i_q_ref_A"]).mean() < 1.15 * names["rated_current_A"]
    assert held["i_d_ref_A"].mean() < -10
