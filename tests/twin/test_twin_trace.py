# SPDX-License-Identifier: MIT
"""The trace of a closed-loop run as a stranger would use it: identify the motor from it, without looking into the twin.

The trace has instantaneous currents, angle, speed and torque at each ADC trigger, and phase voltages averaged since the
trigger before. So Faraday's law is taken between two rows, in stator coordinates, where it needs no derivative:

    mean v = R * mean i + (change of flux linkage) / T,    flux linkage = (Ld i_d + psi + j Lq i_q) exp(j theta_e)

which is linear in R, Ld, Lq and psi; it is the integral of the dq voltage equations. Likewise the impulse between rows
is linear in J, friction and cogging. A triggered current lies in the middle of a zero vector, where the ripple of a
symmetrical PWM passes through its mean, so the mean of two of them is that of the period between.
"""
import numpy as np
import pytest

from launcher import simulate

MOTORS = ("teknic_m2310p", "abb_m2bj100l")  # without saliency, and with: Lq/Ld = 1.42
PERIOD_S = 50e-6
RECORDED_S = 1.7  # the end of the alignment, and all that the drive is told then
ROWS_PER_BLOCK = 20  # mechanics is slow: 1 ms makes the rounding of the speed column small


def means(column):
    return (column[1:] + column[:-1]) / 2


def rates(column):
    return np.diff(column) / PERIOD_S


