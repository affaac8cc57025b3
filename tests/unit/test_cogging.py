# SPDX-License-Identifier: MIT
"""The map of cogging: what it adds against its harmonics, its fading, and the learning on a motor in formulas."""
import math
import random

import pytest

from rigs.motor_numbers import compute, shipped


COUNT_WAY = 60000 * 32768 / 4000  # of a count, in the estimate's unit of way


def tuned(c, **params):
    return compute(c, {**shipped(), **params})[2]


def made(c, harmonics, bw_hz=60):
    """A map of {order: (cosine, sine)}, in Q15."""
    m = c.cogging_map(count=len(harmonics))
    for h, (order, (cosine, sine)) in zip(m.harmonics, harmonics.items()):
        h.order, h.cos_q23, h.sin_q23 = order, round(cosine * 256), round(sine * 256)
    c.cogging_set_fade(m, bw_hz)
    return m


def at(c, tuning, m, count, rpm=0.0):
    e = c.speed_estimate(count=math.floor(count), beyond_q15=round(count % 1 * COUNT_WAY), speed_rpm_q15=round(rpm * 32768))
    return c.cogging_torque_q15(m, e, tuning)


def test_the_torque_is_the_sum_of_the_harmonics(c):
    tuning, draw = tuned(c), random.Random(3)
    harmonics = {24: (300, -200), 48: (-50, 77), 1: (12, 9), 8: (-400, 0)}
    m = made(c, harmonics)
    for _ in range(500):
        count = draw.uniform(0, 4000)
        angle = 2 * math.pi * count / 4000
        exact = sum(a * math.cos(n * angle) + b * math.sin(n * angle) for n, (a, b) in harmonics.items())
        assert at(c, tuning, m, count) == pytest.approx(exact, abs=1.5)


def test_it_leads_by_half_a_millisecond(c):
    tuning = tuned(c)
    m = made(c, {24: (0, 1000)})
    for rpm in (60, -60):
        angle = 2 * math.pi * rpm / 60 * 0.5e-3
        assert at(c, tuning, m, 0, rpm) == pytest.approx(1000 * math.sin(24 * angle), abs=3)


def test_it_fades_from_where_its_highest_harmonic_is_the_bandwidth_to_twice_that(c):
    tuning = tuned(c)
    m = made(c, {24: (1000, 0), 48: (0, 0)})
    full = 60 * 60 / 48
    for rpm, share in ((0, 1), (full, 1), (1.5 * full, 0.5), (2 * full, 0), (4000, 0)):
        for sign in (1, -1):
            lead = math.cos(24 * 2 * math.pi * sign * rpm / 60 * 0.5e-3)
            assert at(c, tuning, m, 0, sign * rpm) == pytest.approx(1000 * lead * share, abs=10)


def test_what_is_not_known_adds_nothing(c):
    m = made(c, {24: (1000, 0)})
    m.count = 0
    assert at(c, tuned(c), m, 0) == 0


def learn(c, tuning, torque_of, friction=0.0, rpm=10.0, wobble=0.0, inertia=True):
    """The learning at a speed that wobbles with the cogging; the shaft needs torque_of(angle), friction and acceleration."""
    learner, turns, m = c.cogging_learn(), c.turns(), c.cogging_map()
    e = c.speed_estimate(interval_clocks=1000)
    c.cogging_learn_begin(learner, turns, tuning)
    counts, torque, before_rpm, ms = 0.0, 0.0, 0.0, 0
    accel_q15 = tuning.speed_accel_q8 * 65536 / 2**24  # of a rpm in a millisecond
    while learner.phase != c.COGGING_DONE:
        direction = c.cogging_learn_direction(learner)
        ms += 1
        assert ms < 100000
        now_rpm = direction * rpm * (1 + wobble * math.cos(24 * 2 * math.pi * counts / 4000 + 0.5))
        counts += now_rpm / 60000 * 4000
        turns.counts, turns.count = math.floor(counts), math.floor(counts) % 4000
        e.count, e.beyond_q15 = turns.count, round((counts - math.floor(counts)) * COUNT_WAY)
        e.speed_rpm_q15 = e.travel_q15 = round(now_rpm * 32768)
        c.cogging_learn_step(learner, turns, e, round(torque), tuning)
        next_rpm = direction * rpm * (1 + wobble * math.cos(24 * 2 * math.pi * counts / 4000 + 0.5))
        torque = torque_of(2 * math.pi * counts / 4000) + friction * direction
        torque += accel_q15 * (next_rpm - before_rpm) / 2 if inertia else 0
        before_rpm = now_rpm
        if ms % 7 == 0 or c.cogging_learn_direction(learner) == 0:
            c.cogging_learn_review(learner, m)
    assert learner.lost == 0
    return {h.order: (h.cos_q23 / 256, h.sin_q23 / 256) for h in list(m.harmonics)[:m.count]}, learner


def test_it_finds_the_harmonics_there_are_and_no_others(c):
    """Friction three times as large as the smaller one, a load, and a speed that wobbles by a third."""
    tuning = tuned(c)
    found, learner = learn(
        c, tuning, lambda x: 500 + 300 * math.cos(24 * x) - 200 * math.sin(24 * x) + 60 * math.sin(48 * x + 1),
        friction=180, wobble=0.33)
    assert set(found) == {24, 48}
    assert found[24] == pytest.approx((300, -200), abs=12)
    assert found[48] == pytest.approx((60 * math.sin(1), 60 * math.cos(1)), abs=8)
    assert list(found) == [24, 48], "the largest first"


def test_no_more_than_there_is_room_for_and_those_are_the_largest(c):
    orders = {4 * n: 100 + 10 * n for n in range(1, 13)}
    found, _ = learn(c, tuned(c), lambda x: sum(a * math.cos(n * x) for n, a in orders.items()))
    assert set(found) == {4 * n for n in range(5, 13)}


def test_the_orders_looked_for_are_multiples_of_the_pole_pairs_that_the_encoder_shows(c):
    learner, turns = c.cogging_learn(), c.turns()
    for pole_pairs, counts, highest in ((4, 4000, 632), (1, 4000, 160), (15, 3200, 630), (15, 400, 90), (50, 100, 2)):
        tuning = tuned(c)
        tuning.pole_pairs, tuning.encoder_counts = pole_pairs, counts
        c.cogging_learn_begin(learner, turns, tuning)
        orders = list(learner.orders)[:learner.candidates]
        assert max(orders) == highest and len(set(orders)) == len(orders)
        assert all(order in (1, 2) or order % pole_pairs == 0 for order in orders)


def test_samples_that_nobody_takes_are_lost_and_counted_and_none_is_taken_twice(c):
    tuning, learner, turns, m = tuned(c), c.cogging_learn(), c.turns(), c.cogging_map()
    e = c.speed_estimate(interval_clocks=1000)
    c.cogging_learn_begin(learner, turns, tuning)
    learner.phase = c.COGGING_FORWARD
    for _ in range(100):
        c.cogging_learn_step(learner, turns, e, 5, tuning)
    assert (learner.put, learner.lost) == (64, 36)
    assert not c.cogging_learn_review(learner, m) and learner.used == 64
    assert not c.cogging_learn_review(learner, m) and learner.used == 64
