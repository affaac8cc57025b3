# SPDX-License-Identifier: MIT
"""Dead-time compensation: the share of the dead time that a current asks for."""
import numpy as np
import pytest
from binding import constant
from hypothesis import given
from hypothesis import strategies as st

FRACTIONS = range(29)
KNEE, FULL = constant("deadtime.h", "DEADTIME_KNEE_Q15"), constant("deadtime.h", "DEADTIME_FULL")
LOW, HIGH = -2**31, 2**31 - 1


def law(current, fraction):
    return np.clip(np.asarray(current, dtype=np.int64) // (4 << fraction), -FULL, FULL - 1)


@pytest.mark.parametrize("fraction", FRACTIONS)
def test_every_step_of_every_format(lib, fraction):
    """The values at both sides of every step, all else lying between two equal ones: with monotony, the whole domain."""
    steps = np.arange(-FULL - 3, FULL + 4) * (4 << fraction)
    current = np.unique(np.concatenate([steps - 1, steps, [LOW, LOW + 1, 0, HIGH - 1, HIGH]]))
    current = current[(current >= LOW) & (current <= HIGH)]
    share = lib.deadtime(current, fraction)
    assert np.array_equal(share, law(current, fraction))
    assert np.all(np.diff(share) >= 0)


@pytest.mark.parametrize("fraction", (0, 1, 5, 13))
def test_all_currents_of_17_bits_and_a_stride_through_all(lib, fraction):
    for current in (np.arange(-70000, 70001), np.arange(LOW, HIGH, 2999)):
        share = lib.deadtime(current, fraction)
        assert np.array_equal(share, law(current, fraction))
        assert np.all(np.diff(share) >= 0)


@pytest.mark.parametrize("fraction", FRACTIONS)
def test_ends(lib, fraction):
    """Full compensation from the knee on, as far as the word reaches."""
    one = 1 << fraction
    above = [current for current in ((KNEE - 4) * one, KNEE * one, 32767 * one, HIGH) if current <= HIGH]
    below = [current for current in (-KNEE * one, -32768 * one, LOW) if current >= LOW]
    if (KNEE - 4) * one <= HIGH:
        assert set(lib.deadtime(above, fraction)) == {FULL - 1}
        assert lib.deadtime((KNEE - 4) * one - 1, fraction)[0] == FULL - 2
    if -KNEE * one >= LOW:
        assert set(lib.deadtime(below, fraction)) == {-FULL}
        assert lib.deadtime(-KNEE * one + 4 * one, fraction)[0] == 1 - FULL
    assert lib.deadtime([0, 4 * one - 1, -1], fraction).tolist() == [0, 0, -1]


@given(current=st.integers(LOW, HIGH), other=st.integers(LOW, HIGH), fraction=st.sampled_from(FRACTIONS))
def test_monotone_anywhere(lib, current, other, fraction):
    first, second = (int(lib.deadtime(i, fraction)[0]) for i in sorted((current, other)))
    assert -FULL <= first <= second <= FULL - 1
    assert int(lib.deadtime(current, fraction)[0]) == int(law(current, fraction))
