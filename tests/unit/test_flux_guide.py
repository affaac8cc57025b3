# SPDX-License-Identifier: MIT
"""What the slow loop tells the handlers that weaken the field (flux_limit_guide): which axis is served first, and from which
voltage on v_q lacks any."""
import math

import pytest

STEPS, RADIUS, VBUS = 40000, 21209, 12000  # steps of the bus voltage; the modulator's circle; Q15 of v_range
FAST = 9000


def tuned(c, **told):
    params, tuning = c.params(), c.tuning()
    c.params_init(params)
    for name, value in told.items():
        setattr(params, name, value)
    assert c.tuning_compute(params, tuning).error == c.ERROR_NONE
    return tuning


@pytest.fixture(scope="module")
def tuning(c):
    return tuned(c)


def guided(c, tuning, w=FAST, i_q=0, i_q_ref=0, v_d=0, v_q=0, before=None, kick=0):
    loop = c.current_loop()
    c.current_loop_init(loop)
    loop.pll.speed_q32 = w << loop.w_shift
    loop.i_q_q15, loop.i_q_ref_q15, loop.v_d_q15, loop.kp_q_q9 = i_q, i_q_ref, v_d, 4000
    loop.v_q_q15, loop.weaken.radius_steps, loop.weaken.kick_steps = v_q, RADIUS, kick
    loop.weaken.i_q_ref_before_q15 = i_q_ref if before is None else before
    c.flux_limit_guide(loop, tuning, VBUS)
    return loop.weaken


@pytest.mark.parametrize("way", (1, -1))
def test_braking_lasts_until_its_current_has_gone(c, tuning, way):
    """v_d > 0 beyond half of the circle, and a current against the speed: q is served first, whatever is asked for now."""
    full = dict(w=way * FAST, v_d=4000)
    assert guided(c, tuning, i_q=-way * 900, i_q_ref=-way * 900, **full).q_first == -1
    assert guided(c, tuning, i_q=-way * 900, i_q_ref=0, **full).q_first == -1, "torque 0 was asked for this millisecond"
    assert guided(c, tuning, i_q=-way * 900, i_q_ref=way * 900, **full).q_first == -1
    assert guided(c, tuning, i_q=way * 900, i_q_ref=way * 900, **full).q_first == 0
    assert guided(c, tuning, w=way * FAST, i_q=-way * 900, i_q_ref=-way * 900, v_d=2000).q_first == 0, "little v_d"


@pytest.mark.parametrize("way", (1, -1))
def test_driving_past_what_cancels_the_magnets_q_is_first(c, tuning, way):
    """Then a lack of v_q, which is against the speed, takes more v_d: beyond half of the circle, and no harmonic's swing."""
    def first(v_d, v_q):
        return guided(c, tuning, w=way * FAST, i_q=way * 900, i_q_ref=way * 900, v_d=v_d, v_q=way * v_q).q_first
    circle = RADIUS / STEPS * VBUS
    assert first(-round(0.99 * circle), -round(circle / 8)) == -1, "what d first leaves to q: it would stay there"
    assert first(-round(0.8 * circle), -round(0.6 * circle)) == -1
    assert first(-round(0.99 * circle), round(circle / 8)) == 0, "weakened, not past"
    assert first(-round(0.99 * circle), -round(circle / 20)) == 0
    assert first(-round(0.4 * circle), -round(0.9 * circle)) == 0, "little torque: d holds the flux"


@pytest.mark.parametrize("i_q_ref", (0, 1500, -1500, 4000))
def test_the_room_of_q_is_what_a_steady_d_leaves(c, tuning, i_q_ref):
    x_q = max(tuning.x_q_q11, tuning.x_q_apparent_q11) / 2048
    v_d = abs(i_q_ref) * x_q * FAST / 32768
    room = math.sqrt(max((RADIUS / STEPS * VBUS) ** 2 - v_d**2, 0)) * STEPS / VBUS
    sign = 1 if i_q_ref >= 0 else -1
    assert guided(c, tuning, w=sign * FAST, i_q=i_q_ref, i_q_ref=i_q_ref).room_q_steps == pytest.approx(room, rel=0.01, abs=60)


