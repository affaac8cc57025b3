# SPDX-License-Identifier: MIT
"""Where the numbers of position loop and profile end: a unit of 2^-shift counts, no speed of nothing, none beyond 32 bits."""
import pytest

from rigs.motor_numbers import shipped, struct


def tuned(c, **told):
    params, tuning = struct(c, {**shipped(), **told}), c.tuning()
    tuning.i_max_q15 = 20000
    c.tuning_position(params, tuning)
    return tuning


@pytest.mark.parametrize("speed_max_rpm, counts, shift", [
    (30000, 65536, 7), (4000, 4000, 13), (1875, 64, 21), (1876, 64, 20), (1874, 64, 21), (234, 64, 24), (235, 64, 23),
    (1, 64, 24)])
def test_a_unit_is_as_small_as_the_largest_speed_allows(c, speed_max_rpm, counts, shift):
    """A millisecond at it is 2^22 units at most; and no unit is smaller than 2^-24."""
    assert tuned(c, speed_max_rpm=speed_max_rpm, encoder_counts=counts).profile.shift == shift
    assert speed_max_rpm * counts << shift <= 2**22 * 60000
    assert shift == 24 or speed_max_rpm * counts << (shift + 1) > 2**22 * 60000


def test_no_speed_and_no_ramp_is_nothing(c):
    """A thousandth of 1 rpm, reached by 1 rpm/s: less than a unit would be none."""
    slow = tuned(c, speed_max_rpm=30000, encoder_counts=64, profile_speed_pm=1, profile_rpm_s=1).profile
    assert slow.v_max == round(30 * 64 / 60000 * 2**slow.shift) and slow.a_max == 1
    assert tuned(c, speed_max_rpm=1, encoder_counts=64, profile_speed_pm=0).profile.v_max == 1


def test_what_no_parameter_says_ends_where_32_bits_do(c):
    """The ranges keep them far from there."""
    quick = tuned(c, speed_max_rpm=1, profile_speed_pm=2**31 - 1, profile_rpm_s=2**31 - 1).profile
    assert (quick.v_max, quick.a_max) == (2**31 - 1, 2**31 - 1)


def test_the_ramp_is_the_speeds_where_none_is_told_and_no_steeper_than_to_the_whole_speed_at_once(c):
    told, own = (tuned(c, ramp_rpm_s=5000, profile_rpm_s=rpm_s).profile for rpm_s in (0, 5000))
    assert told.a_max == own.a_max == round(5000 * 4000 / 60000 / 1000 * 2**own.shift)
    steep = tuned(c, profile_rpm_s=2**31 - 1, profile_speed_pm=500).profile
    assert steep.a_max == steep.v_max == round(4000 * 4000 / 60000 / 2 * 2**steep.shift)


def test_the_rest_of_it(c):
    t = tuned(c, position_bw_hz=7, following_mturn=2500, cyclic_ms=13, home_rpm=-77, learn_rpm=9, home_pct=35,
              profile_jerk_ms=3)
    assert t.following_units == 5 * 4000 * 2**t.profile.shift // 2 and t.cyclic_ms == 13 and t.home_i_q15 == 7000
    assert (t.home_rpm_q16, t.learn_rpm_q16) == (-77 * 65536, 9 * 65536)
    assert (t.profile.window, t.profile.window_q30) == (3, 2**30 // 3) and t.turn_scale_q32 == round(2**32 / 4000)
    assert t.rpm_per_unit_q20 == pytest.approx(60000 / 4000 / 2**t.profile.shift * 65536 * 2**20, rel=1e-6)
    assert t.position_gain_q21 == pytest.approx(2 * t.rpm_per_unit_q20 * 2 * 3.14159265 * 7 / 1000, rel=1e-6, abs=1)
    fifth = tuned(c, position_bw_hz=0, speed_bw_hz=60)
    assert fifth.position_gain_q21 == pytest.approx(2 * fifth.rpm_per_unit_q20 * 2 * 3.14159265 * 12 / 1000, rel=1e-6, abs=1)
