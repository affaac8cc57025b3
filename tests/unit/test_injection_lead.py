# SPDX-License-Identifier: MIT
"""Who tells the angle, saliency or EMF: by margin, by how quick each is, by the room for the wave; and a lock that is lost."""
import cmath
import math

import pytest

from rigs.drive import World
from rigs.motor_numbers import compute, shipped

THOR, QUICK = "thor_pmsyrm", 786  # the tracking loop's gain at 60 Hz and 20 kHz: 2 a Ts / 2 pi, times 2^17


@pytest.fixture
def leading(c):
    w = World(c)
    w.axis.params.angle_source = 1
    _, _, w.axis.tuning = compute(c, {**shipped(THOR), "angle_source": 1})
    loop = w.axis.loop
    loop.source, loop.field_follows, loop.vbus_q15 = c.LOOP_INJECTION, 2**32 - 1, 20316
    loop.inject.track, loop.inject.full_rad_q8 = QUICK, 20000
    loop.flux.margin_q8 = 20 * 256
    w.put("OPERATION_ENABLED")
    return w


def speed_q32(share):
    """The speed at which the observer's pole, |w| at most here, is this share of the injection's."""
    return round(QUICK * share * 2**14)


def steps_until_observer(w, most=100):
    for step in range(most):
        w.c.injection_after_control(w.axis)
        if w.axis.loop.source == w.c.LOOP_OBSERVER:
            return step + 1
    return None


@pytest.mark.parametrize("share, margin, v_d_steps, wanted", (
    (0.80, 20, 0, None), (0.86, 20, 0, 20), (-0.86, 20, 0, 20), (0.86, 4.4, 0, None), (0.86, 4.6, 0, 20),
    (0.3, 20, 16384 - 6000, 20), (0.3, 20, 16384 - 9000, None), (0.3, 4, 16384 - 6000, None)))
def test_the_observer_takes_over_where_it_sees_and_is_quick_or_the_wave_does_not_fit(leading, share, margin, v_d_steps,
                                                                                    wanted):
    """THOR's wave of 60 V takes 7742 steps of a 310 V bus."""
    loop = leading.axis.loop
    loop.pll.speed_q32, loop.flux.margin_q8, loop.integral_d_q9 = speed_q32(share), round(margin * 256), v_d_steps * 512
    assert steps_until_observer(leading) == wanted


@pytest.mark.parametrize("share, v_d_steps, wanted", ((0.70, 0, False), (0.62, 0, True), (-0.62, 0, True),
                                                      (0.62, 16384 - 8000, False), (0.1, 16384 - 9500, True)))
def test_the_injection_wants_back_with_hysteresis(c, leading, share, v_d_steps, wanted):
    loop = leading.axis.loop
    loop.source, loop.pll.speed_q32, loop.integral_d_q9 = c.LOOP_OBSERVER, speed_q32(share), v_d_steps * 512
    assert bool(c.injection_should_lead(leading.axis)) == wanted
    loop.inject.track = 0
    assert not c.injection_should_lead(leading.axis) and not c.injection_takes_over(leading.axis), "there is none"


def test_the_flux_is_set_to_what_angle_and_currents_make_it(c, leading):
    """psi_f + L_d i_d along the magnets, L_q(i_q) i_q across, in the frame of the stator."""
    loop, t = leading.axis.loop, leading.axis.tuning.observer
    loop.pll.angle_q32 = 0x30000000
    for i_d, i_q in ((0, 0), (-9800, 10700), (-3000, -5000)):
        loop.i_d_q15, loop.i_q_q15 = i_d, i_q
        c.observer_preset(loop, leading.axis.tuning)
        lq = t.lq + t.lq_more * (t.iron_q15 - abs(i_q)) / t.iron_q15
        wanted = complex(t.magnet + t.ld * i_d / 32768, lq * i_q / 32768) * cmath.exp(2j * math.pi * 3 / 16) * 2**14
        assert abs(complex(loop.flux.flux_alpha, loop.flux.flux_beta) - wanted) < 3 * 2**14


