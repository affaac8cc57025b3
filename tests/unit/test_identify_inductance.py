# SPDX-License-Identifier: MIT
"""Identify's inductance: of a winding with next to no resistance, by halves that differ; and a burst leaves no trace."""
import pytest

from unit.identify_bench import begin, known, reason, thought
from unit.test_unit_identify import BUS_STEPS, RATE_HZ, VBUS_Q15, inductances, play

VOLTS = VBUS_Q15 / 32768 * 57528 / 1000


@pytest.fixture
def begun(c):
    return begin(c)


def steps_for(amps, l_h):
    return round(amps * l_h * RATE_HZ / VOLTS * BUS_STEPS)


@pytest.mark.parametrize("l_h, r_ohm", ((30e-3, 1e-5), (30e-3, 3.4e-5), (30e-3, 4e-5), (300e-6, 1e-6)))
def test_identify_inductance_of_a_winding_without_resistance(c, begun, l_h, r_ohm):
    """There the current rises in a straight line, and L is U T by its change: to either side of where the formula changes."""
    found = inductances(c, begun, l_h, r_ohm, v_steps=steps_for(0.4, l_h))
    for (nh, interval), true in zip(found, (l_h, 2 * l_h)):
        assert nh == pytest.approx(true * 1e9, rel=0.03 if r_ohm < 2e-5 else 0.06), "R of a formula that has few bits left"
        assert 0.02 * nh < interval < 0.2 * nh


def test_identify_inductance_takes_the_first_resistance_where_none_was_measured(c, begun):
    for axis in (0, 1):
        for half in (0, 1):
            for n in range(8):
                play(c, begun, begun.work.inductance.sums[axis][half], 150e-6, 0.5, 1500, seed=n)
    begun.rough_mohm, begun.params.resistance_mohm = 500, 5000
    thought(c, begun, "INDUCTANCE")
    assert known(c, begun, "LD")[0] == pytest.approx(150e3, rel=0.02), "without it 8 % would be missing"


@pytest.mark.parametrize("apart, refused", ((1.08, False), (1.15, True)))
def test_identify_inductance_whose_halves_differ_by_a_tenth_is_refused(c, begun, apart, refused):
    for axis in (0, 1):
        for half in (0, 1):
            for n in range(8):
                play(c, begun, begun.work.inductance.sums[axis][half], 150e-6 * apart**half, 0.3, 1500, seed=n)
    thought(c, begun, "INDUCTANCE")
    assert reason(c, begun, "LD") == reason(c, begun, "LQ") == (c.IDENTIFY_SCATTER if refused else None)


def test_identify_burst_leaves_the_controllers_as_they_were(c, begun):
    """Gains, integrals; and what it has seen is the current along its wave, of each sample."""
    loop, adc, burst = c.current_loop(), c.fabric().adc, begun.burst
    loop.kp_d_q9, loop.kp_q_q9, loop.ki_q15, loop.integral_d_q9, loop.integral_q_q9 = 11, 12, 13, 1400, 1500
    adc.IA, adc.IB = 1000, -500
    burst.angle_q32 = burst.field_q32 = 0
    burst.v_steps, burst.hold = 100, 1
    c.burst_play(burst, loop, adc)
    assert (loop.kp_d_q9, loop.kp_q_q9, loop.ki_q15, loop.integral_d_q9, loop.integral_q_q9) == (11, 12, 13, 1400, 1500)
    assert all(abs(i - 1000) <= 1 for i in burst.i_d_q15) and all(abs(i) <= 1 for i in burst.i_q_q15)
    assert [c.burst_sign(burst, k) for k in range(8)] == [1, -1, -1, 1] * 2
    assert c.burst_peak_q15(burst) == 0, "a current that stands is none of the wave's"
