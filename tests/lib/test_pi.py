# SPDX-License-Identifier: MIT
"""The PI controller: its law in exact integers, the bound on its integral, anti-windup, and a plant."""
from itertools import product

import numpy as np
import pytest
from binding import Pi, constant
from hypothesis import given
from hypothesis import strategies as st

KP_ONE, KI_ONE, FRACTION = 1 << 9, 1 << 15, 1 << 9
KP_MAX, KI_MAX, ERROR_MAX, LIMIT_MAX = (constant("pi.h", f"PI_{name}")
                                        for name in ("KP_MAX_Q9", "KI_MAX_Q15", "ERROR_MAX", "OUTPUT_MAX"))
INTEGRAL_MAX = 1 << 29


def law(pi, error, limit):
    """(output, integral) of one sample, by the header's sentences; nothing in it can overflow."""
    wanted = (pi.kp_q9 * error + pi.integral_q9) // FRACTION
    step = pi.ki_q15 * error // 64
    held = (wanted > limit and error > 0) or (wanted < -limit and error < 0)
    return max(-limit, min(limit, wanted)), pi.integral_q9 + (0 if held else step)


def one_step(lib, pi, error, limit):
    return tuple(int(values[0]) for values in lib.pi_steps(pi, error, limit))


def around(limit):
    """Values of all magnitudes up to a limit, and about it."""
    return st.one_of(st.integers(-300, 300), st.integers(-limit, limit), st.sampled_from([-limit, 1 - limit, limit - 1, limit]))


PIS = st.builds(Pi, st.integers(0, KP_MAX), st.integers(0, KI_MAX), around(INTEGRAL_MAX))


@given(pi=PIS, error=around(ERROR_MAX), limit=st.integers(0, LIMIT_MAX))
def test_the_law_anywhere(lib, pi, error, limit):
    expected = law(pi, error, limit)
    assert one_step(lib, pi, error, limit) == expected


def test_the_law_at_all_corners(lib):
    corners = product((0, 1, KP_MAX - 1, KP_MAX), (0, 1, KI_MAX - 1, KI_MAX),
                      (-ERROR_MAX, -65535, -32769, -1, 0, 1, 32768, ERROR_MAX),
                      (-INTEGRAL_MAX, -2**24, -513, -512, -1, 0, 1, 511, 512, 2**24, INTEGRAL_MAX),
                      (0, 1, 16384, LIMIT_MAX - 1, LIMIT_MAX))
    for kp, ki, error, integral, limit in corners:
        expected = law(Pi(kp, ki, integral), error, limit)
        assert one_step(lib, Pi(kp, ki, integral), error, limit) == expected


@given(pi=PIS, error=around(ERROR_MAX))
def test_the_law_at_the_edge_of_the_limit(lib, pi, error):
    """Exactly at the limit is not limited; one LSB beyond is."""
    wanted = (pi.kp_q9 * error + pi.integral_q9) // FRACTION
    for limit in {abs(wanted) - 1, abs(wanted), abs(wanted) + 1}:
        if 0 <= limit <= LIMIT_MAX:
            state = Pi(pi.kp_q9, pi.ki_q15, pi.integral_q9)
            expected = law(state, error, limit)
            assert one_step(lib, state, error, limit) == expected


ANY = st.one_of(st.integers(-2**31, 2**31 - 1), st.integers(-3, 3), st.sampled_from([-2**31, 2**31 - 1]))


@given(step=ANY, unlimited=ANY, output=ANY, limit=st.one_of(st.integers(0, 2**31 - 1), st.integers(0, 3)))
def test_hold_and_saturate_for_any_values(lib, step, unlimited, output, limit):
    for other in (output, unlimited):
        expected = min(step, 0) if unlimited > other else max(step, 0) if unlimited < other else step
        assert int(lib.pi_hold(step, unlimited, other)[0]) == expected
    limited, held = (int(values[0]) for values in lib.pi_saturate(unlimited, step, limit))
    assert limited == max(-limit, min(limit, unlimited))
    assert held == int(lib.pi_hold(step, unlimited, limited)[0])


