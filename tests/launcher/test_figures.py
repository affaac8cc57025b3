# SPDX-License-Identifier: MIT
"""Kinds of figures on traces made here, whose figures are known."""
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from launcher import LauncherError, plot
from launcher.capability import CIRCLE
from launcher.drive import load_drive
from launcher.figures import KINDS, measure
from launcher.kind import Run
from launcher.kinds_sweep import sweep
from launcher.probes import add_belief
from launcher.scenario import Step
from launcher.trace import Trace, add_truth

DT = 50e-6
ENABLED = 4
MOTOR = "teknic_m2310p"


@pytest.fixture(scope="module")
def drive():
    return load_drive(MOTOR)


def made(drive, length_s=0.5, rpm=1500.0, i_d=0.0, i_q=2.0, steps=(), **columns):
    """A Run in which the rotor turns at a constant speed with the given currents; columns replace what would be there."""
    t = DT * np.arange(1, round(length_s / DT))
    w = rpm * math.pi / 30
    angle = w * t + 0.2
    theta = drive.motor["electrical"]["pole_pairs"] * angle
    still = np.zeros_like(t)
    trace = {"t_s": t, "theta_mech_rad": angle, "speed_rad_s": still + w, "torque_Nm": still + 0.1, "load_Nm": still,
             "state": still + ENABLED, "fault": still, "gates": still + 5, "gate_live": still + 1, "i_d_ref_A": still,
             "i_q_ref_A": still + i_q}
    for index, phase in enumerate("abc"):
        turned = theta - index * 2 * math.pi / 3
        trace[f"i_{phase}_A"] = i_d * np.cos(turned) - i_q * np.sin(turned)
        trace[f"i_{phase}_mean_A"] = trace[f"i_{phase}_A"]
        trace[f"i_{phase}_rms_A"] = np.abs(trace[f"i_{phase}_A"])
        trace[f"i_{phase}_peak_A"] = np.abs(trace[f"i_{phase}_A"])
    trace = add_truth(Trace(trace), drive.motor["electrical"]["pole_pairs"])
    trace.update({name: value(t) if callable(value) else value for name, value in columns.items()})
    enums = {"state": {3: "AXIS_SWITCHED_ON", ENABLED: "AXIS_OPERATION_ENABLED"}, "fault": {0: "FAULT_NONE", 2: "FAULT_X"}}
    return Run(trace, "", drive, enums, drive.names(), list(steps))


def figures(run, kind, **entry):
    """{part: value} of a kind."""
    plan = SimpleNamespace(key="test", figures=[{"name": "x", "kind": kind, **entry}])
    found = measure(plan, run)
    return {name.partition(", ")[2]: figure.value for name, figure in found.items()}


def test_what_is_enlarged_is_of_operation(drive):
    """A shaft that turned while it was aligned, and is held then: the step of its current; turning: its turns."""
    stepped = made(drive, speed_rad_s=lambda t: 5.0 * (t < 0.1), i_q_ref_A=lambda t: 0.5 + 3.0 * (t > 0.3))
    near, held = plot._loaded_stretch(stepped.trace, drive, 0.2)
    assert held and near["t_s"][0] < 0.3 < near["t_s"][-1] < near["t_s"][0] + 0.011
    near, held = plot._loaded_stretch(made(drive).trace, drive, 0.2)
    assert not held and near["t_s"][0] >= 0.2 and len(near["t_s"]) * DT == pytest.approx(3 / 100, rel=0.1)


def test_voltage_reserve_is_what_the_circle_leaves(drive):
    """Half of the circle's amplitude, with a zero sequence that counts for nothing."""
    phases = {f"v_{phase}_V": lambda t, at=at: 12 + 1.5 * np.sin(600 * t) + 0.5 * CIRCLE * 24 * np.cos(200 * t - at)
              for phase, at in zip("abc", (0, 2 * math.pi / 3, 4 * math.pi / 3))}
    found = figures(made(drive, vbus_V=lambda t: 24 + 0 * t, **phases), "voltage_reserve", from_s=0.1, to_s=0.4)
    assert found[""] == pytest.approx(50, abs=0.01)


def test_speed_error_has_the_largest_beside_the_mean(drive):
    run = made(drive, speed_rpm=lambda t: 1500 + 3 * np.sin(2 * math.pi * 40 * t) + np.where(np.abs(t - 0.25) < DT / 2, 30, 0))
    found = figures(run, "speed_error", from_s=0.1, to_s=0.4, reference_rpm=1500)
    assert found["mean"] < 0.01 and found["largest"] == pytest.approx(2.0, abs=0.2)


