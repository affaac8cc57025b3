# SPDX-License-Identifier: MIT
"""The square root and the voltage circle."""
from math import isqrt

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

RADII = (0, 1, 2, 3, 255, 9459, 18918, 32767, 32768, 46340, 65535)


def exact_roots(squares):
    """floor(sqrt()) by double precision, corrected in integers."""
    squares = np.asarray(squares, dtype=np.int64)
    root = np.sqrt(squares.astype(np.float64)).astype(np.int64)
    root -= root * root > squares
    root += (root + 1) ** 2 <= squares
    return root


def test_root_around_every_square(lib):
    """floor(sqrt) changes at squares only: it is right everywhere if it is right there and it is monotone between."""
    root = np.arange(65536, dtype=np.int64)
    for offset, expected in ((0, root), (-1, root - 1), (1, root)):
        squares = root**2 + offset
        valid = (squares >= 0) & (squares < 2**32) & ((offset < 1) | (root > 0))
        assert np.array_equal(lib.polar_root_down(squares[valid]), expected[valid])


def test_root_of_all_small_and_strided_values(lib):
    for squares in (np.arange(2**20), np.arange(0, 2**32, 4099), np.arange(2**32 - 2**18, 2**32)):
        assert np.array_equal(lib.polar_root_down(squares), exact_roots(squares))


@given(st.integers(0, 2**32 - 1))
def test_root_anywhere(lib, square):
    assert lib.polar_root_down(square)[0] == isqrt(square)


def test_circle_for_every_d(lib):
    """q gets exactly what d leaves, to the LSB: one more would lie outside."""
    for radius in RADII:
        d_in = np.unique(np.concatenate([np.arange(-radius - 50, radius + 51, max(1, radius // 20000)),
                                         [-65535, 65535, -radius - 1, radius + 1]]).clip(-65535, 65535))
        d = np.clip(d_in, -radius, radius)
        rest = lib.circle_rest(d_in, radius)
        assert np.array_equal(rest, exact_roots(radius**2 - d**2))
        assert np.all(d**2 + rest**2 <= radius**2) and np.all(d**2 + (rest + 1) ** 2 > radius**2)


@given(d=st.integers(-65535, 65535), radius=st.integers(0, 65535))
def test_circle_anywhere(lib, d, radius):
    rest = int(lib.circle_rest(d, radius)[0])
    assert rest == isqrt(max(0, radius * radius - d * d)) == int(lib.circle_rest(-d, radius)[0])
