# SPDX-License-Identifier: MIT
"""What the EMF is held against (control/emf.h): what resistance, dead time and a current on its way may hide of it."""
import math

import pytest

BASE_HZ, MS = 1250, 1e-3


@pytest.fixture
def emf(c):
    """After a millisecond in which the q current has moved by so much; and the reactance of q at the base speed, per unit."""
    params, tuning = c.params(), c.tuning()
    c.params_init(params)
    assert c.tuning_compute(params, tuning).error == c.ERROR_NONE

    def moved(i_d=0, i_q=0, by=0, vbus=12800):
        loop, state = c.current_loop(), c.emf()
        c.current_loop_init(loop)
        c.emf_reset(state, tuning)
        loop.i_d_q15, loop.i_q_q15, loop.vbus_q15 = i_d, i_q, vbus
        state.i_q_q15 = i_q - by
        c.emf_step(state, loop, tuning, 0, 0)
        return state
    moved.x_q, moved.r = tuning.x_q_apparent_q11 / 2**11, tuning.r_q12 / 2**12
    return moved


@pytest.mark.parametrize("by", (-6000, -300, 0, 300, 6000))
def test_a_current_that_moves_may_hide_l_di_by_dt(emf, by):
    inductance = emf.x_q / (2 * math.pi * BASE_HZ)
    most = 32767 / (2 * math.pi * BASE_HZ)  # of a reactance at the base speed, 1.0
    assert emf(by=by).moving_q15 == pytest.approx(min(inductance * abs(by), most) / MS, rel=0.01, abs=2)


def test_resistance_and_dead_time_may_hide_their_voltages(emf):
    """Half of the resistance counts as unknown, and 1/64 of the bus; of d all that its current takes."""
    e = emf(i_d=-4000, i_q=6000)
    assert e.unsure_q15 == pytest.approx(emf.r * (4000 + 6000) / 2 + 12800 / 64, abs=2)
    assert e.slack_q15 == pytest.approx(emf.r * 4000 + 12800 / 64 + e.moving_q15, abs=2)
