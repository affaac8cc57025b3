# SPDX-License-Identifier: MIT
"""Two samples a period (parameter pwm_samples): the loop is the one that firmware/settings/margins.h derives, twice as quick as
with one; a drive that was told wrongly that its sensors are in line with the phases says so."""
import math
import re

import numpy as np
import pytest

from budgets.figures import load_budgets
from closed_loop.swept import derived, seen
from launcher import simulate
from launcher.data import read_toml
from launcher.drive import load_drive
from launcher.load import CURRENT_LOOP, load_irqlog
from launcher.paths import SCENARIOS
from rates.builds import build_of
from rigs.steps import faults, rpm, typed

ENDS, ONCE = 1, 2
LOOP_HZ, ON_S = 40000, 0.15
SHUNTS, IN_LINE = "teknic_m2310p", "estun_emj04apb22"  # what their inverters have
DELAYS = {ENDS: lambda back: back, ONCE: lambda back: 1}  # back: half a period
SWEPT_HZ = [50, 200, 500, 800, 1200, 1600, 2000, 2500, 3000, 3500, 4000, 5000, 6000, 7000, 8000, 9500, 11500]


def two(update=ONCE, current_bw_hz=None, **inverter):
    control = {"pwm_update": update, "pwm_samples": 2}
    if current_bw_hz is not None:
        control["current_bw_hz"] = current_bw_hz
    return {"motor": {"control": control}, "inverter": {"sensor": {"shunt": 0}, **inverter}}


def sweep(tmp_path, overrides, **settings):
    plan = {"key": "current_sweep", **read_toml(SCENARIOS / "current_sweep.toml")}
    for step in plan["step"]:
        if "each" in step:
            step["each"] = {"hz": SWEPT_HZ}
    result = simulate(plan, out_dir=tmp_path, overrides=overrides, **settings)
    return seen(result)


@pytest.mark.parametrize("update, current_bw_hz", [
    (ENDS, 2000), (ONCE, 4000), (ONCE, 5500)])
def test_the_swept_loop_is_the_one_that_was_derived(tmp_path, update, current_bw_hz):
    margin_deg, lag_hz = derived(DELAYS[update], current_bw_hz, LOOP_HZ)
    for measured_deg, measured_hz in sweep(tmp_path, two(update, current_bw_hz), plant="ideal", spread=0).values():
        assert measured_deg == pytest.approx(margin_deg, abs=2.5)
        assert measured_hz == pytest.approx(lag_hz, rel=0.04)


@pytest.mark.parametrize("motor, detune, least_hz, least_deg", [
    (SHUNTS, "", 6000, 60), (IN_LINE, "", 6000, 60), (SHUNTS, "ld_uh/0.7 lq_uh/0.7", 6000, 60),
    (SHUNTS, "ld_uh/1.5 lq_uh/1.5", 5500, 60)])
def test_at_once_on_the_full_plant(tmp_path, motor, detune, least_hz, least_deg):
    for measured_deg, measured_hz in sweep(tmp_path, two(ONCE, 4000), motor=motor, detune=detune, aligned=True).values():
        assert measured_hz >= least_hz and measured_deg >= least_deg


def test_at_10_khz(tmp_path):
    """4 kHz where voltages act at once; the rule's 4000 Hz are beyond its limit."""
    build = build_of(10000, "mssfoc.elf", "mssfoc.hex")
    overrides = two(current_bw_hz=2250)
    overrides["params"] = {"speed_bw_hz": 40}
    for measured_deg, measured_hz in sweep(tmp_path, overrides, build=build, aligned=True).values():
        assert measured_hz >= 4000 and measured_deg >= 60


def test_a_step_has_settled_after_six_samples(tmp_path):
    result = simulate("current_step", out_dir=tmp_path, overrides=two(ONCE, 4000), aligned=True)
    assert result.passed and result.figures["i_q overshoot, linear step"].value <= 5
    wish, current = result.trace["i_q_ref_A"], result.trace["i_q_true_A"]
    jump = int(np.argmax(np.diff(wish))) + 1
    low, high = np.mean(current[jump - 100:jump - 1]), np.mean(current[jump + 200:jump + 600])
    assert np.abs(current[jump + 7:jump + 600] - high).max() < 0.05 * (high - low)