def test_overshoot_counts_in_the_direction_of_the_ramp(drive):
    run = made(drive, speed_rpm=lambda t: np.interp(t, [0.1, 0.3, 0.35, 0.4], [1000, -1530, -1500, -1500]))
    assert figures(run, "ramp_overshoot", from_s=0.05, to_s=0.45, target_rpm=-1500)[""] == pytest.approx(2.0, rel=0.01)
    assert figures(run, "ramp_overshoot", from_s=0.38, to_s=0.45, target_rpm=-1500)[""] == 0.0


@pytest.mark.parametrize("ripple_rpm", [0, 45])
def test_recovery_counts_beyond_what_remains(drive, ripple_rpm):
    """exp(-t / 10 ms) from 150 rpm is within 15 rpm after 23 ms, whatever ripples all the time."""
    run = made(drive, speed_rpm=lambda t: 1500 - np.where(t < 0.1, 0, 150 * np.exp(-(t - 0.1) / 0.01))
               + ripple_rpm * np.sin(2 * math.pi * 25 * (t - 0.1 - 0.023)))
    found = figures(run, "recovery", from_s=0.1, to_s=0.4, reference_rpm=1500)[""]
    assert (22 < found < 24) if ripple_rpm == 0 else (15 < found < 40)
    assert figures(run, "recovery", from_s=0.1, to_s=0.4, reference_rpm=1470)[""] is None


def test_what_is_no_number_is_not_measured(drive):
    run = made(drive, torque_Nm=lambda t: np.where(t > 0.3, np.nan, 0.1))
    assert figures(run, "torque_ripple", from_s=0.1, to_s=0.4) == {"rms": None, "peak to peak": None}


def test_torque_ripple_is_without_the_mean(drive):
    run = made(drive, torque_Nm=lambda t: 0.2 + 0.01 * np.sin(2 * math.pi * 100 * t))
    found = figures(run, "torque_ripple", from_s=0.1, to_s=0.4)
    assert found["rms"] == pytest.approx(100 * 0.01 / math.sqrt(2) / 0.2724, rel=0.01)
    assert found["peak to peak"] == pytest.approx(100 * 0.02 / 0.2724, rel=0.01)


def test_i_d_counts_from_the_reference_and_over_the_whole_operation(drive):
    run = made(drive, i_d_true_A=lambda t: np.where(t < 0.104, 5.0, np.where(t < 0.2, 0.71, -0.1065)),
               i_d_ref_A=lambda t: np.where(t < 0.1, 0.0, np.where(t < 0.2, 0.0, -0.071)),
               state=lambda t: np.where(t < 0.1, 3, ENABLED))
    steady = figures(run, "i_d_deviation", from_s=0.3, to_s=0.4)
    assert steady == pytest.approx({"rms": 0.5, "largest": 0.5}, rel=1e-6)
    whole = figures(run, "i_d_in_operation")
    assert whole["largest"] == pytest.approx(10.0, rel=1e-6)  # not the 5 A of the alignment, nor what is left of them
    assert whole["rms"] == pytest.approx(math.sqrt((10.0 ** 2 * 0.095 + 0.5 ** 2 * 0.3) / 0.395), rel=0.01)


def test_in_operation_needs_operation(drive):
    run = made(drive, state=lambda t: 0 * t + 3)
    assert figures(run, "i_d_in_operation")["largest"] is None


def test_peak_current_is_the_continuous_one(drive):
    run = made(drive, i_c_peak_A=lambda t: np.where(np.abs(t - 0.3) < DT / 2, 10.65 * 1.03, 2.0))
    assert figures(run, "peak_current")[""] == pytest.approx(103, rel=1e-6)
    assert figures(run, "peak_current", to_s=0.2)[""] == pytest.approx(100 * 2 / 10.65, rel=0.01)


