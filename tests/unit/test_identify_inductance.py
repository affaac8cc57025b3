# SPDX-License-Identifier: MIT
"""Identify's inductance: of a winding with next to no resistance, by halves that differ; and a burst leaves no trace."""
import math

import pytest

from rigs.identify_alone import I_RANGE_MA, known, measuring, reason, thought
from rigs.winding import BUS_STEPS, LAG, LENGTH, RATE_HZ, VBUS_Q15, inductances, play

VOLTS = VBUS_Q15 / 32768 * 57528 / 1000


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


def salient(c, d, sums, axis, theta, ld_h, lq_h, r_ohm=0.5, volts=4.0):
    """A burst along an axis that is `theta` behind the machine's, exactly: what flows along it and across."""
    b = d.burst
    b.hold, b.v_steps = 1, round(volts / VOLTS * BUS_STEPS)
    turned = axis * math.pi / 2 - theta  # of the wave from the machine's d axis
    decay = [math.exp(-r_ohm / inductance / RATE_HZ) for inductance in (ld_h, lq_h)]
    amps = [0.0, 0.0]
    for k in range(LAG + LENGTH + 1):
        i_d = amps[0] * math.cos(turned) + amps[1] * math.sin(turned)
        i_q = amps[1] * math.cos(turned) - amps[0] * math.sin(turned)
        b.i_d_q15[k], b.i_q_q15[k] = (round(i / (I_RANGE_MA / 1000) * 32768) for i in (i_d, i_q))
        u = c.burst_sign(b, k - LAG) * volts if k >= LAG else 0.0
        along = (u * math.cos(turned), u * math.sin(turned))
        amps = [e * i + (1 - e) / r_ohm * v for e, i, v in zip(decay, amps, along)]
    c.burst_add(sums, b, VBUS_Q15)


def free_rotor(c, d, thetas_deg, ld_h=400e-6, lq_h=1200e-6):
    """LD and LQ of a rotor that nothing holds, at an angle for each half."""
    d.reluctant = True
    d.results[c.IDENTIFY_RESISTANCE].state, d.rough_mohm = c.IDENTIFY_UNKNOWN, 500
    for half, theta_deg in enumerate(thetas_deg):
        for axis in (0, 1):
            for _ in range(8):
                salient(c, d, d.work.inductance.sums[axis][half], axis, math.radians(theta_deg), ld_h, lq_h)
    thought(c, d, "INDUCTANCE")


@pytest.mark.parametrize("theta_deg", (0, 3, -10, 25, 45, -60, 90))
def test_identify_inductance_of_a_rotor_that_crept_on_is_that_of_its_axes(c, begun, theta_deg):
    free_rotor(c, begun, (theta_deg, theta_deg))
    assert known(c, begun, "LD")[0] == pytest.approx(400e3, rel=0.02)
    assert known(c, begun, "LQ")[0] == pytest.approx(1200e3, rel=0.04)


@pytest.mark.parametrize("thetas_deg, moves", (((0, 3), False), ((20, 24), False), ((0, 9), True), ((50, 30), True)))
def test_identify_inductance_of_a_rotor_that_moves_meanwhile_is_refused(c, begun, thetas_deg, moves):
    free_rotor(c, begun, thetas_deg)
    assert reason(c, begun, "LD") == reason(c, begun, "LQ") == (c.IDENTIFY_SCATTER if moves else None)


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


def test_identify_plays_waves_of_the_height_that_it_has_found(c, begun):
    """The resistance test's; there is room for it. What has been seen of each is the current of then."""
    begun.reluctant, begun.burst.v_steps, begun.burst.hold = True, 70, 1
    io = measuring(c, begun, "AXES")
    adc, played = io.fabric.contents.adc, 0
    for ms in range(1, 400):
        begun.ms, begun.phase_ms, adc.IA, adc.IB = min(ms, 2), ms, 900 + ms, -(900 + ms) // 2
        c.identify_measure_axes(begun, io)
        if begun.work.axes.bursts > played:
            assert math.hypot(begun.burst.i_d_q15[5], begun.burst.i_q_q15[5]) == pytest.approx(900 + ms, abs=3)
        played = begun.work.axes.bursts
        assert begun.burst.v_steps == 70
    assert played > 8
