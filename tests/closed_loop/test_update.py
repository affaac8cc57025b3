# SPDX-License-Identifier: MIT
"""When voltages act (parameter pwm_update): the loop is the one that firmware/settings/margins.h derives, in each mode; at once
is quicker than at the valley; modes change while off; a phase that cannot act at once, at full modulation, does no harm."""
import math
import re

import numpy as np
import pytest

from closed_loop.swept import derived, seen
from launcher import simulate
from launcher.drive import load_drive
from launcher.load import CURRENT_LOOP, load_irqlog

VALLEY, ENDS, ONCE = range(3)
PWM_HZ, ON_S = 20000, 0.15
DELAYS = {VALLEY: lambda back: back, ENDS: lambda back: (1 + back) / 2, ONCE: lambda back: 1}  # back: a period
MOTOR = "teknic_m2310p"
STANDS_DEG = 60  # the sweep turns the rotor by 30 degrees: then no phase is near zero, where its dead time bends the response


def sweep(tmp_path, update, current_bw_hz, detune="", **plant):
    params = {"pwm_update": update, "current_bw_hz": current_bw_hz}
    result = simulate("current_sweep", out_dir=tmp_path, overrides={"params": params}, detune=detune, aligned=True,
                      start_angle=STANDS_DEG, **plant)
    return seen(result)


@pytest.mark.parametrize("update, current_bw_hz", [(VALLEY, 1000), (ENDS, 1000), (ENDS, 1300), (ONCE, 1000), (ONCE, 2000)])
def test_the_swept_loop_is_the_one_that_was_derived(tmp_path, update, current_bw_hz):
    margin_deg, lag_hz = derived(DELAYS[update], current_bw_hz, PWM_HZ)
    for measured_deg, measured_hz in sweep(tmp_path, update, current_bw_hz, plant="ideal", spread=0).values():
        assert measured_deg == pytest.approx(margin_deg, abs=2)
        assert measured_hz == pytest.approx(lag_hz, rel=0.04)


@pytest.mark.parametrize("detune, least_hz, least_deg", [
    ("", 3500, 60), ("ld_uh/0.7 lq_uh/0.7", 3500, 35), ("ld_uh/1.5 lq_uh/1.5", 2400, 35)])
def test_at_once_on_the_full_plant_and_with_inductances_told_wrongly(tmp_path, detune, least_hz, least_deg):
    for measured_deg, measured_hz in sweep(tmp_path, ONCE, 2000, detune, plant="full", spread=1).values():
        assert measured_hz >= least_hz and measured_deg >= least_deg


def test_a_step_at_once_does_not_overshoot(tmp_path):
    result = simulate("current_step", out_dir=tmp_path, overrides={"params": {"pwm_update": ONCE, "current_bw_hz": 2000}},
                      aligned=True)
    assert result.passed and result.figures["i_q overshoot, linear step"].value <= 5
    wish, current = result.trace["i_q_ref_A"], result.trace["i_q_true_A"]
    jump = int(np.argmax(np.diff(wish))) + 1
    low, high = np.mean(current[jump - 100:jump - 1]), np.mean(current[jump + 100:jump + 300])
    assert np.abs(current[jump + 7:jump + 300] - high).max() < 0.05 * (high - low)


def said(t_s, text):
    return {"t_s": t_s, "console": text}


def play(tmp_path, steps, end_s, overrides=None):
    scenario = {"key": "update", "end_s": end_s, "preamble_s": 0.05, "step": [said(ON_S, "on"), *steps],
                "figure": [{"name": "overruns", "kind": "overruns", "max": 0}]}
    return simulate(scenario, motor=MOTOR, out_dir=tmp_path, overrides=overrides, plant="full", spread=1, aligned=True)


def faults(result):
    return {result.enums["fault"][int(code)] for code in np.unique(result.trace["fault"])} - {"FAULT_NONE"}