def test_the_believed_angle_is_the_prediction_of_the_row_before(drive):
    """The firmware's memory at a row: the angle that it predicts for the next sample, and the offset to the field."""
    lag = math.radians(2.5)
    run = made(drive)
    theta = run.electrical_angle(run.trace)
    step = theta[1] - theta[0]
    offset = 0x9000_0000
    predicted = np.round(((theta + step - lag) / (2 * math.pi) % 1.0) * 2 ** 32 - offset) % 2 ** 32
    run.trace.update(angle_next_q32=predicted, angle_offset_q32=np.full_like(theta, offset))
    add_belief(run.trace)
    found = figures(run, "angle_error", from_s=0.01)
    assert found == pytest.approx({"mean": 2.5, "largest": 2.5}, abs=1e-3)
    one_period_deg = math.degrees(step)
    assert one_period_deg > 1.7, "a column that is off by a row would show"


def test_angle_errors_wrap(drive):
    run = made(drive)
    run.trace["angle_fw_rad"] = run.electrical_angle(run.trace) + 7 * 2 * math.pi - 0.1
    assert figures(run, "angle_error")["mean"] == pytest.approx(math.degrees(0.1), abs=1e-6)


def test_distortion_is_that_of_the_worst_phase(drive):
    run = made(drive, rpm=1500)
    theta = run.electrical_angle(run.trace)
    run.trace["i_b_A"] = run.trace["i_b_A"] + 0.06 * np.sin(5.3 * theta)
    assert figures(run, "distortion", from_s=0.0, to_s=0.5)[""] == pytest.approx(3.0, rel=0.02)


@pytest.mark.parametrize("off_s, periods", [(0.2, 0), (0.2 + DT, 1), (0.2 + 3 * DT, 3), (0.2 + 1.4 * DT, 2)])
def test_bridge_off_is_a_whole_number_of_periods(drive, off_s, periods):
    run = made(drive, gates=lambda t: np.where(t < off_s - 1e-9, 5, 0), gate_live=lambda t: np.where(t < off_s - 1e-9, 1, 0))
    found = figures(run, "bridge_off", since=0.2)[""]
    assert found == periods and isinstance(found, int)


@pytest.mark.parametrize("start_up", (31, 400))
@pytest.mark.parametrize("conducted, periods", ((0.0, 0), (0.6, 1), (25.0, 25)))
def test_by_a_reset_the_bridge_is_off_when_it_ceases_to_conduct(drive, start_up, conducted, periods):
    """The samples end with the reset: the last is at 0.2 s, and the next tells how long each high side conducted since then."""
    run = made(drive)
    t, back_s = run.trace["t_s"], 0.2 + start_up * DT
    live = t < 0.2 + DT / 2
    duty = np.where(live, 0.5, conducted / start_up)
    columns = {**run.trace, "gates": 5 * live, "gate_live": 1 * live, "duty_a": duty, "duty_b": duty / 2, "duty_c": 0 * duty}
    kept = live | (t > back_s - DT / 2)
    run = replace(run, trace=Trace({name: column[kept] for name, column in columns.items()}))
    assert figures(run, "bridge_off", since=0.2)[""] == periods


def test_state_says_what_came_after_it(drive):
    run = made(drive, state=lambda t: np.where(t < 0.3, ENABLED, 3))
    assert figures(run, "state", from_s=0.1, to_s=0.29)[""] == "OPERATION_ENABLED"
    assert figures(run, "state", from_s=0.1, to_s=0.4)[""] == "OPERATION_ENABLED, then SWITCHED_ON at 0.3000 s"


def test_limits_belong_to_parts(drive):
    run = made(drive)
    entry = {"name": "x", "kind": "speed_error", "from_s": 0.1, "to_s": 0.2, "reference_rpm": 1470}
    found = measure(SimpleNamespace(key="t", figures=[{**entry, "max": {"largest": 1}}]), run)
    assert found["x, mean"].passed is None and found["x, largest"].passed is False
    for limit, complaint in ((3, "needs to say of what"), ({"median": 1}, "for 'median', which this kind does not give")):
        with pytest.raises(LauncherError, match=complaint):
            measure(SimpleNamespace(key="t", figures=[{**entry, "max": limit}]), run)


def test_a_limit_may_be_for_some_motors_only(drive):
    run = made(drive)
    entry = {"name": "x", "kind": "peak_current", "max": 0.1, "otherwise": "it pulls"}
    held, = measure(SimpleNamespace(key="t", figures=[{**entry, "only_if": "rated_torque_Nm > 0"}]), run).values()
    assert held.passed is False and held.note == ""
    free, = measure(SimpleNamespace(key="t", figures=[{**entry, "only_if": "rated_torque_Nm < 0"}]), run).values()
    assert free.passed is None and free.value > 0.1 and free.note == "no limit applies: it pulls"
    with pytest.raises(LauncherError, match="'only_if' and 'otherwise' belong together"):
        measure(SimpleNamespace(key="t", figures=[entry]), run)


