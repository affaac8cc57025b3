# SPDX-License-Identifier: MIT
"""Identify's first inductance and resistance: what they are, which loop comes of them, and what says nothing."""
import math

import pytest

from rigs.identify_alone import I_RANGE_MA, ONE, V_RANGE_MV, measuring, reason, thought
from rigs.winding import BUS_STEPS, RATE_HZ, VBUS_Q15, play


# ---- pulses ----

def pulsed(c, d, l_h, r_ohm=0.3, v_steps=1500, angles=(1, 1, 1)):
    """Four pulses along each phase, of so much inductance there."""
    for which, times in enumerate(angles):
        for n in range(4):
            play(c, d, d.work.pulses.sums[which], l_h * times, r_ohm, v_steps, seed=n)
    return thought(c, d, "PULSES")


@pytest.mark.parametrize("l_h", (20e-6, 150e-6, 1e-3))
def test_identify_rough_inductance_is_the_least_of_three_angles(c, begun, l_h):
    """And the loop that holds a current then has its zero at a quarter of 100 Hz."""
    volts = VBUS_Q15 / ONE * V_RANGE_MV / 1000
    steps = round(0.5 * l_h * RATE_HZ / volts * BUS_STEPS)
    d = pulsed(c, begun, l_h, 0.01, steps, angles=(1.5, 1, 2))
    assert d.params.ld_uh == d.params.lq_uh == pytest.approx(l_h * 1e6, rel=0.03, abs=1)
    assert d.params.resistance_mohm == pytest.approx(2 * math.pi * 25 * d.params.ld_uh / 1000, rel=0.01, abs=0.6)
    assert d.step == c.IDENTIFY_STEP_HOLD and d.tuning.kp_q_q12 == 0 and d.tuning.ripple_q10 == 0


def test_identify_rough_pulses_that_no_current_answers(c, begun):
    d = pulsed(c, begun, 10.0, 1.0, 40)
    for name in ("LD", "LQ", "RESISTANCE", "DEAD_TIME"):
        assert reason(c, d, name) == c.IDENTIFY_NO_CURRENT


# ---- a current that stands ----

def held(c, d, r_ohm, l_uh, i_share=0.5, sign=1):
    """64 ms of half the rated current, and the voltage that it takes."""
    m = d.work.hold
    i_q15 = round(d.i_rated_q15 * i_share)
    volts = r_ohm * i_q15 / ONE * I_RANGE_MA / 1000
    m.count, m.i_sum_q15 = 64, 64 * i_q15
    m.v_sum = sign * round(volts * 1000 / V_RANGE_MV * ONE * BUS_STEPS * 64)
    d.params.ld_uh = d.params.lq_uh = l_uh
    return thought(c, d, "HOLD")


@pytest.mark.parametrize("r_mohm, l_uh, told_mohm, settle_ms", [
    (300, 100, 300, 10), (300, 700, 300, 12), (300, 1000, 393, 13), (20, 100, 39, 15), (40, 100, 40, 13),
    (100, 5900, 2317, 69), (100, 6100, 2395, 70), (100, 7000, 2749, 70), (2000, 100, 2000, 10)])
def test_identify_rough_resistance_and_how_long_a_step_settles(c, begun, r_mohm, l_uh, told_mohm, settle_ms):
    """The loop of 250 Hz is told at least a quarter of w L; a step of current is waited for by 10 ms and L / R, 60 at most."""
    d = held(c, begun, r_mohm / 1000, l_uh)
    assert d.rough_mohm == pytest.approx(r_mohm, abs=1)
    assert d.params.resistance_mohm == pytest.approx(told_mohm, abs=1)
    assert d.settle_ms == pytest.approx(settle_ms, abs=0 if settle_ms in (10, 70) else 1)
    assert d.step == c.IDENTIFY_STEP_RESISTANCE and d.tuning.kp_q_q12 == 0
    assert d.tuning.ki_q17 == pytest.approx(2 * math.pi * 250 * told_mohm / 1000 * I_RANGE_MA / V_RANGE_MV / RATE_HZ * 2**17,
                                            rel=0.03)


@pytest.mark.parametrize("i_share, sign, refused", ((0.26, 1, False), (0.24, 1, True), (0.5, -1, True)))
def test_identify_rough_current_that_does_not_flow(c, begun, i_share, sign, refused):
    """Less than a quarter of the rated one, or against its voltage."""
    d = held(c, begun, 0.3, 100, i_share, sign)
    for name in ("RESISTANCE", "DEAD_TIME"):
        assert reason(c, d, name) == (c.IDENTIFY_NO_CURRENT if refused else None)


def test_identify_rough_sums_up_the_last_64_ms(c, begun):
    """Half of the rated current along a ramp of 50 ms; the first 300 are for settling."""
    io, m, ends = measuring(c, begun, "HOLD"), begun.work.hold, None
    loop = io.loop.contents
    loop.field_speed_q32 = 99
    while ends is None:
        loop.v_d_steps, loop.vbus_q15, loop.i_d_q15 = begun.ms + 1, 100, 7
        done = c.identify_measure(begun, io)
        assert loop.i_d_ref_q15 == begun.i_rated_q15 // 2 * min(begun.ms, 50) // 50
        ends = begun.ms if done else None
    assert ends == 364 and loop.field_speed_q32 == 0 and (m.count, m.i_sum_q15) == (64, 64 * 7)
    assert m.v_sum == 100 * sum(range(301, 365))
