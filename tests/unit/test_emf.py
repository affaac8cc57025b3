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
    moved.tuning = tuning
    return moved


@pytest.mark.parametrize("by", (-6000, -300, 0, 300, 6000))
def test_a_current_that_moves_may_hide_l_di_by_dt(emf, by):
    inductance = emf.x_q / (2 * math.pi * BASE_HZ)
    most = 32767 / (2 * math.pi * BASE_HZ)  # of a reactance at the base speed, 1.0
    assert emf(by=by).moving_q15 == pytest.approx(min(inductance * abs(by), most) / MS, rel=0.01, abs=2)


def test_resistance_and_dead_time_may_hide_their_voltages(emf):
    """Half of the resistance counts as unknown, and 1/64 of the bus; of d all that its current takes."""
    e = emf(i_d=-4000, i_q=6000)
    assert e.uncertain_q15 == pytest.approx(emf.r * (4000 + 6000) / 2 + 12800 / 64, abs=2)
    assert e.tolerance_q15 == pytest.approx(emf.r * 4000 + 12800 / 64 + e.moving_q15, abs=2)


@pytest.mark.parametrize("counts_deg, agrees", ((0.36, False), (11.25, True)))
def test_what_each_count_does_to_the_voltage_does_not_turn_the_emf(emf, c, counts_deg, agrees):
    """Counts 11 degrees apart, the speed loop's milliseconds beside them: v_d swings by more than the EMF, a mean of 0."""
    verdicts = judged(emf, c, counts_deg, lambda e_q15, n: (e_q15 * 5 // 4) * (1, -1, -1, 1, -1, 1, 1)[n % 7], 300)
    assert (set(verdicts[32:]) == {c.EMF_AGREES}) == agrees


@pytest.mark.parametrize("counts_deg, limit_deg", ((0.36, 15), (2.8, 18), (11.25, 25), (22.5, 34)))
def test_an_emf_that_is_turned_is_found_beyond_15_degrees_and_a_count(emf, c, counts_deg, limit_deg):
    for off_deg, turned in ((limit_deg - 2, False), (limit_deg + 3, True)):
        verdicts = judged(emf, c, counts_deg, lambda e_q15, _, off=off_deg: round(e_q15 * math.tan(math.radians(off))), 300)
        assert (verdicts[-1] == c.EMF_TURNED) == turned, off_deg


@pytest.mark.parametrize("counts_deg, steps", ((0.36, 3), (22.5, 22)))
def test_a_slip_of_60_degrees_is_found_as_soon_as_the_filter_allows(emf, c, counts_deg, steps):
    """Steps of 4 ms, three of them against the encoder: within 0.1 s behind the coarsest counts (docs/faults.md)."""
    verdicts = judged(emf, c, counts_deg, lambda e_q15, n: 0 if n < 100 else round(e_q15 * math.sqrt(3)), 130)
    assert c.EMF_TURNED not in verdicts[60:100] and set(verdicts[100 + steps:]) == {c.EMF_TURNED}


def judged(emf, c, counts_deg, v_d_of, steps):
    """Verdicts on an EMF of a tenth of v_range without current, beside a v_d; the frame follows counts so far apart."""
    loop, state = c.current_loop(), emf(vbus=0)
    tuning = emf.tuning
    c.emf_reset(state, tuning)
    c.emf_set_count(state, round(counts_deg / 360 * 2**32))
    w_q15 = 3277 * 4096 // tuning.emf_q12
    verdicts = []
    for n in range(steps):
        loop.v_d_q15, loop.v_q_q15 = v_d_of(3277, n), 3277
        c.emf_step(state, loop, tuning, w_q15, w_q15)
        verdicts.append(c.emf_judge(state, False))
    return verdicts