def blocks(column):
    return column[:len(column) // ROWS_PER_BLOCK * ROWS_PER_BLOCK].reshape(-1, ROWS_PER_BLOCK).mean(axis=1)


def space_vector(trace, name, unit):
    a, b, c = (trace[f"{name}_{phase}_{unit}"] for phase in "abc")
    return (2 * a - b - c) / 3 + 1j * (b - c) / np.sqrt(3)


def rms(values):
    return np.sqrt(np.mean(np.abs(values)**2))


class Recorded:
    """Quantities at the rows, from the trace, and the motor file's own values."""

    def __init__(self, result):
        end_s = result.trace["t_s"][-1]
        trace = result.trace.between(end_s - RECORDED_S, end_s - PERIOD_S)
        motor = result.drive.motor
        self.trace, self.motor = trace, {**motor["electrical"], **motor["mechanical"]}
        self.inertia_kgm2 = self.motor["inertia_kgm2"] * (1 + motor["load"]["inertia_ratio"])
        thermal = motor["thermal"]
        self.warmth = 1 + thermal["copper_tempco_per_k"] * (trace["winding_C"][1:] - 25)
        self.turned = np.exp(1j * self.motor["pole_pairs"] * trace["theta_mech_rad"])
        self.i_ab, self.v_ab = space_vector(trace, "i", "A"), space_vector(trace, "v", "V")[1:]
        self.i_dq = self.i_ab / self.turned
        self.torque_nm = means(trace["torque_Nm"])


def late(t_s, **what):
    return {"t_s": t_s, "after_state": "OPERATION_ENABLED", **what}


# alignment, acceleration, rated load, reversal: excites every parameter
SCENARIO = {"key": "identification", "end_s": 12.0, "preamble_s": 0.05,
            "step": [{"t_s": 0.15, "console": "on"}, late(0.05, console="speed 1500"),
                     late(0.40, event="load_nm", args=["rated_torque_Nm"]), late(0.55, console="speed -1500"),
                     late(0.80, event="end", args=[])]}


@pytest.fixture(scope="module", params=MOTORS)
def run(request, tmp_path_factory):
    return Recorded(simulate(SCENARIO, motor=request.param, out_dir=tmp_path_factory.mktemp(request.param),
                             plant="ideal", spread=0))


def electrical_columns(run):
    """What multiplies R, Ld, Lq, psi in the voltage between two rows."""
    return np.stack([means(run.i_ab) * run.warmth, rates(run.i_dq.real * run.turned),
                     rates(1j * run.i_dq.imag * run.turned), rates(run.turned)], axis=1)


def test_rows_are_one_period_apart(run):
    np.testing.assert_allclose(np.diff(run.trace["t_s"]), PERIOD_S, atol=1e-9)


def test_phases_sum_to_zero(run):
    for name, unit, rounding in (("i", "A", 5e-6), ("v", "V", 5e-5)):
        total = sum(run.trace[f"{name}_{phase}_{unit}"] for phase in "abc")
        assert np.abs(total).max() <= 3.01 * rounding


def test_angle_is_the_integral_of_speed(run):
    travelled = np.cumsum(means(run.trace["speed_rad_s"])) * PERIOD_S
    angle = run.trace["theta_mech_rad"][1:] - run.trace["theta_mech_rad"][0]
    # after some 80 rad: what trapezoids of a rippling speed leave, below a step of the encoder (1.6 mrad)
    np.testing.assert_allclose(angle, travelled, atol=5e-4)


def test_voltage_equations_hold(run):
    parameters = [run.motor[key] for key in ("resistance_ohm", "ld_h", "lq_h", "flux_wb")]
    residual = run.v_ab - electrical_columns(run) @ parameters
    assert rms(residual) < 2e-3 * rms(run.v_ab)


def test_identified_electrical_parameters(run):
    columns = electrical_columns(run)
    found, *_ = np.linalg.lstsq(np.vstack([columns.real, columns.imag]), np.concatenate([run.v_ab.real, run.v_ab.imag]),
                                rcond=None)
    for value, key, percent in zip(found, ("resistance_ohm", "ld_h", "lq_h", "flux_wb"), (0.5, 1.0, 1.0, 0.1)):
        assert value == pytest.approx(run.motor[key], rel=percent / 100), key


def test_torque_column(run):
    m = run.motor
    torque = 1.5 * m["pole_pairs"] * (m["flux_wb"] + (m["ld_h"] - m["lq_h"]) * run.i_dq.real) * run.i_dq.imag
    # currents are written to 10 uA, the angle to 1 urad
    np.testing.assert_allclose(run.trace["torque_Nm"], torque, atol=1e-5 * np.abs(torque).max())


def test_identified_inertia_and_friction(run):
    trace, m = run.trace, run.motor
    speed = means(trace["speed_rad_s"])
    cogging = means(np.sin(m["cogging_per_rev"] * trace["theta_mech_rad"]))
    columns = np.stack([blocks(c) for c in (rates(trace["speed_rad_s"]), np.sign(speed), speed, cogging)], axis=1)
    driving_nm = blocks(run.torque_nm - means(trace["load_Nm"]))
    turning = blocks((np.abs(speed) > 20).astype(float)) == 1  # stuck or slow, friction is whatever it has to be
    assert np.count_nonzero(turning) > 500
    found, *_ = np.linalg.lstsq(columns[turning], driving_nm[turning], rcond=None)
    inertia_kgm2, coulomb_nm, viscous_nms, cogging_nm = found
    assert inertia_kgm2 == pytest.approx(run.inertia_kgm2, rel=0.005)
    assert cogging_nm == pytest.approx(m["cogging_nm"], rel=0.02)
    # the viscous part is too small to be told from the rest; what matters is their sum, here at 955 rpm
    friction_nm = m["friction_coulomb_nm"] + 100 * m["friction_viscous_nms"]
    assert coulomb_nm + 100 * viscous_nms == pytest.approx(friction_nm, rel=0.05)


def test_power_balance(run):
    m = run.motor
    i_mean = means(run.i_ab)
    electrical_w = 1.5 * (run.v_ab * i_mean.conj()).real
    copper_w = 1.5 * m["resistance_ohm"] * run.warmth * np.abs(i_mean)**2
    field_j = 0.75 * (m["ld_h"] * run.i_dq.real**2 + m["lq_h"] * run.i_dq.imag**2)
    shaft_w = run.torque_nm * means(run.trace["speed_rad_s"])
    missing_w = electrical_w - copper_w - rates(field_j) - shaft_w
    # what is missing is the copper loss of the current ripple, not in these means
    assert abs(missing_w.mean()) < 1e-3 * np.abs(electrical_w).mean()  # driven and braked alike: their sum says nothing
    assert rms(blocks(missing_w)) < 1e-3 * np.abs(electrical_w).max()
