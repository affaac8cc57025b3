# SPDX-License-Identifier: MIT
"""Space-vector modulation by min-max injection."""
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

FAR = 2**29 - 1


def phases(a, b):
    """Voltages with no zero sequence, the input of all tests."""
    a, b = np.broadcast_arrays(np.asarray(a, dtype=np.int64), np.asarray(b, dtype=np.int64))
    return np.array([a.ravel(), b.ravel(), -(a.ravel() + b.ravel())])


def law(v):
    """v - (max + min) / 2, the half rounded down, but up where c is larger than both others."""
    total = v.max(axis=0) + v.min(axis=0)
    up = v[2] > np.maximum(v[0], v[1])
    return v - np.where(up, -(-total // 2), total // 2)


def check(lib, v, ignored=0):
    out = np.array(lib.svm(v[0], v[1], ignored))
    assert np.array_equal(out, law(v))
    assert np.array_equal(out[0] - out[1], v[0] - v[1])  # line to line, to the bit
    assert np.array_equal(out[1] - out[2], v[1] - v[2])
    return out


def test_every_small_voltage(lib):
    """All ties and all signs of rounding: every pair a, b up to 400."""
    a, b = np.meshgrid(np.arange(-400, 401), np.arange(-400, 401))
    out = check(lib, phases(a, b))
    assert set(np.unique(out.max(axis=0) + out.min(axis=0))) == {-1, 0, 1}


def test_half_of_the_middle(lib):
    """svm_middle() alone: minus half of the voltage in the middle."""
    a, b = np.meshgrid(np.arange(-400, 401), np.arange(-400, 401))
    v = phases(a, b)
    middle = lib.svm_middle(v[0], v[1])
    exact = -np.median(v, axis=0) / 2
    up = v[2] > np.maximum(v[0], v[1])
    assert np.array_equal(middle, np.where(up, np.ceil(exact), np.floor(exact)))


# |v| < 2^29 in all three
PAIRS = st.one_of(st.tuples(st.integers(-FAR // 2, FAR // 2), st.integers(-FAR // 2, FAR // 2)),
                  st.tuples(st.sampled_from([FAR, FAR - 1]), st.integers(-FAR, 0)),
                  st.tuples(st.integers(0, FAR), st.sampled_from([-FAR, 1 - FAR])),
                  st.tuples(st.integers(-5, 5), st.sampled_from([-FAR, FAR, 1, 0, -1])))


@given(pair=PAIRS, garbage=st.integers(-2**31, 2**31 - 1))
def test_exact_to_the_ends_of_the_range(lib, pair, garbage):
    """And c's own word is not read."""
    v = phases(*pair)
    if np.abs(v).max() <= FAR:
        check(lib, v, garbage)
    elif abs(v).max() < 2**30:  # c beyond the range of svm_minmax(), within that of svm_middle()
        assert np.array_equal(lib.svm_middle(v[0], v[1]), (v - law(v))[0])


@given(pair=PAIRS)
def test_within_half_sqrt3_of_the_amplitude(lib, pair):
    """|result| <= ceil(sqrt(3)/2 |v|), in integers: |v|^2 = 2/3 of the sum of squares."""
    v = phases(*pair)
    if np.abs(v).max() > FAR:
        return
    out = check(lib, v)
    largest = max(abs(int(x)) for x in out[:, 0])
    squares = sum(int(x) ** 2 for x in v[:, 0])
    assert largest == 0 or 2 * (largest - 1) ** 2 < squares  # (sqrt(3)/2)^2 2/3 = 1/2