def play(tmp_path, steps, end_s, overrides, aligned=True):
    scenario = {"key": "samples", "end_s": end_s, "preamble_s": 0.05, "step": [typed(ON_S, "on"), *steps],
                "figure": [{"name": "overruns", "kind": "overruns", "max": 0}]}
    return simulate(scenario, out_dir=tmp_path, overrides=overrides, plant="full", spread=1, aligned=aligned)


def test_the_number_of_samples_changes_while_off(tmp_path):
    """No sample is lost and none comes twice. Where the second is new the wiring is looked at, and the alignment holds."""
    up_s = ON_S + load_drive(SHUNTS, aligned=True).on_time_s + 0.05
    steps, then_s = [typed(up_s, "speed 600"), typed(up_s + 0.3, "quickstop")], up_s + 0.7
    for samples in (2, 1, 2):
        steps += [typed(then_s, f"set pwm_samples {samples}"), typed(then_s + 0.02, "on"), typed(then_s + 0.7, "status"),
                  typed(then_s + 0.75, "speed 600"), typed(then_s + 1.1, "quickstop")]
        then_s += 1.5
    told = {"pwm_update": ONCE, "current_bw_hz": 2000, "low_side_shunts": 0}
    result = play(tmp_path, steps, then_s, {"inverter": {"sensor": {"shunt": 0}}, "params": told})
    assert not faults(result)
    assert result.figures["overruns"].value == 0
    assert re.findall(r"PWM update: at once(, two samples a period)?, milli", result.console) == [
        ", two samples a period", "", ", two samples a period"]
    assert re.findall(r"loop: (\d+) degrees", result.console) == ["71", "80", "71", "80"]
    for end_s in (then_s - 0.4, then_s - 1.9, then_s - 3.4):
        assert rpm(result.trace.between(end_s - 0.1, end_s)).mean() == pytest.approx(600, rel=0.02)


def test_shunts_that_were_told_to_be_in_line_are_found_at_the_start(tmp_path):
    overrides = {"params": {"pwm_update": ONCE, "pwm_samples": 2, "low_side_shunts": 0, "current_bw_hz": 4000}}
    result = play(tmp_path, [typed(0.5, "fault")], 0.6, overrides, aligned=False)
    assert "found: phase 1" in result.console and "shows nothing: low_side_shunts?" in result.console
    assert faults(result) == ["FAULT_OPEN_PHASE"]


def test_shunts_are_refused(tmp_path):
    overrides = {"params": {"pwm_update": ONCE, "pwm_samples": 2}}
    result = play(tmp_path, [], 0.3, overrides)
    assert "error: pwm_samples 2 needs sensors in line with the phases" in result.console
    assert not result.trace["gate_live"].any()


def test_a_start_without_help(tmp_path):
    """Wiring and alignment at twice the rate, with sensors that the inverter has in line."""
    overrides = {"motor": {"control": {"pwm_update": ONCE, "pwm_samples": 2}}}
    up_s = ON_S + load_drive(IN_LINE, overrides).on_time_s
    scenario = {"key": "samples", "end_s": "up + 0.9", "preamble_s": 0.05, "step": [
        typed(ON_S, "on"), {"t_s": up_s, "label": "up", "hold_for": "OPERATION_ENABLED"}, typed("up + 0.05", "speed 600")],
        "figure": [{"name": "overruns", "kind": "overruns", "max": 0},
                   {"name": "angle", "kind": "angle_error", "from_s": "up", "max": {"mean": 1.5, "largest": 4}}]}
    result = simulate(scenario, motor=IN_LINE, out_dir=tmp_path, overrides=overrides, plant="full", spread=1)
    assert not faults(result) and result.passed
    end_s = result.scenario.end_s
    assert rpm(result.trace.between(end_s - 0.2, end_s)).mean() == pytest.approx(600, rel=0.02)