def test_every_kind_says_how_it_measures():
    for name, kind in KINDS.items():
        assert len(kind.method) >= 15 and kind.parts, name


# ---- swept sine ----------------------------------------------------------------------------------------------------

HZ = [50, 100, 200, 350, 500, 700, 900, 1150, 1450, 1900, 2600, 3600, 5200, 8000]
R_OHM, L_H = 0.36, 200e-6
A = math.exp(-R_OHM * DT / L_H)
B = (1 - A) / R_OHM
KP, KI = 2 * math.pi * 1000 * L_H, 2 * math.pi * 1000 * R_OHM * DT


def closed_at(hz):
    """Plant with zero-order hold, one sample for computing, PI: from what is sensed to the current, negative feedback."""
    z = np.exp(2j * math.pi * np.asarray(hz) * DT)
    opened = B / (z - A) / z * (KP + KI * z / (z - 1))
    return opened / (1 + opened)


def injected(t, steps):
    added = np.zeros_like(t)
    for step, following in zip(steps, steps[1:]):
        amplitude, hz, _ = (float(word) for word in step.args)
        added += np.where((t >= step.t_s) & (t < following.t_s), amplitude * np.sin(2 * math.pi * hz * (t - step.t_s)), 0)
    return added


@pytest.fixture(scope="module")
def swept(drive):
    """A loop simulated sample by sample, with a reference of 3 A and noise in its sensor."""
    starts = 0.02 + np.concatenate([[0], np.cumsum([0.006 + max(0.018, 1.1 / hz) for hz in HZ])])
    steps = [Step(float(s), "sensor_sine", ["0.4", str(hz), "1.57"]) for s, hz in zip(starts, HZ)]
    steps.append(Step(float(starts[-1]), "sensor_sine", ["0", "0", "0"]))
    t = DT * np.arange(1, round((starts[-1] + 0.01) / DT))
    added = injected(t, steps) + np.random.default_rng(1).normal(0, 0.01, len(t))
    current, acting, integral = np.zeros_like(t), 0.0, 0.0
    for k in range(len(t) - 1):
        error = 3.0 - (current[k] + added[k])
        integral += KI * error
        current[k + 1] = A * current[k] + B * acting
        acting = KP * error + integral
    run = made(drive, length_s=t[-1] + DT, rpm=0.0, steps=steps)
    assert len(run.trace["t_s"]) == len(t)
    run.trace["i_q_true_A"] = current
    return run, float(starts[0]), float(starts[-1])


def test_sweep_finds_the_closed_loop(swept):
    run, start, end = swept
    loop = sweep(run, "q", start, end)
    assert list(loop.hz) == HZ
    np.testing.assert_allclose(loop.closed, closed_at(HZ), atol=0.02)


def test_sweep_figures_are_those_of_the_transfer_function(swept):
    run, start, end = swept
    fine = np.geomspace(50, 8000, 100001)
    closed = closed_at(fine)
    opened = closed / (1 - closed)
    crossover = np.argmax(np.abs(opened) < 1)
    where = {"axis": "q", "from_s": start, "to_s": end}
    bandwidth = fine[np.argmax(np.abs(closed) < math.sqrt(0.5))]
    assert figures(run, "sweep_bandwidth", **where)[""] == pytest.approx(bandwidth, rel=0.03)
    lag = -np.unwrap(np.angle(closed))
    assert figures(run, "sweep_lag", **where)[""] == pytest.approx(fine[np.argmax(lag > math.pi / 2)], rel=0.03)
    margin = 180 + np.degrees(np.unwrap(np.angle(opened))[crossover])
    assert figures(run, "sweep_phase_margin", **where)[""] == pytest.approx(margin, abs=2)
    assert figures(run, "sweep_sensitivity", **where)[""] == pytest.approx(np.abs(1 - closed).max(), rel=0.03)


def test_sweep_needs_its_steps(swept, drive):
    run, start, _ = swept
    assert figures(run, "sweep_bandwidth", axis="q", from_s=start, to_s=start + 0.03)[""] is None
    assert figures(made(drive), "sweep_bandwidth", axis="q", from_s=0.0, to_s=1.0)[""] is None