def test_a_step_of_the_reference_is_no_lack_and_is_soon_forgotten(c, tuning):
    steady = guided(c, tuning, i_q=1500, i_q_ref=1500).room_q_steps
    stepped = guided(c, tuning, i_q=1500, i_q_ref=1500, before=1300)
    assert stepped.room_q_steps == steady + 200 * 4000 // 512 and stepped.i_q_ref_before_q15 == 1500
    assert guided(c, tuning, i_q=1500, i_q_ref=1500, kick=stepped.kick_steps).kick_steps == stepped.kick_steps // 2


def test_where_q_is_first_its_own_limit_is_its_room(c, tuning):
    assert guided(c, tuning, i_q=-900, i_q_ref=-900, v_d=4000, before=0).room_q_steps == 0


# ---- the flux's trim, from the length of the voltages ----

KEPT = RADIUS / STEPS * VBUS * 31 / 32  # of the circle; Q15 of v_range


def followed(c, tuning, length=0, power=0, decides=True, ms=400, begun=0):
    """The limit after so many milliseconds with voltages of this length, Q15, in d."""
    loop, limit = c.current_loop(), c.flux_limit()
    c.current_loop_init(loop)
    loop.pll.speed_q32, loop.v_d_q15, loop.weaken.radius_steps = FAST << loop.w_shift, length, RADIUS
    limit.decides, limit.trim_q21 = decides, begun
    for _ in range(ms):
        c.flux_limit_follow(limit, loop, tuning, VBUS, power, 32768 * 2)
    return limit


@pytest.mark.parametrize("length, power, share", ((0, 0, 1 / 4), (0, 500, 1 / 4), (0, -500, 1 / 8), (11000, 500, -1 / 2)))
def test_the_trim_ends_at_a_quarter_more_an_eighth_while_braking_and_half_less(c, tuning, length, power, share):
    assert followed(c, tuning, length, power).trim_q21 / 64 == pytest.approx(share * KEPT, rel=0.01)


def test_a_brake_takes_what_is_more_than_an_eighth_at_once(c, tuning):
    driving = followed(c, tuning, 0, 500)
    assert followed(c, tuning, 0, -1, ms=1, begun=driving.trim_q21).trim_q21 / 64 == pytest.approx(KEPT / 8, rel=0.01)


def test_the_trim_moves_by_an_eighth_of_what_is_missing_and_fades_where_nothing_is_limited(c, tuning):
    assert followed(c, tuning, round(KEPT) - 400, 500, ms=1).trim_q21 / 64 == pytest.approx(50, abs=1)
    assert followed(c, tuning, round(KEPT) + 400, 500, ms=1).trim_q21 / 64 == pytest.approx(-50, abs=1)
    assert followed(c, tuning, round(KEPT) - 400, 500, decides=False, ms=1, begun=6400).trim_q21 == 6000
    assert followed(c, tuning, round(KEPT) + 400, 500, decides=False, ms=1).trim_q21 < 0, "too long: not without a limit either"


def test_more_trim_is_more_flux(c, tuning):
    """v / w, what the resistance takes aside: there is no current."""
    for begun in (0, 640 * 64):
        flux = followed(c, tuning, round(KEPT), 0, ms=1, begun=begun).flux_q15
        assert flux == pytest.approx((KEPT + begun / 64) / FAST * 32768, rel=0.002)


