# SPDX-License-Identifier: MIT
"""The part of identify that turns the motor: its arithmetic against exact rationals and a motor that is made up."""
import ctypes
import math
import random
import statistics
from fractions import Fraction

import pytest

from rigs.identify_alone import (I_RANGE_MA, ONE, RATED_MA, V_RANGE_MV, amps, begin, fill, known, measuring, reason, result_of,
                                 rpm_q9, thought, volts)

PAIRS, COUNTS, FLUX_WB, J_KGM2 = 8, 8192, 2.85e-3, 77e-6
R_OHM, LQ_H = 0.35, 143e-6
BLOCK_MS, BLOCKS = 40, 8


@pytest.fixture
def begun(c):
    """Identify as it stands after the standstill part, on the 24 V inverter."""
    d = begin(c)
    for name, value in (("RESISTANCE", R_OHM * 1e6), ("DEAD_TIME", 10450), ("LD", LQ_H * 1e9), ("LQ", LQ_H * 1e9)):
        result = result_of(c, d, name)
        result.state, result.value, result.interval = c.IDENTIFY_KNOWN, round(value), 1
    d.bus_nv = round(13670 / ONE * V_RANGE_MV * 1e6)
    return d


@pytest.fixture
def motor(begun):
    """Its pole pairs and counts are known, too."""
    begun.params.pole_pairs, begun.params.encoder_counts = PAIRS, COUNTS
    begun.params.lq_uh, begun.flux_e1_uwb, begun.indexed = round(LQ_H * 1e6), round(FLUX_WB * 1e7), True
    begun.tuning.encoder_scale_q32 = PAIRS * 2**32 // COUNTS
    return begun


# ---- numbers ----

STUDENT = {2: 12.706, 4: 3.182, 6: 2.571, 8: 2.365, 16: 2.131}


@pytest.mark.parametrize("n", STUDENT)
def test_spread_is_the_standard_deviation_of_the_mean_and_students(c, n):
    values = [10**6 + 1000 * (k * k % 7) - 333 * k for k in range(n)]
    spread = c.identify_spread((ctypes.c_int64 * n)(*values), n)
    assert spread.mean == math.floor(Fraction(sum(values), n) + Fraction(1, 2))
    assert spread.deviation == pytest.approx(statistics.stdev(values) / math.sqrt(n) * STUDENT[n] / 2, rel=5e-3)


def least_squares(xs, ys):
    n = len(xs)
    mx, my = Fraction(sum(xs), n), Fraction(sum(ys), n)
    return sum((x - mx) * (y - my) for x, y in zip(xs, ys)) / sum((x - mx)**2 for x in xs)


@pytest.mark.parametrize("n", [8, 100, 3000])
@pytest.mark.parametrize("slope", [3, -7000, 12345])
def test_slope_of_speed_is_the_least_squares_one(c, n, slope):
    xs = [slope * t + (t * 7919) % 5000 for t in range(n)]
    run = fill(c.measure_run(), [(0, 0, x) for x in xs])
    exact = least_squares(range(n), xs) / 512 * Fraction(2 * math.pi) / 60 * 10**6
    assert c.identify_slope_mrad_s2(run) == pytest.approx(float(exact), rel=1e-6, abs=1)
    run.count = 5
    assert c.identify_slope_mrad_s2(run) == 0, "too few to tell"


def test_flux_of_runs_is_the_slope_of_voltage_with_an_intercept_for_each(c, motor):
    runs = []
    for sign in (1, -1):
        samples = [(0, volts(FLUX_WB * PAIRS * w + sign * 0.7), rpm_q9(w)) for w in range(-100, 100)]
        runs.append(fill(c.measure_run(), samples))
    pointers = (ctypes.POINTER(c.measure_run) * 2)(*map(ctypes.pointer, runs))
    assert c.identify_flux_of_runs(motor, pointers, 2) / 1e7 == pytest.approx(FLUX_WB, rel=1e-4)


# ---- the field's turn ----

def turned(c, d, forth, back, end, offset_deg=0.0, lag_deg=8.0, even=True):
    """A turn of the field by so many counts each way. The rotor stands at 0 degrees less the offset where the count is 0."""
    m = d.work.turn
    m.travel_counts[0], m.travel_counts[1], m.uneven, d.counts = forth, back, not even, end
    for k, sign in ((0, 1), (1, -1)):
        counts = 100 + 50 * k
        angle = counts * 360 / abs(forth) * (1 if forth > 0 else -1) + offset_deg
        m.mean_counts_q8[k] = counts * 256
        m.field_q32[k] = round((angle + sign * lag_deg) / 360 * 2**32) % 2**32
    return thought(c, d, "TURN")