def test_modes_change_while_off_and_only_then(tmp_path):
    """No sample is lost and none comes twice, and the alignment holds."""
    up_s = ON_S + load_drive(MOTOR, aligned=True).on_time_s + 0.05
    steps = [said(up_s, "speed 600"), said(up_s + 0.3, "quickstop")]
    then_s = up_s + 0.8
    for update in (ONCE, ENDS, VALLEY):
        steps += [said(then_s, f"set pwm_update {update}"), said(then_s + 0.02, "on"), said(then_s + 1.0, "status"),
                  said(then_s + 1.05, "speed 600"), said(then_s + 1.4, "quickstop")]
        then_s += 1.9  # a check of the offset makes as many pushes as it needs
    result = play(tmp_path, steps, then_s)
    assert not faults(result)
    assert result.figures["overruns"].value == 0
    assert result.console.count("done: operation enabled") == 4
    assert re.findall(r"PWM update: ([a-z ]+)", result.console) == ["at once", "at both ends", "at the valley"]
    assert re.findall(r"loop: (\d+) degrees", result.console) == ["62", "80", "72", "62"]
    window = result.trace.between(then_s - 0.75, then_s - 0.5)
    assert np.mean(window["speed_rad_s"]) * 30 / math.pi == pytest.approx(600, rel=0.02)


def test_a_new_voltage_stands_soon_behind_its_sample(tmp_path):
    """Conversion, the wait for the core, and all up to the last compare, which acts in the clock after the next."""
    up_s = ON_S + load_drive(MOTOR, aligned=True).on_time_s
    result = play(tmp_path, [said(up_s, "speed 1000")], up_s + 0.2, {"params": {"pwm_update": ONCE}})
    log = load_irqlog(result.irqlog)
    loops = (log["exception"] == CURRENT_LOOP) & (log["chained"] == 0) & (log["t_s"] > up_s)
    conversion_ns = result.drive.inverter["sensor"]["adc_conversion_s"] * 1e9
    late_ns = conversion_ns + log["start_ns"][loops] + 10 * log["latency_cycles"][loops] + 20
    assert len(late_ns) > 1000 and 2000 < late_ns.min() and late_ns.max() <= 2400


def test_a_mode_is_not_changed_while_on(tmp_path):
    up_s = ON_S + load_drive(MOTOR, aligned=True).on_time_s + 0.05
    result = play(tmp_path, [said(up_s, "set pwm_update 2")], up_s + 0.1)
    assert "parameters can change only while the drive is off" in result.console


@pytest.mark.parametrize("current_bw_hz", [2000, 3183])
def test_full_modulation_at_once(tmp_path, current_bw_hz):
    """A bus too low for the speed: the voltage stands at its circle, each phase's longest pulses act half a period late. That
    costs three tenths of ripple at most. Sensors in line: what shunts do not see there has a test of its own."""
    ripple = {}
    for update, bandwidth_hz in ((VALLEY, 1000), (ONCE, current_bw_hz)):
        overrides = {"inverter": {"supply": {"vbus_v": 19.5}},
                     "params": {"pwm_update": update, "current_bw_hz": bandwidth_hz, "low_side_shunts": 0}}
        up_s = ON_S + load_drive(MOTOR, overrides, aligned=True).on_time_s + 0.05
        steps = [said(up_s, "speed 4000"), {"t_s": up_s + 1.2, "event": "load_nm", "args": [0.05]}, said(up_s + 1.7, "status")]
        result = play(tmp_path, steps, up_s + 1.8, overrides)
        assert not faults(result)
        window = result.trace.between(up_s + 1.4, up_s + 1.7)
        assert 3000 < np.mean(window["speed_rad_s"]) * 30 / math.pi < 4010, "with a weaker field it gets there"
        ripple[update] = np.std(window["i_d_true_A"])
    waited_ms = int(re.search(r"had to wait for the next end: (\d+)", result.console)[1])
    assert waited_ms > 300
    assert ripple[ONCE] < 1.3 * ripple[VALLEY]