@pytest.mark.parametrize("axis, sign", (("q", 1), ("q", -1), ("d", 1)))
def test_flux_limit_of_the_weakening_handlers_sees_what_a_current_lacks(c, axis, sign):
    """As voltage that the field takes; a quarter of the circle at most, and a 32nd of it where a current is too large."""
    tuning = tuned(c, lq_uh=300)
    x = (tuning.x_q_q11 if axis == "q" else tuning.x_d_q11) / 2048
    most = int(KEPT) >> 5

    def trim(short):
        """A millisecond of a vector that is 100 too short: an eighth of that, less what the current lacks."""
        loop, limit = c.current_loop(), c.flux_limit()
        c.current_loop_init(loop)
        loop.pll.speed_q32, loop.v_d_q15, loop.weaken.radius_steps = FAST << loop.w_shift, round(KEPT) - 100, RADIUS
        loop.weaken.on, loop.weaken.q_first, limit.decides = 1, -1 if axis == "d" else 0, True
        loop.i_q_ref_q15 = sign * 1500
        loop.i_q_q15 = sign * (1500 - (short if axis == "q" else 0))
        loop.i_d_ref_q15, loop.i_d_q15 = -700, -700 - (short if axis == "d" else 0)
        c.flux_limit_follow(limit, loop, tuning, VBUS, 500, 32768 * 2)
        return limit.trim_q21 / 8
    per = x * FAST / 32768
    for lacks in (0, most // 2, 3 * most, 7 * most, 8 * most - 3):
        assert trim(round(lacks / per)) == pytest.approx(100 - lacks, rel=0.005, abs=3)
    assert trim(round(12 * most / per)) == trim(round(20 * most / per)) == pytest.approx(100 - 8 * most, abs=2)
    assert trim(-round(most / 2 / per)) == pytest.approx(100 + most / 2, abs=3)
    assert trim(-round(3 * most / per)) == trim(-round(9 * most / per)) == pytest.approx(100 + most, abs=2)


def lacking_with_d_short(c, tuning, radius, short, q_first=0, ms=200, v_d=6000):
    """What the trim goes down by in a millisecond, voltages at the target: the d current lacks so much of its reference."""
    loop, limit = c.current_loop(), c.flux_limit()
    c.current_loop_init(loop)
    loop.pll.speed_q32, loop.v_d_q15, loop.weaken.radius_steps = FAST << loop.w_shift, v_d, radius
    loop.weaken.on, loop.weaken.q_first = True, q_first
    loop.i_d_ref_q15 = -6000
    limit.decides = True
    for n in range(ms):
        loop.i_d_q15 = -6000 + short(n)
        limit.trim_q21 = 0
        c.flux_limit_follow(limit, loop, tuning, VBUS, 500, 32768 * 2)
    return -limit.trim_q21


def test_beyond_the_circle_a_d_current_that_is_cut_short_costs_flux(c, tuning):
    """The hexagon's harmonics are cut off d as well, and the length of the voltages does not show it; harmonics are no lack."""
    six_step = round(STEPS * 2 / math.pi)
    none, short, more, swings = (lacking_with_d_short(c, tuning, six_step, one) for one in (
        lambda n: 0, lambda n: 1000, lambda n: -1000, lambda n: 1000 * (-1) ** n))
    lacking = (1000 - 8 - tuning.i_max_q15 / 128) * (FAST * tuning.x_d_q11 >> 15) / 2048
    assert lacking > 50 and short - none == pytest.approx(lacking * 64 / 8, rel=0.03), "to the 15 that the mean's steps leave"
    assert more == none, "more of it than asked for is no lack"
    assert swings - none < (short - none) / 4
    within = [lacking_with_d_short(c, tuning, RADIUS, lambda n, i=i: i) for i in (0, 1000)]
    assert within[0] == within[1], "within the circle d has all"


def test_driving_with_q_first_only_a_lasting_lack_of_d_beyond_the_circle_costs_flux(c, tuning):
    """The voltages' length shows it within the circle; behind a pulsing bus d lags whenever that falls."""
    def lacking(short, radius, v_d=-6000):
        return lacking_with_d_short(c, tuning, radius, lambda n: short, q_first=-1, v_d=v_d)
    assert lacking(1000, RADIUS) == lacking(0, RADIUS) == lacking(-1000, RADIUS)
    six_step = round(STEPS * 2 / math.pi)
    assert lacking(1000, six_step) > lacking(0, six_step)
    assert lacking(-1000, RADIUS, 6000) > lacking(0, RADIUS, 6000), "a braking lack"
