# SPDX-License-Identifier: MIT
"""The PI controller against closed forms, its anti-windup, and a plant."""
from fractions import Fraction

import numpy as np
from binding import Pi
from hypothesis import given
from hypothesis import strategies as st

KP, KI, ONE = 4096, 1 << 17, 32768


def exact_output(pi, error, feedforward):
    """kp e + (I + ki e) + ff in LSB of Q15, unlimited."""
    error = max(-32768, min(32767, error))
    return Fraction(pi.kp_q12 * error, KP) + Fraction(pi.integral_q30, ONE) + Fraction(pi.ki_q17 * error, KI) + feedforward


PIS = st.builds(Pi, st.integers(0, 32767), st.integers(0, 32767), st.integers(-2**30, 2**30))
ERRORS = st.one_of(st.integers(-200, 200), st.integers(-40000, 40000), st.sampled_from([-2**31, 2**31 - 1]))


@given(pi=PIS, error=ERRORS, feedforward=st.integers(-65536, 65536), limit=st.integers(0, 32768))
def test_one_step_anywhere(lib, pi, error, feedforward, limit):
    """Rounded to nearest inside the limit, limited outside; the integrator obeys both rules of anti-windup."""
    before = pi.integral_q30
    exact = exact_output(pi, error, feedforward)
    exact_step = Fraction(pi.ki_q17 * max(-32768, min(32767, error)), 4)
    outputs, integrals = lib.pi_steps(pi, error, feedforward, limit)
    output, after = int(outputs[0]), int(integrals[0])
    assert abs(output) <= limit and abs(after) <= limit * ONE
    # 1/2 for the rounding, 2^-12 and 2^-16 for what the integrator loses on the way
    assert abs(output - max(-limit, min(limit, exact))) <= Fraction(1, 2) + Fraction(1, 4000)
    moved = after - max(-limit * ONE, min(limit * ONE, before))
    if exact > limit + 1:
        assert moved <= 0
    elif exact < -limit - 1:
        assert moved >= 0
    elif abs(exact) < limit - 1 and max(abs(before), abs(before + exact_step)) < limit * ONE:
        assert abs(moved - exact_step) <= Fraction(1, 2)


@given(pi=PIS, error=st.integers(-32767, 32767), feedforward=st.integers(-60000, 60000), limit=st.integers(0, 32768))
def test_odd_within_rounding(lib, pi, error, feedforward, limit):
    mirror = Pi(pi.kp_q12, pi.ki_q17, -pi.integral_q30)
    plus = [int(x[0]) for x in lib.pi_steps(pi, error, feedforward, limit)]
    minus = [int(x[0]) for x in lib.pi_steps(mirror, -error, -feedforward, limit)]
    assert abs(plus[0] + minus[0]) <= 1
    at_the_limit = abs(plus[0]) >= limit - 1  # where one of the two rounds onto the limit, one may integrate
    assert at_the_limit or abs(plus[1] + minus[1]) <= 1


def test_step_response_is_the_closed_form(lib):
    """Constant error: kp e + n ki e + ff, a ramp from the first sample on."""
    for kp, ki, error in ((2000, 250, 1000), (32767, 17, -900), (0, 131, 333), (4096, 32767, 1)):
        pi = Pi(kp, ki, 0)
        n = np.arange(1, 201)
        outputs, _ = lib.pi_steps(pi, np.full(200, error), -50)
        exact = kp * error / KP + n * (ki * error) / KI - 50
        inside = np.abs(exact) < 32767
        assert inside.sum() > 50
        assert np.abs(outputs - exact)[inside].max() <= 0.5 + 200 * 2.0**-16 + 0.001


def test_small_errors_are_not_lost_nor_biased(lib):
    """One LSB of error, half the time up and half down, leaves the integrator where it was; one-sided, it moves."""
    for ki, drift in ((131, 0), (17, 0), (18, 0.5)):  # 18: every step is a tie, 2^-31 a sample at worst
        _, integrals = lib.pi_steps(Pi(0, ki, 0), np.tile([1, -1], 50000))
        assert abs(int(integrals[-1])) <= drift * 100000
    _, integrals = lib.pi_steps(Pi(0, 1, 0), np.full(100000, 2))
    assert abs(int(integrals[-1]) - 100000 * 2 / 4) <= 100000 / 2
    assert integrals[-1] > 0


