# SPDX-License-Identifier: MIT
"""PI_Lib_Do and SVM_Lib_Do over the whole int32_t range of every field, against the sentences of LibFoc.h in exact numbers."""
from fractions import Fraction
from itertools import product

import oracle
from hypothesis import given
from hypothesis import strategies as st

KP_MAX, KI_MAX, ERROR_MAX, LIMIT_MAX, INTEGRAL_MAX = 16384, 21845, 98303, 32766, 2**29  # as LibFoc.h states them
ENDS = (oracle.INT32_MIN, oracle.INT32_MIN + 1, -1, 0, 1, oracle.INT32_MAX - 1, oracle.INT32_MAX)
ANY = st.one_of(st.integers(oracle.INT32_MIN, oracle.INT32_MAX), st.integers(-200000, 200000), st.integers(-3, 3),
                st.sampled_from(ENDS))


def within(x, low, high):
    return max(low, min(high, x))


def controller(state, sample):
    """(output, state afterwards)"""
    reference, measured, limit = sample
    kp, ki = within(state[0], 0, KP_MAX), within(state[1], 0, KI_MAX)
    integral = within(state[2], -INTEGRAL_MAX, INTEGRAL_MAX)
    error, limit = within(reference - measured, -ERROR_MAX, ERROR_MAX), within(limit, 0, LIMIT_MAX)
    wanted = (kp * error + integral) // 512
    further = (wanted > limit and error > 0) or (wanted < -limit and error < 0)
    return within(wanted, -limit, limit), (state[0], state[1], integral + (0 if further else ki * error // 64))


def centred(v):
    """v - (max + min) / 2, a tie up, saturated."""
    middle = Fraction(max(v) + min(v), 2)
    return tuple(oracle.saturate(oracle.round_half_up(x - middle)) for x in v)


@given(state=st.tuples(ANY, ANY, ANY), sample=st.tuples(ANY, ANY, ANY), overlap=st.sampled_from((None, 0, 1, 2)))
def test_pi_anywhere(lib, state, sample, overlap):
    assert lib.pi_api(state, sample, overlap) == controller(state, sample)


def test_pi_about_the_ends_of_its_ranges(lib):
    for kp, ki, integral in product((-1, 0, KP_MAX, KP_MAX + 1), (-1, 0, KI_MAX, KI_MAX + 1),
                                    (-INTEGRAL_MAX - 1, -INTEGRAL_MAX, 0, INTEGRAL_MAX, INTEGRAL_MAX + 1)):
        for error, limit in product((-ERROR_MAX - 1, -ERROR_MAX, -1, 0, 1, ERROR_MAX, ERROR_MAX + 1),
                                    (-1, 0, 1, LIMIT_MAX, LIMIT_MAX + 1)):
            for sample in ((error, 0, limit), (0, -error, limit)):
                assert lib.pi_api((kp, ki, integral), sample) == controller((kp, ki, integral), sample)


def test_pi_at_the_ends_of_int32(lib):
    for state in product(ENDS[::3], repeat=3):
        for sample in product(ENDS[::2], repeat=3):
            assert lib.pi_api(state, sample) == controller(state, sample)


@given(v=st.tuples(ANY, ANY, ANY), overlap=st.sampled_from((None, -2, -1, 0, 1, 2)))
def test_svm_anywhere(lib, v, overlap):
    assert lib.api("SVM_Lib_Do", *v, output_offset=overlap) == centred(v)


def test_svm_at_the_ends_of_int32(lib):
    for v in product(ENDS, repeat=3):
        assert lib.api("SVM_Lib_Do", *v) == centred(v)


def test_svm_of_all_small_voltages(lib):
    for v in product(range(-9, 10), repeat=3):
        out = lib.api("SVM_Lib_Do", *v)
        assert out == centred(v)
        assert max(out) + min(out) in (0, 1)