@pytest.mark.parametrize("per_turn", [Fraction(8192, 21), Fraction(3200, 15), Fraction(2048), Fraction(16384, 11),
                                      Fraction(65536)])
def test_the_machine_that_stands_in_has_the_ratio_that_was_measured(c, begun, per_turn):
    turned(c, begun, round(per_turn), -round(per_turn), 0)
    p = begun.params
    assert p.encoder_counts <= 65536 and 1 <= p.pole_pairs <= 50 and begun.retuned
    assert p.encoder_counts / p.pole_pairs == pytest.approx(round(per_turn), rel=2e-5)
    assert p.overspeed_rpm * p.pole_pairs <= 60 * 1250 * 0.95 and p.speed_max_rpm < p.overspeed_rpm


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("offset_deg", [0.0, 77.0, -130.0])
def test_the_rotors_angle_is_free_of_friction(c, begun, sign, offset_deg):
    turned(c, begun, sign * 1000, -sign * 1000, 250, offset_deg)
    assert begun.backwards == (sign < 0) and known(c, begun, "DIRECTION") == (sign, 0)
    away = begun.start_q32 / 2**32 * 360 - (sign * 90 + offset_deg)
    assert abs((away + 180) % 360 - 180) < 0.2


@pytest.mark.parametrize("off_deg", [0, 60, -75, 120, 180, 250])
def test_reluctance_leaves_the_axis_and_the_field_tells_its_end(c, begun, off_deg):
    begun.reluctant, begun.axis_q32, begun.axis_counts = True, round(off_deg % 360 / 360 * 2**32), 0
    turned(c, begun, 1000, -1000, 0, 0.0)
    found = begun.start_q32 / 2**32 * 360
    expected = off_deg if abs((off_deg + 180) % 360 - 180) < 90 else off_deg + 180
    assert abs((found - expected + 180) % 360 - 180) < 0.2


@pytest.mark.parametrize("forth, back, even", [(0, 0, True), (1000, 1000, True), (1000, -700, True), (1, -1, True),
                                               (1000, -1000, False)])
def test_what_does_not_follow_is_refused(c, begun, forth, back, even):
    m = begun.work.turn
    m.travel_counts[0], m.travel_counts[1], m.uneven = forth, back, not even
    thought(c, begun, "TURN")
    assert reason(c, begun, "DIRECTION") == reason(c, begun, "INERTIA") == c.IDENTIFY_NOT_FOLLOWED
    assert begun.step == c.IDENTIFY_STEP_DONE and known(c, begun, "LD")


@pytest.mark.parametrize("swing, again, follows", ((0.0, False, True), (0.5, True, True), (5.0, True, False)))
def test_a_rotor_that_swings_on_the_field_is_led_more_slowly(c, begun, swing, again, follows):
    """It swings by a share of a radian in 1.4 s about the field, by less the more slowly that turns, or whatever is done."""
    io, field, before, ms = measuring(c, begun, "TURN"), 0, None, 0
    c.current_loop_init(io.loop)
    for ms in range(1, 20000):
        if c.identify_measure(begun, io):
            break
        now = begun.work.turn.field.field_q32
        field += 0 if before is None else (now - before + 2**31) % 2**32 - 2**31
        before = now
        slower = 3 if begun.work.turn.slowly and follows else 1
        begun.counts = round(4000 * (field / 2**32 + swing / slower**2 * math.sin(ms / 1400 * math.tau) / math.tau))
    turn = begun.work.turn
    assert turn.slowly == again and turn.uneven != follows
    assert ms == pytest.approx(450 + 2 * 1400 * (4 if again else 1), abs=20)
    assert not follows or [way / 4000 for way in turn.travel_counts] == pytest.approx([1, -1], abs=0.03)


@pytest.mark.parametrize("reluctant, lq_uh", ((False, 10000), (True, 4660)))
def test_loops_know_all_of_an_inductance_unless_it_falls_with_the_current(c, begun, reluctant, lq_uh):
    begun.reluctant, result_of(c, begun, "LQ").value = reluctant, 10_000_000
    turned(c, begun, 1000, -1000, 0)
    assert begun.params.lq_uh == pytest.approx(lq_uh, rel=1e-3)


# ---- from index to index ----