def largest_step(ki):
    return -(-ki * ERROR_MAX // 64)


def test_the_integral_stays_within_its_bound(lib):
    """An adversary that knows all: of many errors and limits it takes what drives the integral farthest, sample by sample."""
    rng = np.random.default_rng(4)
    farthest = 0.0
    gains = [(0, KI_MAX), (1, KI_MAX), (KP_MAX, KI_MAX), (0, 1)]
    gains += [(int(rng.integers(0, 2) * rng.integers(0, KP_MAX + 1)), int(rng.integers(1, KI_MAX + 1))) for _ in range(40)]
    for sign, (kp, ki) in product((1, -1), gains):
        bound = 32768 * FRACTION + largest_step(ki)
        integral = 0
        for _ in range(30):
            # errors that leave the output just inside, the largest one, and any
            rest = (LIMIT_MAX * FRACTION + FRACTION - 1 - sign * integral) // kp if kp else ERROR_MAX
            tries = [ERROR_MAX, rest, rest + 1, rest // 2, 1, *rng.integers(1, ERROR_MAX, 8)]
            tries = [sign * int(max(-ERROR_MAX, min(ERROR_MAX, error))) for error in tries]
            found = [one_step(lib, Pi(kp, ki, integral), error, int(limit))[1]
                     for error in tries for limit in (LIMIT_MAX, rng.integers(0, LIMIT_MAX))]
            integral = max(found, key=lambda value: sign * value)
            assert sign * integral <= bound
        near = [sign * (LIMIT_MAX * FRACTION + FRACTION - 1)] if kp == 0 else []
        for start in near:  # the last integral that may still step, and the largest step
            integral = one_step(lib, Pi(kp, ki, start), sign * ERROR_MAX, LIMIT_MAX)[1]
            assert sign * integral <= bound
            assert one_step(lib, Pi(kp, ki, integral), sign * ERROR_MAX, LIMIT_MAX)[1] == integral
        farthest = max(farthest, abs(integral) / bound)
    assert farthest > 0.9998  # so the bound is not an idle one


@given(pi=st.builds(Pi, st.integers(0, KP_MAX), st.integers(0, KI_MAX), st.just(0)),
       start=st.integers(-32768 * FRACTION, 32768 * FRACTION), seed=st.integers(0, 2**32 - 1))
def test_the_integral_stays_within_its_bound_for_any_errors(lib, pi, start, seed):
    rng = np.random.default_rng(seed)
    largest = int(rng.choice([100, 5000, ERROR_MAX]))
    pi.integral_q9 = start
    _, integrals = lib.pi_steps(pi, rng.integers(-largest // 4, largest + 1, 300), rng.integers(0, LIMIT_MAX + 1, 300))
    assert np.abs(integrals).max() <= 32768 * FRACTION + largest_step(pi.ki_q15)


def test_step_response_is_the_closed_form(lib):
    """Constant error: kp e + n ki e, a ramp that begins at the second sample."""
    for kp, ki, error in ((250, 62, 1000), (KP_MAX, 4, -90), (0, 33, 333), (512, KI_MAX, 1)):
        n = np.arange(200)
        outputs, _ = lib.pi_steps(Pi(kp, ki, 0), np.full(200, error), LIMIT_MAX)
        exact = kp * error / KP_ONE + n * (ki * error) / KI_ONE
        inside = np.abs(exact) < LIMIT_MAX
        assert inside.sum() > 50
        short = (exact - outputs)[inside]
        assert short.min() >= 0 and short.max() < 1 + 200 / FRACTION  # rounded down, and so was each step


def test_rounding_down_costs_the_integral_less_than_2_to_minus_9_a_sample(lib):
    for ki in (1, 17, 131, KI_MAX):
        for pattern in ([1, -1], [2], [-1], [5, -3, -2]):
            errors = np.tile(pattern, 20000)
            _, integrals = lib.pi_steps(Pi(0, ki, 0), errors, LIMIT_MAX)
            inside = np.abs(integrals) < LIMIT_MAX * FRACTION
            exact = np.cumsum(errors) * ki / 64
            lost = (exact - integrals)[np.logical_and.accumulate(inside)]
            assert lost.size > 10 and lost.min() >= 0 and np.all(lost < np.arange(1, lost.size + 1))


@pytest.mark.parametrize("sign", (1, -1))
@pytest.mark.parametrize("limit", (0, 3000, 16384, LIMIT_MAX))
@pytest.mark.parametrize("kp", (0, 1024, KP_MAX))
def test_saturation_stores_nothing(lib, kp, limit, sign):
    """Ten seconds in saturation leave the integral where the first limited sample found it."""
    pi = Pi(kp, 125, 0)
    _, integrals = lib.pi_steps(pi, np.full(2000, sign * 20000), limit)
    settled = int(integrals[-1])
    outputs, integrals = lib.pi_steps(pi, np.full(200000, sign * 20000), limit)
    assert np.all(outputs == sign * limit) and np.all(integrals == settled)
    beyond = (kp * sign * 20000 + settled) // FRACTION
    assert sign * beyond > limit  # it is the limit that holds it
    if kp:
        assert sign * one_step(lib, pi, -sign * 20000, limit)[0] <= 0  # out of the limit at once


@given(pi=PIS, error=around(ERROR_MAX), limit=st.integers(0, LIMIT_MAX))
def test_the_way_back_is_always_taken(lib, pi, error, limit):
    """Whatever the state, an error that leads away from the limit steps; one that leads further into it does not."""
    wanted, before = (pi.kp_q9 * error + pi.integral_q9) // FRACTION, pi.integral_q9
    moved = one_step(lib, pi, error, limit)[1] - before
    step = pi.ki_q15 * error // 64
    back = (wanted > limit and error < 0) or (wanted < -limit and error > 0)
    further = (wanted > limit and error > 0) or (wanted < -limit and error < 0)
    assert not back or moved == step
    assert not further or moved == 0


def test_an_integral_far_outside_comes_back(lib):
    for sign in (1, -1):
        pi = Pi(100, 500, sign * INTEGRAL_MAX)
        outputs, integrals = lib.pi_steps(pi, np.full(50000, -sign * 2000), LIMIT_MAX)
        assert outputs[0] == sign * LIMIT_MAX and outputs[-1] == -sign * LIMIT_MAX
        assert np.all(sign * np.diff(integrals[:30000]) < 0)


@given(pi=st.builds(Pi, st.integers(0, KP_MAX), st.integers(0, KI_MAX), st.integers(-2**24, 2**24)),
       error=st.integers(-100, 100), feedforward=st.integers(-20000, 20000))
def test_a_feedforward_added_to_the_integral_appears_in_full(lib, pi, error, feedforward):
    plain = (pi.kp_q9 * error + pi.integral_q9) // FRACTION
    pi.integral_q9 += feedforward * FRACTION
    assert one_step(lib, pi, error, LIMIT_MAX)[0] == max(-LIMIT_MAX, min(LIMIT_MAX, plain + feedforward))


def drive_plant(lib, pi, references, limit, gain=0.05, pole=0.02):
    """i += gain * v - pole * i, an R-L winding in per unit; returns currents and outputs."""
    current, currents, outputs = 0.0, [], []
    for reference in references:
        output = int(lib.pi_steps(pi, int(reference) - round(current), limit)[0][0])
        current += gain * output - pole * current
        currents.append(current)
        outputs.append(output)
    return np.array(currents), np.array(outputs)


def cancelling_pi():
    """Pole-zero cancellation: kp = bandwidth/gain, ki = kp * pole makes a first-order loop of 0.2 a sample."""
    kp = 0.2 / 0.05
    return Pi(round((kp + kp * 0.02) * KP_ONE), round(kp * 0.02 * KI_ONE), 0)  # kp + ki: it integrates after the output


def test_closed_loop_has_no_offset_and_no_overshoot(lib):
    currents, _ = drive_plant(lib, cancelling_pi(), np.full(1500, 2000), LIMIT_MAX)
    assert abs(currents[-200:].mean() - 2000) < 0.6
    assert currents.max() < 2000 * 1.02


def test_windup_recovery_in_closed_loop(lib):
    """An unreachable reference for 500 samples, then a reachable one: no overshoot beyond the step's own."""
    limit = 3000  # reaches 7500
    references = np.concatenate([np.full(500, 20000), np.full(300, 2000)])
    currents, outputs = drive_plant(lib, cancelling_pi(), references, limit)
    assert np.all(outputs[20:500] == limit)
    after = currents[500:]
    settled = np.argmax(np.abs(after - 2000) < 100)
    assert 0 < settled < 40  # the plant itself needs 24 samples at -limit
    assert after[settled:].min() > 2000 * 0.9
    assert abs(after[-1] - 2000) < 2


def test_a_step_of_the_reference_keeps_the_disturbance(lib):
    """A constant voltage drop, learnt; then a step that saturates for a while: the integral still knows the drop."""
    pi, drop, current = cancelling_pi(), 1500, 0.0
    history = []
    for reference in [0] * 500 + [4000] * 600:
        output = int(lib.pi_steps(pi, reference - round(current), 4000)[0][0])
        current += 0.05 * (output - drop) - 0.02 * current
        history.append((current, pi.integral_q9 / FRACTION, output))
    assert abs(history[499][1] - drop) < 20
    assert max(output for _, _, output in history[500:]) == 4000
    assert min(integral for _, integral, _ in history[500:]) > drop - 20
    assert abs(history[-1][0] - 4000) < 2