@pytest.mark.parametrize("moved_deg", (0, 1.5, -1.5, 40))
def test_the_memory_of_the_speed_loop_counts_the_angle_and_not_the_speed_of_an_instant(c, leading, moved_deg):
    """By injection; the observer's speed is the mean of its angle's already, and its angle may jump when it takes over."""
    loop, estimate = leading.axis.loop, leading.axis.speed.estimate
    loop.status_max, loop.pll.speed_q32 = 1, 5_000_000
    for source, by_angle in ((c.LOOP_INJECTION, True), (c.LOOP_OBSERVER, False), (c.LOOP_INJECTION, True)):
        loop.source = source
        loop.pll.angle_q32 = (loop.pll.angle_q32 + round(moved_deg / 360 * 2**32)) % 2**32
        c.rotor_take_speed(leading.axis)
        rpm = moved_deg / 360 / 2 * 60000 if by_angle else 5_000_000 / 2**32 * 20000 * 60 / 2
        assert estimate.travel_q15 / 32768 == pytest.approx(rpm, abs=0.02)
        assert estimate.speed_rpm_q15 / 32768 == pytest.approx(5_000_000 / 2**32 * 20000 * 60 / 2, rel=1e-4)


def test_lq_is_a_straight_line_from_rest_to_rated(c, leading):
    """Told 36.6 mH without current and 20.5 with the q current of rated torque: what the model has between, within 7 %."""
    p, loop = shipped(THOR), leading.axis.loop
    unit = p["flux_uwb"] / 1e6 + p["lq_rest_uh"] / 1e6 * p["i_range_ma"] / 1000
    for i_q_a, wanted_mh in ((0.01, 36.6), (4.4, 31.31), (8.8, 26.76), (16.06, 20.49)):
        loop.i_d_q15, loop.i_q_q15 = 0, round(i_q_a / 50 * 32768)
        c.observer_follow(loop, leading.axis.tuning, c.OBSERVER_LEADS)
        assert loop.flux.lq / 2**14 * unit / (p["i_range_ma"] / 1000) * 1e3 == pytest.approx(wanted_mh, rel=0.07)


def test_a_response_of_another_axis_is_a_lost_lock_within_ten_milliseconds(c, leading):
    """And the part of the wave that fits counts."""
    axis, inject = leading.axis, leading.axis.loop.inject
    axis.injection.straight = 400
    for share_q8, response, wanted in ((256, 410, None), (256, 390, 10), (128, 210, None), (128, 190, 10)):
        axis.faults.cause, axis.lock_watch.lost_ms, inject.share_q8 = c.FAULT_NONE, 0, share_q8
        lost = None
        for step in range(30):
            inject.sum_d += response * 20
            c.lock_watch_step(axis)
            c.reaction_step(axis)
            if axis.faults.cause == c.FAULT_LOCK_LOST and lost is None:
                lost = step + 1
        assert lost == wanted, (share_q8, response)


def test_injection_lead_changes_hands_with_nothing_counted_before(c, leading):
    """What each side counted against its lock, or for the other, is of the time before."""
    loop, counted = leading.axis.loop, leading.axis.sensorless
    loop.source, loop.inject.sum_d, loop.inject.sum_q = c.LOOP_OBSERVER, 77, 88
    counted.steady_ms = 7
    assert c.injection_takes_over(leading.axis) and loop.source == c.LOOP_INJECTION
    assert counted.steady_ms == 0
    answer = c.injection_take(loop)
    assert (answer.d, answer.q) == (0, 0), "what was summed up before does not count"
    counted.weak_ms, loop.pll.speed_q32 = 5, speed_q32(0.9)
    assert steps_until_observer(leading) == 20 and counted.weak_ms == 0