def indexed(c, d, pole_pairs, counts, per_turn=None, seen=2):
    turned(c, d, per_turn or round(counts / pole_pairs), -(per_turn or round(counts / pole_pairs)), 0)
    d.flux_e1_uwb, d.params.flux_uwb, d.params.inertia_gmm2, d.rpm_max = 28500, 2850, 10**5, 30
    d.work.index.seen, d.work.index.first, d.work.index.second = seen, 123, 123 + counts
    return thought(c, d, "INDEX")


@pytest.mark.parametrize("pole_pairs, counts", [(4, 4000), (8, 8192), (21, 8192), (15, 3200), (1, 2048), (11, 16384),
                                                (50, 10000)])
@pytest.mark.parametrize("off", [-1, 0, 1])
def test_pole_pairs_and_counts_are_exact(c, begun, pole_pairs, counts, off):
    begun.nominal.speed_max_rpm, begun.nominal.overspeed_rpm = 400, 480
    indexed(c, begun, pole_pairs, counts + off, round(counts / pole_pairs))
    assert known(c, begun, "POLE_PAIRS") == (pole_pairs, 0) and known(c, begun, "COUNTS") == (counts, 0)
    p = begun.params
    assert (p.pole_pairs, p.encoder_counts, p.overspeed_rpm) == (pole_pairs, counts, 480)
    assert begun.rpm_max <= 100, "a quarter of the largest speed"


def test_inertia_goes_along_with_the_pole_pairs(c, begun):
    turned(c, begun, 1000, -1000, 0)
    pairs = begun.params.pole_pairs
    begun.params.inertia_gmm2, begun.rpm_max, begun.flux_e1_uwb, begun.params.flux_uwb = 10**6, 30, 28500, 2850
    begun.work.index.seen, begun.work.index.first, begun.work.index.second = 2, 0, 4000
    thought(c, begun, "INDEX")
    assert begun.params.inertia_gmm2 == pytest.approx(10**6 * 16 / pairs**2, rel=1e-4)


@pytest.mark.parametrize("how", [dict(seen=1), dict(per_turn=1100), dict(per_turn=890)])
def test_without_an_index_or_a_whole_number_nothing_is_told_apart(c, begun, how):
    indexed(c, begun, 4, 4000, **how)
    for name in ("POLE_PAIRS", "COUNTS", "OFFSET", "INERTIA", "COULOMB", "VISCOUS"):
        assert reason(c, begun, name) == c.IDENTIFY_NO_INDEX
    assert begun.step == c.IDENTIFY_STEP_RAMPS and not begun.indexed, "flux needs neither"


# ---- ramps ----

def friction_nm(w, coulomb, viscous, load):
    return math.copysign(coulomb, w) + viscous * w + load


NO_FRICTION = dict(coulomb=0.0, viscous=0.0, load=0.0)


def ramp(c, d, friction, i_a=1.2, most=100.0, swing=0.0, noise_v=0.0):
    """All ramps of a motor that is made up, a millisecond each sample. swing: the speed's, rad/s, in 60 ms."""
    w, kt, rng = 0.0, 1.5 * PAIRS * FLUX_WB, random.Random(1)
    d.phase, d.ramp_i_q15 = 5, amps(i_a)
    for k in range(5):
        sign, slows, gains = (1 if k % 2 == 0 else -1), [], []
        for ms in range(4000):
            w += (kt * sign * i_a - friction_nm(w, **friction)) / J_KGM2 * 1e-3
            seen = w + swing * math.sin(ms / 60 * math.tau)
            v = FLUX_WB * PAIRS * w + R_OHM * sign * i_a + rng.gauss(0, noise_v)
            sample = (amps(sign * i_a), volts(v), rpm_q9(seen))
            x = sign * w / most
            (gains if 0.3 < x < 0.9 else slows if -0.9 < x < -0.3 else []).append(sample)
            if x >= 1:
                break
        fill(d.work.ramps.slows[k], slows)
        fill(d.work.ramps.gains[k], gains)
    return thought(c, d, "RAMPS")


@pytest.mark.parametrize("friction", [NO_FRICTION, dict(coulomb=8e-3, viscous=5e-5, load=0.0),
                                      dict(coulomb=2e-3, viscous=0.0, load=6e-3)])
def test_inertia_does_not_depend_on_friction_nor_load(c, motor, friction):
    ramp(c, motor, friction)
    inertia, interval = known(c, motor, "INERTIA")
    assert inertia == pytest.approx(J_KGM2 * 1e9, rel=5e-3)
    assert 0.01 * inertia < interval < 0.05 * inertia
    flux, interval = known(c, motor, "FLUX")
    assert flux == pytest.approx(FLUX_WB * 1e7, rel=1e-3) and interval > 0.007 * flux