def test_saturation_stores_nothing(lib):
    """Ten seconds in saturation, then the error turns: out of the limit at once, as if it had been one sample."""
    for limit in (3000, 32768):
        for sign in (1, -1):
            states = []
            for samples in (1, 200000):
                pi = Pi(8192, 500, 0)
                outputs, integrals = lib.pi_steps(pi, np.full(samples, sign * 20000), 0, limit)
                assert np.all(outputs == sign * limit)
                states.append(int(integrals[-1]))
                outputs, _ = lib.pi_steps(pi, np.array([-sign * 100]), 0, limit)
                assert sign * int(outputs[0]) <= 0
            assert states[0] == states[1]


def test_a_saturated_integrator_still_discharges(lib):
    pi = Pi(100, 500, 2**30)
    outputs, integrals = lib.pi_steps(pi, np.full(50, -2000), 65536, 32768)
    assert np.all(outputs == 32768) and np.all(np.diff(integrals) < 0)


def test_a_shrinking_limit_takes_the_integrator_along(lib):
    pi = Pi(100, 0, 2**30)
    outputs, integrals = lib.pi_steps(pi, np.zeros(4, int), 0, [32768, 20000, 0, 32768])
    assert outputs.tolist() == [32768, 20000, 0, 0] and integrals.tolist() == [2**30, 20000 * ONE, 0, 0]


@given(output=st.integers(-32768, 32768), feedforward=st.integers(-65536, 65536))
def test_preset_is_bumpless(lib, output, feedforward):
    pi = Pi(3000, 500, 12345)
    lib.pi_preset(pi, output, feedforward)
    reachable = max(-32768, min(32768, output - feedforward)) + feedforward
    outputs, _ = lib.pi_steps(pi, 0, feedforward, 32768)
    assert outputs[0] == max(-32768, min(32768, reachable))
    lib.pi_reset(pi)
    assert (pi.kp_q12, pi.ki_q17, pi.integral_q30) == (3000, 500, 0)


def drive_plant(lib, pi, references, limit, gain=0.05, pole=0.02):
    """i += gain * v - pole * i, an R-L winding in per unit; returns currents and outputs."""
    current, currents, outputs = 0.0, [], []
    for reference in references:
        output = int(lib.pi_steps(pi, int(reference) - round(current), 0, limit)[0][0])
        current += gain * output - pole * current
        currents.append(current)
        outputs.append(output)
    return np.array(currents), np.array(outputs)


def test_closed_loop_has_no_offset_and_no_overshoot(lib):
    """Pole-zero cancellation: kp = bandwidth/gain, ki = kp * pole makes a first-order loop of 0.2 a sample."""
    kp = 0.2 / 0.05
    pi = Pi(round(kp * KP), round(kp * 0.02 * KI), 0)
    currents, _ = drive_plant(lib, pi, np.full(1500, 2000), 32768)
    assert abs(currents[-200:].mean() - 2000) < 0.6
    assert currents.max() < 2000 * 1.02


def test_windup_recovery_in_closed_loop(lib):
    """An unreachable reference for 500 samples, then a reachable one: no overshoot beyond the step's own."""
    kp, ki = round(4 * KP), round(4 * 0.02 * KI)
    limit = 3000  # reaches 7500
    references = np.concatenate([np.full(500, 20000), np.full(300, 2000)])
    currents, outputs = drive_plant(lib, Pi(kp, ki, 0), references, limit)
    assert np.all(outputs[20:500] == limit)
    after = currents[500:]
    settled = np.argmax(np.abs(after - 2000) < 100)
    assert 0 < settled < 40  # the plant itself needs 24 samples at -limit
    assert after[settled:].min() > 2000 * 0.9
    assert abs(after[-1] - 2000) < 2
