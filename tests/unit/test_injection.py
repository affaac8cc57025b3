# SPDX-License-Identifier: MIT
"""Injection: its C to the bit, and what it and the start by saliency do on a machine of numbers.

The machine (SI units, angles of the magnets) is linear around where it stands: an inverse of incremental inductances with
L_dq, and an L_d that depends on the d current, which is what tells north from south. It stands still.
"""
import random

import numpy as np
import pytest

from rigs.motor_numbers import compute, shipped
from rigs.observer_model import any_of, cos_sin, sat

PWM_HZ, BUS_STEPS = 20000, 40000
THOR, SOFT = "thor_pmsyrm", -0.05  # d current of an ampere takes L_d down by so much
VARIANTS = (0, 1)  # of injection_silent: a tone, drawn pairs
KEPT = ("i_alpha_q15", "i_beta_q15", "step_alpha_q15", "step_beta_q15", "sum_d", "sum_q")


def wrapped(x):
    return ((int(x) + 2**31) & 0xFFFFFFFF) - 2**31


class Played:
    """An injection's interrupt, sample by sample, and what it has played: the oracle knows its signs from outside only."""

    def __init__(self, c, silent=0, turned=0, signs=None):
        self.c, self.loop, self.pulses = c, c.current_loop(), []
        c.injection_reset(self.loop, compute(c, {**shipped(THOR), "angle_source": 1, "injection_silent": silent})[2])
        inject = self.loop.inject
        inject.turned, inject.v_steps = turned, 1234
        inject.signs = inject.signs if signs is None else signs

    def pulse(self):
        """The next one's sign."""
        steps = self.c.host_inject_voltage(self.loop)
        assert abs(steps) == 1234
        self.pulses.append(steps // 1234)
        return self.pulses[-1]

    def times(self):
        """By what the present sample's answer counts: the sign of the pulse that it shows, which is two samples old, or one
        where voltages act at once; in drawn order only where that was a pair's second, and then for both."""
        shown = len(self.pulses) - (2 if self.loop.inject.turned else 3)
        return self.pulses[shown] * (2 * (shown % 2) if self.loop.inject.silent else 1)


def expected(state, times, i_alpha, i_beta, angle_q32, table):
    """The equations of firmware/control/injection.h in the formats of current_loop_step.h."""
    cosine, sine = (int(x[0]) for x in cos_sin(np.array([angle_q32]), table))
    step = i_alpha - state["i_alpha_q15"], i_beta - state["i_beta_q15"]
    alpha, beta = (int(sat(step[n] - state[f"step_{axis}_q15"], 16)) for n, axis in enumerate(("alpha", "beta")))
    y_d = times * ((alpha * cosine + beta * sine + 2**14) >> 15)
    y_q = times * ((beta * cosine - alpha * sine + 2**14) >> 15) + (state["cross_q15"] * y_d >> 15)
    nu = int(sat(int(sat(-y_q, 16)) * state["rad_q8"] >> 8, 16))
    speed = wrapped(state["speed"] - (state["track_speed_q8"] * nu >> 8))
    return {"i_alpha_q15": i_alpha, "i_beta_q15": i_beta, "step_alpha_q15": step[0], "step_beta_q15": step[1],
            "sum_d": wrapped(state["sum_d"] + y_d), "sum_q": wrapped(state["sum_q"] + y_q), "speed": speed,
            "angle": (state["angle"] + speed - state["track"] * nu) & 0xFFFFFFFF}


@pytest.mark.parametrize("turned", (0, -1))
@pytest.mark.parametrize("silent", VARIANTS)
def test_a_step_is_the_equations_to_the_bit(c, table, silent, turned):  # noqa: F811
    """Undefined behaviour is trapped in this build: no product or sum overflows, at the ends of the ranges either."""
    draw, played = random.Random(11), Played(c, silent, turned)
    loop = played.loop
    for _ in range(3):
        played.pulse()
    for n in range(8000):
        if n % 4 == 0:
            state = {"cross_q15": any_of(draw, -8191, 8191),
                     "rad_q8": any_of(draw, 0, 65535), "track": any_of(draw, 0, 4096),
                     "track_speed_q8": any_of(draw, 0, 51480), "angle": draw.getrandbits(32),
                     "speed": any_of(draw, -2**31, 2**31 - 1),
                     **{name: any_of(draw, -65534, 65534) for name in KEPT[:2]},
                     **{name: any_of(draw, -131068, 131068) for name in KEPT[2:4]},
                     **{name: any_of(draw, -2**30, 2**30) for name in KEPT[4:]}}
            for name in ("cross_q15", "rad_q8", *KEPT):
                setattr(loop.inject, name, state[name])
            loop.flux.track, loop.flux.track_speed_q8 = state["track"], state["track_speed_q8"]
            loop.pll.angle_q32, loop.pll.speed_q32 = state["angle"], state["speed"]
        i, angle = [any_of(draw, -46340, 46340) for _ in "ab"], draw.getrandbits(32)
        played.pulse()
        state |= expected(state, played.times(), *i, angle, table)
        c.host_inject_observe(loop, *i, angle)
        got = {name: getattr(loop.inject, name) for name in KEPT} | {"angle": loop.pll.angle_q32, "speed": loop.pll.speed_q32}
        assert got == {name: state[name] for name in got}, n


@pytest.mark.parametrize("turned", (0, -1))
def test_the_controllers_see_what_lies_between_pairs_or_the_mean_of_two(c, turned):
    draw = random.Random(5)
    for silent in VARIANTS:
        played, before = Played(c, silent, turned), [0, 0]
        for _ in range(3):
            played.pulse()
        for _ in range(400):
            i = [draw.randint(-65534, 65534) for _ in "ab"]
            played.pulse()
            seen = [c.host_inject_calm(played.loop, *i, axis) for axis in (0, 1)]
            halves = abs(played.times())
            assert seen == [(halves * now + (2 - halves) * old) // 2 for now, old in zip(i, before)]
            c.host_inject_observe(played.loop, *i, 0)
            before = i


# ---- the order of the pulses ----------------------------------------------------------------------------------------------

PAIRS = 60000


@pytest.fixture(name="drawn", scope="module")
def _drawn(c):
    played = Played(c, silent=1)
    return np.array([played.pulse() for _ in range(2 * PAIRS)])


def test_by_tone_the_voltage_changes_its_sign_each_sample(c):
    played = Played(c)
    assert [played.pulse() for _ in range(6)] == [-1, 1] * 3


def test_pairs_that_take_back_what_they_did_are_drawn_by_a_register_of_31_bits(drawn):
    """So current is at rest after each pair, wherever one looks."""
    assert not (drawn[::2] + drawn[1::2]).any()
    bits = (drawn[::2] > 0).astype(int)  # where one is set its pair begins with the positive pulse
    assert (bits[31:] == bits[:-31] ^ bits[3:-28]).all()


def test_its_period_is_the_longest_that_31_bits_have(c):
    """x^(2^31) is x again modulo the polynomial, so x's order divides 2^31 - 1: a prime. Ones are one more than zeros."""
    polynomial, x = 1 << 31 | 1 << 28 | 1, 2
    assert 0 < Played(c, silent=1).loop.inject.signs < 2**31 and Played(c).loop.inject.signs == 0
    power = x
    for _ in range(31):
        square = sum(1 << 2 * bit for bit in range(31) if power >> bit & 1)
        for bit in range(60, 30, -1):
            square ^= (polynomial << bit - 31) * (square >> bit & 1)
        power = square
    assert power == x


def test_two_axes_draw_each_for_itself(c, drawn):
    one, other, together = Played(c, silent=1), Played(c, silent=1, signs=0x12345), Played(c, silent=1, signs=0x12345)
    for _ in range(3):
        other.pulse()
    for _ in range(500):
        one.pulse()
        for _ in range(3):
            other.pulse()
    alone = [together.pulse() for _ in range(1503)]
    assert one.pulses == drawn[:500].tolist() and other.pulses == alone and other.pulses[:500] != one.pulses


def test_it_goes_on_with_a_whole_pair(c):
    for pulses in (4, 5):
        played = Played(c, silent=1)
        for _ in range(pulses):
            played.pulse()
        signs = played.loop.inject.signs
        c.injection_resume(played.loop)
        assert played.pulse() == -played.pulse() and played.loop.inject.signs != signs


# ---- on a machine --------------------------------------------------------------------------------------------------------

class Bench:
    """An axis in the start by injection, told of a machine whose magnets outweigh its reluctance, that stands at `angle_deg`.
    Told the contrary it pushes a `free` rotor: then `load_rad_s2` drives that, electrical, and friction takes a tenth of what
    i_max does through the magnets."""

    def __init__(self, c, motor, angle_deg, ld_h=None, lq_h=None, cross=0.0, soft=0.0, noise_lsb=0.0, seed=1, free=False,
                 load_rad_s2=0.0, **params):
        self.c, self.p = c, {**shipped(motor), "angle_source": 1, **params}
        problem, _, tuning = compute(c, self.p)
        assert problem == "ERROR_NONE"
        self.axis = c.axis()
        self.loop = self.axis.loop
        c.current_loop_init(self.loop)
        tuning.reluctant = free
        self.axis.tuning = tuning
        c.current_loop_tune(self.loop, tuning)
        self.loop.source, self.loop.status_max = c.LOOP_INJECTION, 1
        self.volt = self.p["v_range_mv"] / 1000 * 0.62 / BUS_STEPS  # of a step
        self.loop.vbus_q15 = round(0.62 * 32768)
        self.loop.kp_d_q9 = self.loop.kp_q_q9 = 300  # some 300 Hz
        self.loop.ki_q15 = 400
        self.ampere = 32768 / (self.p["i_range_ma"] / 1000)
        self.ld_h, self.lq_h = ld_h or self.p["ld_uh"] / 1e6, lq_h or self.p["lq_rest_uh"] / 1e6
        self.cross, self.soft = cross, soft
        self.turn = np.exp(1j * np.radians(angle_deg))
        self.r, self.i, self.u = self.p["resistance_mohm"] / 1000, 0j, [0j, 0j]
        self.delay = 2 - (tuning.delay_halves == 1)  # samples from a voltage to the current that shows it
        self.random, self.noise = np.random.default_rng(seed), noise_lsb
        self.thinks = 0
        self.w, self.free, self.load_rad_s2 = 0.0, free, load_rad_s2
        c.injection_reset(self.loop, tuning)
        c.injection_begin(self.axis)

    def sample(self):
        """The current goes on by the voltage that acts; then the interrupt."""
        in_rotor, u = self.i * self.turn.conjugate(), (self.u[-self.delay] - self.r * self.i) * self.turn.conjugate()
        u -= 1j * self.w * self.p["flux_uwb"] / 1e6
        ld_h = self.ld_h * max(1 + self.soft * in_rotor.real, 0.3)  # where it locks across, a push goes along d
        ldq_h = self.cross * self.lq_h
        det = ld_h * self.lq_h - ldq_h**2
        change = ((self.lq_h * u.real - ldq_h * u.imag) + 1j * (ld_h * u.imag - ldq_h * u.real)) / det
        self.i += change / PWM_HZ * self.turn
        if self.free:
            self.swing(in_rotor)
        seen = self.i * self.ampere + self.noise * complex(*self.random.standard_normal(2))
        self.c.host_inject_sample(self.loop, round(seen.real), round(seen.imag))
        self.u = [self.u[-1], (self.loop.flux.v_alpha_steps + 1j * self.loop.flux.v_beta_steps) * self.volt]

    def swing(self, i):
        """One sample of the free rotor's motion."""
        flux, pairs = self.p["flux_uwb"] / 1e6, self.p["pole_pairs"]
        per_nm = pairs / (self.p["inertia_gmm2"] * 1e-9)
        most = 0.15 * pairs * flux * self.p["i_max_ma"] / 1000 * per_nm
        driven = 1.5 * pairs * (flux + (self.ld_h - self.lq_h) * i.real) * i.imag * per_nm + self.load_rad_s2
        held = self.w + driven / PWM_HZ
        self.w = np.sign(held) * max(abs(held) - most / PWM_HZ, 0)
        self.turn *= np.exp(1j * self.w / PWM_HZ)

    def milliseconds(self, count=1):
        for _ in range(count):
            for _ in range(20):
                self.sample()
            self.c.injection_follow(self.loop, self.axis.tuning)

    def start(self):
        for _ in range(8000):
            self.milliseconds()
            result = self.c.injection_start_step(self.axis)
            if result != self.c.INJECTION_RUNNING:
                return result
        raise AssertionError("the start does not end")

    def error_deg(self, count=40):
        """Believed less true, mean of some milliseconds."""
        seen = []
        for _ in range(count):
            self.milliseconds()
            seen.append(np.exp(2j * np.pi * self.loop.pll.angle_q32 / 2**32) / self.turn)
        return float(np.degrees(np.angle(np.mean(seen))))

    def lsb_per_degree(self):
        """What theory has of the response: 4 U T Y1, Y1 = (1 / Ld - 1 / Lq) / 2."""
        u = self.p["injection_mv"] / 1000
        return 2 * u / PWM_HZ * (1 / self.ld_h - 1 / self.lq_h) * self.ampere / np.degrees(1)


@pytest.mark.parametrize("silent", VARIANTS)
@pytest.mark.parametrize("angle", (0, 40, 85, 90, 95, 130, 175, 180, 220, 265, 310, 355))
def test_it_locks_within_a_degree_from_every_side_and_finds_north(c, angle, silent):
    bench = Bench(c, THOR, angle, soft=SOFT, noise_lsb=16, injection_silent=silent)
    assert bench.start() == c.INJECTION_DONE
    assert abs(bench.error_deg()) < 1


@pytest.mark.parametrize("update, loses, silent", ((0, False, 0), (2, False, 0), (0, True, 0), (0, False, 1), (2, False, 1)))
def test_the_sign_is_that_of_the_voltage_that_the_sample_shows(c, update, loses, silent):
    bench = Bench(c, THOR, 70, soft=SOFT, pwm_update=update, injection_silent=silent)
    bench.loop.inject.turned ^= -int(loses)
    bench.start()
    off = (bench.error_deg() + 90) % 180 - 90
    assert abs(off) > 80 if loses else abs(off) < 1, "with the wrong sign it locks across"


def test_with_both_ends_it_is_refused(c):
    assert compute(c, {**shipped(THOR), "angle_source": 1, "pwm_update": 1})[0] == "ERROR_INJECTION_UPDATE"


def test_without_a_voltage_a_reluctant_motor_is_refused(c):
    assert compute(c, {**shipped(THOR), "angle_source": 1, "injection_mv": 0})[0] == "ERROR_SENSORLESS_RELUCTANT"


@pytest.mark.parametrize("silent", VARIANTS)
def test_what_it_says_of_a_degree_is_what_theory_has(c, silent):
    for scale in (1, 2):
        bench = Bench(c, THOR, 20, soft=SOFT, injection_mv=30000 * scale, injection_silent=silent)
        bench.start()
        assert bench.axis.injection.detail_q8 / 256 == pytest.approx(bench.lsb_per_degree(), rel=0.05)


def pole_hz(track):
    """Of a tracking loop with this gain: 2 a Ts / 2 pi, times 2^17."""
    return track * PWM_HZ / 2**18


@pytest.mark.parametrize("motor, inertia, wanted", (("baldor_ecs101m0h7ef4", 1, None), ("baldor_ecs101m0h7ef4", 4, None),
                                                    (THOR, 1, None), (THOR, 0.25, 60)))
def test_the_tracking_loop_is_as_quick_as_a_load_by_step_asks_for(c, motor, inertia, wanted):
    """A / a^2 is 1.25 degrees, A being p M / J with the torque of i_rated by its least currents; 60 Hz at most."""
    p = shipped(motor)
    p |= {"angle_source": 1, "inertia_gmm2": round(p["inertia_gmm2"] * inertia)}
    _, _, t = compute(c, p)
    ld, lq, i = p["ld_apparent_uh"] / 1e6, p["lq_apparent_uh"] / 1e6, p["i_rated_ma"] / 1e3
    gamma = np.linspace(0, np.pi / 2, 2000)
    torque = (1.5 * p["pole_pairs"] * i * np.cos(gamma) * (p["flux_uwb"] / 1e6 + (lq - ld) * i * np.sin(gamma))).max()
    asked = np.sqrt(p["pole_pairs"] * torque / (p["inertia_gmm2"] / 1e9) / np.radians(1.25)) / 2 / np.pi
    assert pole_hz(t.injection.track_most) == pytest.approx(60, rel=0.002)
    assert pole_hz(t.injection.track) == pytest.approx(wanted or asked, rel=0.004)


def test_what_answers_little_is_tracked_slower_and_nothing_quicker_than_asked(c):
    _, _, t = compute(c, {**shipped("baldor_ecs101m0h7ef4"), "angle_source": 1})
    loop = c.axis().loop
    for radian, wanted in ((230, 60 * (230 / 430)**2), (300, 60 * (300 / 430)**2), (430, pole_hz(t.injection.track)),
                           (3000, pole_hz(t.injection.track))):
        c.injection_track(loop, t, 0, radian)
        assert pole_hz(loop.inject.track) == pytest.approx(wanted, rel=0.01)


@pytest.mark.parametrize("silent, update", ((0, 0), (1, 0), (1, 2)))
def test_the_controllers_do_not_see_the_wave(c, silent, update):
    """The sampled current swings from sample to sample by U T / L_d; the mean of two does not, nor do those between pairs."""
    bench = Bench(c, THOR, 30, soft=SOFT, injection_silent=silent, pwm_update=update)
    bench.start()
    bench.milliseconds(20)
    sampled, regulated = [], []
    for _ in range(40):
        bench.sample()
        sampled.append((bench.i * bench.turn.conjugate()).real * bench.ampere)
        regulated.append(bench.loop.i_d_q15)
    assert np.ptp(sampled) > 300 and np.ptp(regulated) < np.ptp(sampled) / 10


def test_four_lsb_a_degree_are_asked_for(c):
    """Refused below, taken above: by the inductances that are measured, whatever was told."""
    for factor, wanted in ((0.9, c.INJECTION_SALIENCY), (1.1, c.INJECTION_DONE)):
        bench = Bench(c, THOR, 100, soft=SOFT)
        bench.lq_h = 1 / (1 / bench.ld_h - (1 / bench.ld_h - 1 / bench.lq_h) * factor * 4 / bench.lsb_per_degree())
        assert bench.start() == wanted


def test_both_ends_alike_are_refused_and_never_guessed(c):
    bench = Bench(c, THOR, 200, noise_lsb=16)
    assert bench.start() == c.INJECTION_POLARITY
    assert bench.axis.injection.tries == 3
    asked_q15 = [bench.axis.tuning.injection.polarity_q15]
    for _ in range(2):
        asked_q15.append(asked_q15[-1] + asked_q15[-1] // 2)
    assert bench.axis.injection.i_q15 == asked_q15[-1]


@pytest.mark.parametrize("soft", (-SOFT, 0, SOFT))
@pytest.mark.parametrize("angle, load_rad_s2", ((20, 0), (200, 0), (110, 60), (290, -60)))
def test_a_push_finds_north_whatever_the_iron_does(c, soft, angle, load_rad_s2):
    """With the wrong sign of saturation too, and without any; a drift and a load do not matter."""
    bench = Bench(c, THOR, angle, soft=soft, noise_lsb=16, free=True, load_rad_s2=load_rad_s2)
    assert bench.start() == c.INJECTION_DONE
    assert abs(bench.error_deg()) < 3
    assert bench.axis.injection.push_ms <= 64


def test_a_push_is_left_out_where_magnets_outweigh_reluctance_and_saturation_has_told(c):
    bench = Bench(c, THOR, 30, soft=SOFT, free=True)
    bench.axis.tuning.reluctant = False
    assert bench.start() == c.INJECTION_DONE and bench.axis.injection.push_ms == 0 and abs(bench.error_deg()) < 1


@pytest.mark.parametrize("soft", (-SOFT, SOFT))
@pytest.mark.parametrize("times", (30, 2000))
def test_a_heavy_shaft_is_pushed_for_longer_and_one_that_does_not_move_is_refused(c, soft, times):
    bench = Bench(c, THOR, 200, soft=soft, noise_lsb=16, free=True)
    bench.p["inertia_gmm2"] *= times
    result = bench.start()
    if times == 30:
        assert result == c.INJECTION_DONE and abs(bench.error_deg()) < 3 and bench.axis.injection.push_ms > 64
    else:
        assert result == c.INJECTION_POLARITY and bench.axis.injection.push_ms == 256


@pytest.mark.parametrize("angle", (20, 200))
@pytest.mark.parametrize("times, push_ms, freed_ms", ((5, 256, 640), (5, 256, 900), (5, 128, 350), (1, 32, 110)))
def test_a_rotor_that_is_let_go_in_the_middle_of_a_push_is_not_taken_for_its_opposite(c, angle, times, push_ms, freed_ms):
    bench = Bench(c, THOR, angle, noise_lsb=16, free=True)
    bench.p["inertia_gmm2"] *= times
    bench.free, result, search = False, c.INJECTION_RUNNING, bench.axis.injection
    while result == c.INJECTION_RUNNING:
        bench.free = bench.free or (search.push_ms == push_ms and search.ms > freed_ms)
        bench.milliseconds()
        result = c.injection_start_step(bench.axis)
    assert result == c.INJECTION_POLARITY or abs(bench.error_deg()) < 3


def test_a_rotor_that_drifts_is_not_pushed_for_longer_once_it_goes_far(c):
    """Else it might turn by more than half a turn in a window, and that looks like less."""
    bench, result, seen = Bench(c, THOR, 20, noise_lsb=16, free=True), c.INJECTION_RUNNING, []
    bench.p["inertia_gmm2"] *= 40
    search = bench.axis.injection
    while result == c.INJECTION_RUNNING:
        before = search.searches, search.push_ms
        bench.w = 40.0 if search.push_ms else bench.w  # 60 degrees in a window of 26 ms
        bench.milliseconds()
        result = c.injection_start_step(bench.axis)
        if search.searches != before[0]:
            seen.append((before[1], max(abs(way) for way in search.pushed_q32) / 2**32 * 360))
    assert result == c.INJECTION_POLARITY and len(seen) == 16 and min(far for _, far in seen) > 45
    assert {push_ms for push_ms, _ in seen} == {1}


@pytest.mark.parametrize("angle", (10, 190))
def test_north_is_where_the_iron_softens(c, angle):
    bench = Bench(c, THOR, angle, soft=SOFT)
    assert bench.start() == c.INJECTION_DONE and abs(bench.error_deg()) < 1


def test_saturation_across_the_axes_turns_it_unless_it_is_told(c):
    """Without k the zero lies where the axes of the inverse inductances lie: 1/2 atan(2 L_dq / (L_qq - L_dd)) on."""
    bench = Bench(c, THOR, 45, cross=0.1, soft=SOFT)
    ldq = bench.cross * bench.lq_h
    turned = np.degrees(np.arctan2(2 * ldq, bench.lq_h - bench.ld_h)) / 2
    bench.start()
    assert abs(bench.error_deg()) == pytest.approx(turned, rel=0.06)
    with_sign = {}
    for cross_q15 in (-3277, 3277):
        bench.loop.inject.cross_q15 = cross_q15
        follow, bench.c.injection_follow = bench.c.injection_follow, lambda *_: None
        with_sign[cross_q15] = abs(bench.error_deg(150))
        bench.c.injection_follow = follow
    assert with_sign[3277] < 0.5 < turned < with_sign[-3277]


def test_the_cross_saturation_follows_the_current_up_to_a_quarter_of_rated(c):
    bench = Bench(c, THOR, 0)
    told, knee = bench.axis.tuning.injection.cross_q15, bench.axis.tuning.injection.cross_from_q15
    assert told == shipped(THOR)["cross_pm"] * 32768 // 1000
    for share, wanted in ((0, 0), (0.5, 0.5), (1, 1), (3, 1), (-0.5, -0.5), (-2, -1)):
        bench.loop.i_q_ref_q15 = round(knee * share)
        c.injection_follow(bench.loop, bench.axis.tuning)
        assert bench.loop.inject.cross_q15 == pytest.approx(told * wanted, abs=2)


def test_a_wave_that_does_not_fit_is_made_smaller_and_its_answer_counts_for_more(c):
    bench = Bench(c, THOR, 0, soft=SOFT)
    bench.start()
    inject = bench.loop.inject
    full, rad = inject.v_steps, inject.rad_q8
    bench.loop.integral_d_q9 = -(16384 - full * 3 // 4) * 512
    c.injection_follow(bench.loop, bench.axis.tuning)
    assert inject.v_steps == pytest.approx(full * 3 / 4, abs=2) and inject.rad_q8 == pytest.approx(rad * 4 / 3, rel=0.01)
    bench.loop.integral_d_q9 = 16000 * 512
    c.injection_follow(bench.loop, bench.axis.tuning)
    assert inject.v_steps == full // 2
