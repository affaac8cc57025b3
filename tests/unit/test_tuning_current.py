# SPDX-License-Identifier: MIT
"""Where each gain of the current loop ends: the largest parameter that fits gives the format's largest number, the next one
is refused or changes nothing more."""
import math

import pytest

from rigs.motor_numbers import shipped, struct

LARGEST = 32767  # of 16 bits
# So that one gain alone comes to its end: bandwidth and ranges make the others small.
BASE = {"current_bw_hz": 6400, "ld_uh": 20, "lq_uh": 20, "resistance_mohm": 100, "flux_uwb": 100, "i_range_ma": 20000,
        "v_range_mv": 60000, "i_rated_ma": 5000}


def tuned(c, **told):
    """(error's name, struct tuning) of the current loop alone."""
    params, tuning = struct(c, {**shipped(), **BASE, **told}), c.tuning()
    c.tuning_rates(params, tuning)
    error = c.tuning_current(params, tuning).error
    return "ERROR_" + c.name("error", error), tuning


def last_that_fits(c, name, told, low=1, high=2**31 - 1):
    """The largest value of a parameter that is not refused."""
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if tuned(c, **{**told, name: middle})[0] == "ERROR_NONE" else (low, middle)
    return low


@pytest.mark.parametrize("field, name, told, most, error", [
    ("kp_d_q12", "ld_uh", {}, 131071, "ERROR_CURRENT_GAIN"), ("kp_q_q12", "lq_uh", {}, 131071, "ERROR_CURRENT_GAIN"),
    ("ki_q17", "resistance_mohm", {}, LARGEST, "ERROR_CURRENT_INTEGRAL_GAIN"),
    ("x_d_q11", "ld_uh", {"current_bw_hz": 300}, 131071, "ERROR_CURRENT_GAIN"),
    ("x_q_q11", "lq_uh", {"current_bw_hz": 300}, 131071, "ERROR_CURRENT_GAIN"),
    ("emf_q12", "flux_uwb", {}, LARGEST, "ERROR_DECOUPLING"),
    ("r_q12", "resistance_mohm", {"current_bw_hz": 90}, LARGEST, "ERROR_CURRENT_INTEGRAL_GAIN")])
def test_the_last_value_that_fits_is_the_formats_largest(c, field, name, told, most, error):
    value = last_that_fits(c, name, told)
    fits = getattr(tuned(c, **{**told, name: value})[1], field)
    assert most * (1 - 1.01 / value) - 1 <= fits <= most
    assert tuned(c, **{**told, name: value + 1})[0] == error


def test_an_integral_gain_of_nothing_is_refused(c):
    """2 pi 10 Hz 1 mohm by 20 kHz, times the quotient of the ranges: from half a step of 2^-17 on it is one."""
    small = {"current_bw_hz": 10, "resistance_mohm": 1, "v_range_mv": 60000}
    half = 0.5 / 2**17 * 20000 / (2 * math.pi * 10 * 1e-3) * 60000
    assert tuned(c, **small, i_range_ma=round(half * 1.001))[1].ki_q17 == 1
    assert tuned(c, **small, i_range_ma=round(half * 2.999))[1].ki_q17 == 1
    assert tuned(c, **small, i_range_ma=round(half * 0.999))[0] == "ERROR_CURRENT_INTEGRAL_GAIN"


def test_what_is_not_refused_ends_at_its_formats_end(c):
    """Half of what makes the largest number is half of it; twice as much is no more."""
    def apparent(uh):
        return tuned(c, lq_apparent_uh=uh)[1].x_q_apparent_q11

    def grows(rated_ma):
        return tuned(c, lq_uh=20, lq_rest_uh=40, i_rated_ma=rated_ma)[1].iron_grows_q10

    def ripple(v_range_mv):
        return tuned(c, ld_uh=3, lq_uh=6, v_range_mv=v_range_mv, v_max_mv=50000)[1].ripple_q10
    uh = 131071 * 60000 / 20000 / 2048 / (2 * math.pi * 1250) * 1e6
    assert apparent(round(uh / 2)) == pytest.approx(131071 / 2, rel=1e-3)
    assert apparent(round(uh * 0.999)) == pytest.approx(131071 * 0.999, rel=1e-3)
    assert apparent(round(uh * 2)) == apparent(1000000) == 131071
    assert grows(20000) == 2**10 // 2 and grows(2000) == pytest.approx(51200, rel=0.01)
    assert grows(1700) == grows(100) == 65535
    v = 32767 / 1024 * 6.92820323 * 20000 * 3e-6 * 20000
    assert ripple(round(v / 2)) == pytest.approx(32767 / 2, rel=1e-3)
    assert ripple(round(v * 0.999)) == pytest.approx(32767 * 0.999, rel=1e-3)
    assert ripple(round(v * 2)) == 32767


@pytest.mark.parametrize("ld_uh, lq_uh, saliency_q11", ((5000, 3, -65535), (3, 5000, 65535)))
def test_a_saliency_times_any_current_has_32_bits(c, ld_uh, lq_uh, saliency_q11):
    told = {"ld_uh": ld_uh, "lq_uh": lq_uh, "current_bw_hz": 300, "v_range_mv": 20000, "v_max_mv": 15000}
    error, tuning = tuned(c, **told)
    assert error == "ERROR_NONE" and max(tuning.x_d_q11, tuning.x_q_q11) > 65535
    c.tuning_torque(struct(c, {**shipped(), **BASE, **told}), tuning)
    assert tuning.saliency_q11 == saliency_q11