def test_one_current_and_both_signs_of_the_speed_tell_the_flux_despite_noise(c, motor):
    """Of 0.2 V; told from each sign alone it would scatter by more than a tenth."""
    ramp(c, motor, NO_FRICTION, noise_v=0.2)
    flux, interval = known(c, motor, "FLUX")
    assert abs(flux / 1e7 - FLUX_WB) * 1e7 < interval < 0.1 * flux


def test_a_frame_that_is_off_and_saliency_are_in_the_interval_of_the_flux(c, motor):
    result_of(c, motor, "LQ").value *= 2
    ramp(c, motor, NO_FRICTION)
    gain, iron, salient = 0.007 * FLUX_WB, 0.05 * (1.2 / RATED_MA * 1000)**2 * FLUX_WB, LQ_H * 1.2 * 0.06
    assert known(c, motor, "FLUX")[1] / 1e7 == pytest.approx(2 * math.hypot(gain, iron + salient) / math.sqrt(3), rel=0.02)


def test_a_rotor_that_is_too_light_for_its_ramps_has_no_inertia(c, motor):
    ramp(c, motor, NO_FRICTION, most=4.0)
    assert reason(c, motor, "INERTIA") == c.IDENTIFY_TOO_LIGHT and known(c, motor, "FLUX")


@pytest.mark.parametrize("swing, is_known", ((2.0, True), (6.0, True), (12.0, False)))
def test_a_speed_that_swings_as_it_grows_makes_inertia_uncertain(c, motor, swing, is_known):
    ramp(c, motor, NO_FRICTION, swing=swing)
    if is_known:
        inertia, interval = known(c, motor, "INERTIA")
        assert abs(inertia - J_KGM2 * 1e9) < interval < 0.5 * inertia
    else:
        assert reason(c, motor, "INERTIA") == c.IDENTIFY_SWINGS


def test_ramps_that_were_not_reached_are_refused(c, motor):
    motor.phase = 3
    thought(c, motor, "RAMPS")
    assert reason(c, motor, "FLUX") == reason(c, motor, "INERTIA") == c.IDENTIFY_LOADED


# ---- constant speeds ----

def speeds(c, d, coulomb, viscous, load=0.0, ahead_deg=0.0, fast=105.0, along_a=1.5):
    """Slow and fast, forward and back; along the magnets current flows one way in the first four blocks."""
    m, kt = d.work.speeds, 1.5 * PAIRS * FLUX_WB
    d.phase, m.index_seen, m.index, m.offset_q32 = 4, True, 1000, round((40 + ahead_deg) % 360 / 360 * 2**32)
    d.results[c.IDENTIFY_FLUX].interval = 200
    for k, w in enumerate((fast / 3, fast, -fast, -fast / 3)):
        p = m.points[k]
        i_a = friction_nm(w, coulomb, viscous, load) / kt
        for block in range(BLOCKS):
            p.i_q[block] = BLOCK_MS * amps(i_a) + round(((i_a / (I_RANGE_MA / 1000) * ONE) - amps(i_a)) * BLOCK_MS)
        # what i_d takes of v_d cancels over the blocks but for what dead time leaves: a constant
        v_d = w * PAIRS * FLUX_WB * math.sin(math.radians(ahead_deg)) - w * PAIRS * LQ_H * i_a + 0.03
        p.v_d = round(v_d / (V_RANGE_MV / 1000) * ONE * BLOCK_MS * BLOCKS)
        p.v_q = volts(w * PAIRS * FLUX_WB) * BLOCK_MS * BLOCKS
        p.x = round(w * 60 / (2 * math.pi) * ONE) * BLOCK_MS * BLOCKS
    return thought(c, d, "SPEEDS")


@pytest.mark.parametrize("coulomb, viscous", [(20e-3, 2e-4), (10e-3, 1.5e-4)])
def test_friction_is_a_straight_line_over_speed(c, motor, coulomb, viscous):
    speeds(c, motor, coulomb, viscous)
    value, interval = known(c, motor, "COULOMB")
    assert value == pytest.approx(coulomb * 1e6, rel=0.01) and 0.01 * value < interval < 0.2 * value
    value, interval = known(c, motor, "VISCOUS")
    assert value == pytest.approx(viscous * 1e9, rel=0.02) and interval < 0.5 * value


def test_friction_that_the_sensors_hardly_see_is_refused(c, motor):
    speeds(c, motor, 1e-4, 1e-7)
    assert reason(c, motor, "COULOMB") == reason(c, motor, "VISCOUS") == c.IDENTIFY_UNRESOLVED


