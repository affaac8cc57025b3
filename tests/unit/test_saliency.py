# SPDX-License-Identifier: MIT
"""The magnets' axis from alternating voltages, on windings of two inductances; which motors are started that way."""
import cmath
import math

import pytest

from rigs.aligning import MOTORS, TURN, params_of

V_Q15, I_Q15, VBUS_Q15 = 2000, 1500, 16384


def measured(c, axis_deg, ratio=3.0, bias=0j, encoder_deg=0.0, emf=0j):
    """The offset found in degrees; currents in Q15. `bias` flows at the start, `emf` drives it (per millisecond)."""
    s, loop = c.saliency(), c.current_loop()
    loop.vbus_q15 = VBUS_Q15
    axis, current, volts = math.radians(axis_deg), bias, 0j
    c.saliency_start(s, V_Q15, I_Q15)
    for _ in range(200):
        seen = current * cmath.exp(-2j * math.pi * loop.field_angle_q32 / TURN)
        loop.i_d_q15, loop.i_q_q15 = round(seen.real), round(seen.imag)
        if c.saliency_step(s, loop, round(encoder_deg / 360 * TURN) % TURN):
            return s, (c.saliency_offset_q32(s) * 360 / TURN)
        frame = cmath.exp(2j * math.pi * loop.field_angle_q32 / TURN)
        volts = complex(loop.integral_d_q9, loop.integral_q_q9) * frame
        along = volts * cmath.exp(-1j * axis)
        full = STEP_PER_V * V_Q15
        current += complex(along.real, along.imag / ratio) / full * I_Q15 * cmath.exp(1j * axis) + emf
    raise AssertionError("it never ends")


def steps_per_v(c):
    """What the loop's integral is for one LSB of voltage."""
    s, loop = c.saliency(), c.current_loop()
    loop.vbus_q15 = VBUS_Q15
    c.saliency_start(s, V_Q15, I_Q15)
    c.saliency_step(s, loop, 0)
    c.saliency_step(s, loop, 0)
    return -loop.integral_d_q9 / V_Q15


@pytest.fixture(autouse=True)
def scaled(c):
    global STEP_PER_V
    STEP_PER_V = steps_per_v(c)


def off(found_deg, axis_deg):
    return (found_deg - axis_deg + 90) % 180 - 90


@pytest.mark.parametrize("ratio", [1.5, 3, 6])
def test_the_axis_is_found_wherever_it_is(c, ratio):
    for axis_deg in range(0, 360, 7):
        for encoder_deg in (0, 77, 200):
            s, found = measured(c, axis_deg, ratio, encoder_deg=encoder_deg)
            assert abs(off(found, axis_deg - encoder_deg)) < 0.4 and c.saliency_seen(s), (axis_deg, encoder_deg, found)


def test_a_standing_current_and_a_rocking_rotor_do_not_matter(c):
    for axis_deg in (5, 60, 140):
        for disturbance in (dict(bias=900 + 300j), dict(emf=12 - 20j), dict(bias=-700j, emf=15)):
            _, found = measured(c, axis_deg, **disturbance)
            assert abs(off(found, axis_deg)) < 0.5, (axis_deg, disturbance, found)


def test_a_round_rotor_has_no_axis(c):
    s, _ = measured(c, 30, 1.05)
    assert not c.saliency_seen(s)


def test_who_is_started_that_way(c):
    """A motor of 134 mWb whose apparent inductances are 18 mH apart, 33 A; and none of the ordinary ones."""
    tuning = c.tuning()
    for name in MOTORS:
        c.tuning_compute(params_of(c, name), tuning)
        assert not tuning.reluctant, name
    told = dict(ld_uh=4730, lq_uh=5370, ld_apparent_uh=2600, lq_apparent_uh=20500, flux_uwb=133700, inertia_gmm2=14798000,
                i_max_ma=33000, i_trip_ma=45600, i_range_ma=50000, i_align_ma=2200, pole_pairs=2, encoder_counts=8192,
                resistance_mohm=200)
    params = params_of(c, "abb", **{key: told[key] for key in told if key not in ("ld_apparent_uh", "lq_apparent_uh")})
    params.ld_apparent_uh, params.lq_apparent_uh = told["ld_apparent_uh"], told["lq_apparent_uh"]
    c.tuning_compute(params, tuning)
    assert tuning.reluctant and tuning.align_levels == 2
    assert tuning.align[0].i_q15 == pytest.approx(32768 * 3 * 0.1337 / 0.0179 / 50, rel=0.01)
    assert 90 < tuning.align[0].period_ms < 140, "129 ms by the finite-element map"


