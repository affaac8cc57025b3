# SPDX-License-Identifier: MIT
"""The PI controller: its law in exact integers, and the bound on its integral."""
from itertools import product

import numpy as np
from binding import Pi, constant
from hypothesis import given
from hypothesis import strategies as st

FRACTION = 1 << 9
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