@pytest.mark.parametrize("ahead_deg", [-30.0, -2.0, 0.0, 0.7, 20.0])
@pytest.mark.parametrize("load", [0.0, 5e-3])
def test_the_offset_is_free_of_load_and_dead_time(c, motor, ahead_deg, load):
    speeds(c, motor, 4e-3, 1e-5, load=load, ahead_deg=ahead_deg)
    value, interval = known(c, motor, "OFFSET")
    sine = math.degrees(math.sin(math.radians(ahead_deg)))
    expected = 40 + ahead_deg - sine + 1000 * 360 * PAIRS / COUNTS
    assert abs((value / 100 - expected + 180) % 360 - 180) < 0.15 and 50 < interval < 300


def test_a_load_is_named_and_nothing_guessed(c, motor):
    motor.results[c.IDENTIFY_INERTIA].state = motor.results[c.IDENTIFY_FLUX].state = c.IDENTIFY_KNOWN
    speeds(c, motor, 4e-3, 1e-5, load=60e-3)
    for name in ("COULOMB", "VISCOUS", "INERTIA"):
        assert reason(c, motor, name) == c.IDENTIFY_LOADED
    assert known(c, motor, "FLUX")


def test_speeds_that_were_not_reached_are_refused(c, motor):
    motor.phase = 2
    thought(c, motor, "SPEEDS")
    assert reason(c, motor, "OFFSET") == reason(c, motor, "COULOMB") == c.IDENTIFY_LOADED


# ---- the frame ----

@pytest.mark.parametrize("w_sign", [1, -1])
@pytest.mark.parametrize("ahead_deg", [-150, -40, -3, 3, 60, 120])
def test_the_frame_is_led_to_where_all_that_is_induced_is_in_q(c, motor, w_sign, ahead_deg):
    io, loop, tuning = c.measure_io(), c.current_loop(), c.tuning()
    io.loop, io.tuning = ctypes.pointer(loop), ctypes.pointer(tuning)
    loop.vbus_q15, loop.w_shift, loop.pll.speed_q32 = 13670, 13, w_sign * 10**8
    ahead, emf = float(ahead_deg), 2000
    for _ in range(800):
        loop.v_d_q15 = round(w_sign * emf * math.sin(math.radians(ahead)))
        loop.v_q_q15 = round(w_sign * emf * math.cos(math.radians(ahead)))
        before = loop.angle_offset_q32
        c.identify_correct_offset(motor, io)
        ahead += ctypes.c_int32(loop.angle_offset_q32 - before).value / 2**32 * 360
    assert abs(ahead) < 0.2
    loop.v_d_q15, loop.v_q_q15, before = 50, 100, loop.angle_offset_q32
    c.identify_correct_offset(motor, io)
    assert loop.angle_offset_q32 == before, "too little to tell"


# ---- a load at rest; parameters; no encoder ----

def test_a_rotor_that_is_driven_while_the_field_stands_is_named(c, begun):
    begun.work.resistance.led, begun.work.resistance.drifted = 800, -500
    thought(c, begun, "RESISTANCE")
    assert reason(c, begun, "FLUX") == c.IDENTIFY_LOADED and begun.step == c.IDENTIFY_STEP_DONE


def test_without_an_encoder_all_that_turns_is_refused(c, begun):
    begun.nominal.angle_source = 1
    thought(c, begun, "INDUCTANCE")
    assert begun.step == c.IDENTIFY_STEP_DONE
    for name in ("POLE_PAIRS", "COUNTS", "DIRECTION", "OFFSET", "FLUX", "INERTIA", "COULOMB", "VISCOUS"):
        assert reason(c, begun, name) == c.IDENTIFY_NO_ENCODER


def test_what_turning_has_found_becomes_parameters(c, begun):
    p = c.params()
    c.params_init(p)
    for name, value in (("POLE_PAIRS", 8), ("COUNTS", 8192), ("FLUX", 28356), ("INERTIA", 77007), ("COULOMB", 4101)):
        begun.results[getattr(c, f"IDENTIFY_{name}")].state = c.IDENTIFY_KNOWN
        begun.results[getattr(c, f"IDENTIFY_{name}")].value = value
    assert c.identify_use(begun, p) == 8
    assert (p.pole_pairs, p.encoder_counts, p.flux_uwb, p.inertia_gmm2, p.friction_unm) == (8, 8192, 2836, 77007, 4101)