LOT = dict(pole_pairs=2, encoder_counts=512, resistance_mohm=41, ld_uh=1032, lq_uh=1752, flux_uwb=87590, inertia_gmm2=2139000,
           i_align_ma=42700, i_max_ma=91500, i_trip_ma=128000, i_range_ma=150000, v_range_mv=240000,
           v_min_mv=90000, v_max_mv=210000)


def tuned(c, **told):
    """Of a machine whose magnets hold the rotor up to 51 A only: 1720 uH between both axes without current."""
    told = {**LOT, **told}
    params = params_of(c, "abb", **told)
    for name in ("ld_apparent_uh", "lq_apparent_uh", "lq_rest_uh"):
        setattr(params, name, told.get(name, 0))
    tuning = c.tuning()
    c.tuning_compute(params, tuning)
    return tuning


def test_the_pull_goes_by_the_iron_without_current_whatever_else_is_told(c):
    """i_align_ma and the saturated lq_uh would have turned the magnets away."""
    saturated = dict(ld_apparent_uh=1090, lq_apparent_uh=2423)
    for lq_uh in (1752, 1100):
        tuning = tuned(c, lq_rest_uh=2752, lq_uh=lq_uh, **saturated)
        assert tuning.shows_axis and not tuning.reluctant and tuning.align_levels == 1
        assert tuning.align[0].i_q15 == pytest.approx(32768 * 0.5 * 87.59 / 1.72 / 150, rel=0.01)


def test_the_axis_is_left_out_where_it_tells_little(c):
    assert not tuned(c, lq_rest_uh=2752, encoder_counts=64).shows_axis, "a count is 11 degrees"
    assert not tuned(c, lq_uh=1300, ld_uh=1032).shows_axis, "hardly any saliency"
    assert not tuned(c, lq_rest_uh=2752, flux_uwb=900000).shows_axis, "so much magnet that two currents tell the load"
    by_load = tuned(c, lq_rest_uh=2752, encoder_counts=64)
    assert by_load.align[0].i_q15 == pytest.approx(32768 * 0.333 * 87.59 / 1.72 / 150, rel=0.01) and by_load.saliency_v_q15 == 0


def test_saliency_takes_a_standing_current_away_once_an_angle(c):
    """What is read at its first millisecond decides the steady voltage of the whole pattern; later readings are responses."""
    s, loop = c.saliency(), c.current_loop()
    loop.vbus_q15 = VBUS_Q15
    c.saliency_start(s, V_Q15, I_Q15)
    for n in range(18):
        loop.i_d_q15, loop.i_q_q15 = (300, -150) if n % 6 == 0 else (-900 - n, 700 + n)
        before = (s.steady_d_q15, s.steady_q_q15)
        assert not c.saliency_step(s, loop, 0)
        if n % 6 != 0:
            assert (s.steady_d_q15, s.steady_q_q15) == before
            continue
        turned = complex(300, -150) * cmath.exp(-1j * math.pi / 16 * (n > 0))  # the field's step since it was read
        assert s.steady_d_q15 == pytest.approx(-turned.real * V_Q15 / 6 / I_Q15, abs=2)
        assert s.steady_q_q15 == pytest.approx(-turned.imag * V_Q15 / 6 / I_Q15, abs=2)


def test_saliency_at_its_end_holds_no_voltage(c):
    s, loop = c.saliency(), c.current_loop()
    c.saliency_start(s, V_Q15, 0)
    assert s.i_q15 == 1, "nothing is divided by nothing"
    s.angle, loop.integral_d_q9, loop.integral_q_q9 = 16, 5, 6
    assert c.saliency_step(s, loop, 0) and (loop.integral_d_q9, loop.integral_q_q9) == (0, 0)
