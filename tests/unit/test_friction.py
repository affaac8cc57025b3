# SPDX-License-Identifier: MIT
"""Friction fed forward (drive/modes_control.c): how much, which way, and how steeply about rest."""
import pytest

from rigs.motor_numbers import compute, shipped
from rigs.operating import Drive

FRICTION_UNM = 40_000
EDGES = 1000  # clocks between them: the speed loop has all of its gains


@pytest.fixture
def drive(c):
    """In a mode, to turn so fast; with a friction that is told, or none."""
    def running(ref_rpm, mode="SPEED", told=FRICTION_UNM, clocks=EDGES):
        d = Drive(c, mode)
        d.axis.params.friction_unm = told
        c.tuning_compute(d.axis.params, d.axis.tuning)
        c.speed_loop_tune(d.axis.speed, d.axis.tuning)
        d.axis.speed.ref_rpm_q16 = round(ref_rpm * 65536)
        d.axis.speed.estimate.interval_clocks = clocks
        return d
    return running


def known(c, d):
    return c.modes_feedforward_torque_q15(d.axis)


@pytest.mark.parametrize("motor", ("teknic_m2310p", "maxon_ec22", "abb_m2bj100l"))
def test_a_friction_is_the_current_that_makes_its_torque(c, motor):
    told = shipped(motor)
    unm = round(0.02 * 1.5 * told["pole_pairs"] * told["flux_uwb"] * told["i_max_ma"] / 1e3)
    tuning = compute(c, {**told, "friction_unm": unm})[2]
    if told["ld_uh"] == told["lq_uh"]:
        assert tuning.friction_q15 == pytest.approx(0.02 * tuning.i_max_q15, rel=0.01, abs=1)
    assert 0 < tuning.friction_q15 < 0.03 * tuning.i_max_q15
    assert compute(c, {**told, "friction_unm": 50_000_000})[2].friction_q15 == tuning.i_max_q15 // 4, "no more is friction"
    assert compute(c, told)[2].friction_q15 == 0


@pytest.mark.parametrize("rpm, share", ((1000, 1), (-1000, -1), (0, 0)))
def test_it_goes_with_the_reference_and_not_with_the_shaft(c, drive, rpm, share):
    d = drive(rpm)
    assert d.axis.tuning.friction_q15 > 100
    for shaft_rpm in (-300, 0, 300):
        d.turn(shaft_rpm)
        assert known(c, d) == share * d.axis.tuning.friction_q15
    assert known(c, drive(rpm, told=0)) == 0


@pytest.mark.parametrize("mode, part", (("SPEED", 1), ("CYCLIC_SPEED", 1), ("POSITION", 4), ("CYCLIC_POSITION", 4)))
@pytest.mark.parametrize("rpm", (0.25, -0.25))
def test_about_rest_it_is_as_steep_as_the_speed_loop_and_less_in_a_position_loop(c, drive, rpm, mode, part):
    d = drive(rpm, mode)
    answer = rpm * 16 * d.axis.speed.kp_q16 / 65536
    assert 8 < abs(answer) < d.axis.tuning.friction_q15
    assert known(c, d) == pytest.approx(answer / part, abs=1.5)
    slow = drive(rpm, mode, clocks=4 * 150_000)  # edges far apart: the loop's gains are a quarter
    assert known(c, slow) == pytest.approx(answer / part / 4, abs=1.5)


def test_with_the_speed_loop_it_keeps_to_the_limits(c, drive):
    """What is known and what the loop asks for: together no more than the limit."""
    d = drive(1000)
    limit = d.axis.torque.limits.high
    d.axis.speed.integral_q29 = 2 * limit << 14
    assert d.control() <= limit
    other = drive(300, told=0)
    assert drive(300).control() - other.control() == pytest.approx(d.axis.tuning.friction_q15, abs=2)
