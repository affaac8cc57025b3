# SPDX-License-Identifier: MIT
"""Space-vector modulation by min-max injection."""
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

FAR = 2**29 - 1
ANGLE = np.arange(0, 65536, 7) * (2 * np.pi / 65536)


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


def test_amplitude_is_reached(lib):
    """A sine of amplitude 2/sqrt(3) comes out with peaks of 1: the gain over plain sine modulation, all angles."""
    for amplitude in (300, 18918, 300000):
        a, b = (np.rint(amplitude * np.cos(ANGLE - shift)).astype(int) for shift in (0, 2 * np.pi / 3))
        out = check(lib, phases(a, b))
        assert abs(np.abs(out).max() - amplitude * np.sqrt(3) / 2) <= 1.5


def test_centred(lib):
    """Largest and smallest lie symmetrically about 0, to one LSB: 1 where the half was rounded down, -1 where up."""
    rng = np.random.default_rng(3)
    a, b = rng.integers(-40000, 40001, (2, 100000))
    v = phases(a, b)
    out = check(lib, v)
    total = out.max(axis=0) + out.min(axis=0)
    odd = (v.max(axis=0) + v.min(axis=0)) % 2 == 1
    up = v[2] > np.maximum(v[0], v[1])
    assert np.array_equal(total, np.where(odd, np.where(up, -1, 1), 0))


def test_zero_is_zero(lib):
    assert [int(x[0]) for x in lib.svm(0, 0, 0)] == [0, 0, 0]
