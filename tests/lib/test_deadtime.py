# SPDX-License-Identifier: MIT
"""Dead-time compensation."""
from fractions import Fraction
from math import floor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

AMOUNTS = (0, 1, 40, 50, 333, 32767)
CURRENT = np.arange(-70000, 70001)


def test_odd_and_monotone_and_saturated(lib):
    for knee_shift in (1, 5, 8, 11, 15):
        for amount in AMOUNTS:
            out = lib.deadtime(CURRENT, amount, knee_shift)
            assert np.array_equal(out, -out[::-1])
            assert np.all(np.diff(out) >= 0)
            assert np.all(out[CURRENT >= 1 << knee_shift] == amount)
            assert np.all(out[CURRENT <= -(1 << knee_shift)] == -amount)


@pytest.mark.parametrize("i", (-2**31, 2**31 - 1))
def test_extreme_currents(lib, i):
    assert lib.deadtime(i, 32767, 15)[0] == (32767 if i > 0 else -32767)


@given(i=st.integers(-40000, 40000), amount=st.integers(0, 32767), knee_shift=st.integers(1, 15))
def test_linear_between_the_knees(lib, i, amount, knee_shift):
    knee = 1 << knee_shift
    exact = Fraction(abs(max(-knee, min(knee, i))) * amount, knee)
    rounded = floor(exact + Fraction(1, 2))  # ties away from 0
    assert lib.deadtime(i, amount, knee_shift)[0] == (rounded if i >= 0 else -rounded)