@pytest.mark.parametrize("current_bw_hz", [4000, 6366])
def test_full_modulation(tmp_path, current_bw_hz):
    """A bus too low for the speed: pulses too long or too short to be met at once act half a period late."""
    overrides = two(ONCE, current_bw_hz, supply={"vbus_v": 19.5})
    up_s = ON_S + load_drive(SHUNTS, overrides, aligned=True).on_time_s + 0.05
    steps = [typed(up_s, "speed 4000"), {"t_s": up_s + 1.2, "event": "load_nm", "args": [0.05]}, typed(up_s + 1.7, "status")]
    result = play(tmp_path, steps, up_s + 1.8, overrides)
    window = result.trace.between(up_s + 1.4, up_s + 1.7)
    assert not faults(result) and result.figures["overruns"].value == 0
    assert 3000 < rpm(window).mean() < 4010, "with a weaker field it gets there"
    assert int(re.search(r"had to wait for the next end: (\d+)", result.console)[1]) > 300
    assert np.std(window["i_d_true_A"]) < 0.2, "0.11 and 0.14 A: where the voltage ends, the weaker field follows it"


def test_the_interrupt_takes_as_long_as_with_one(tmp_path):
    result = play(tmp_path, [typed(ON_S + 0.35, "speed 1000")], ON_S + 1.0, two())
    log = load_irqlog(tmp_path / "irq.bin")
    running = (log["exception"] == CURRENT_LOOP) & (log["chained"] == 0) & (log["t_s"] > ON_S + 0.5)
    assert set(log["cycles"][running]) == {load_budgets()["cycles"]["current_loop.interrupt"]["max"]}
    assert running.sum() == pytest.approx(0.5 * LOOP_HZ, rel=0.05) and not faults(result)


@pytest.mark.parametrize("scenario", ["default", "fault_encoder_cut", "fault_overspeed"])
def test_what_a_scenario_asks_for_holds_with_two(tmp_path, scenario):
    """What counts samples: over-speed, a dead encoder, the bridge off within so many periods."""
    result = simulate(scenario, motor=IN_LINE, out_dir=tmp_path, overrides=two(), plant="full", spread=1, aligned=True)
    assert result.passed, {name: figure.value for name, figure in result.figures.items() if figure.passed is False}


def worst_pole(a, waiting):
    """Per half period, where the longest pulse (phase A) waits while it rises and the shortest (C) while it falls.

    Legs with the middle of the voltages taken off; L 2 pi f as gain, so that a vector of current changes by -a times itself.
    """
    to_phases = np.array([[1, 0], [-0.5, math.sqrt(3) / 2], [-0.5, -math.sqrt(3) / 2]])
    to_legs = np.array([[0.5, 0, -0.5], [-0.5, 1, -0.5], [-0.5, 0, 0.5]]) @ to_phases
    map_of_period = np.eye(4)
    for stale in waiting:
        new = np.diag([float(phase != stale) for phase in range(3)])
        half = np.zeros((4, 4))
        half[:2, :2] = np.eye(2) - a * 2 / 3 * to_phases.T @ new @ to_legs
        half[:2, 2:] = a * 2 / 3 * to_phases.T @ (np.eye(3) - new) @ to_legs
        half[2:, :2] = -np.eye(2)
        map_of_period = half @ map_of_period
    return math.sqrt(max(abs(np.linalg.eigvals(map_of_period))))


@pytest.mark.parametrize("a, most", [(0.628, 0.6), (1, 0.71), (1.43, 0.93), (1.99, 1)])
def test_pulses_that_wait_leave_the_loop_stable(a, most):
    """By rule, at the largest bandwidth, there with 30 % less inductance than told, with half of it: two legs wait, or one."""
    assert worst_pole(a, (0, 2)) < most and worst_pole(a, (0, None)) < most
