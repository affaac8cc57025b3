# SPDX-License-Identifier: MIT
"""Which way the encoder counts: synthetic swings of a rotor, any field, with what a wrong resistance adds to the voltage."""
import math

import pytest

TURN = 2 ** 32


def felt(c, sweep_deg, sense=1, start_deg=0, field_deg=0, emf_q15=300, constant_q15=(0, 0), told=1.0, back=False):
    """How sure the detector is after a rotor has moved by `sweep_deg`, and perhaps back again; 1.0: it fits one sense only.

    sense   of the encoder; told: its electrical angle is so many times the true one
    """
    state = c.encoder_sense()
    c.encoder_sense_start(state)
    steps = 200
    path = [sweep_deg * (1 - math.cos(math.pi * k / steps)) / 2 for k in range(steps + 1)]
    path += path[-2::-1] if back else []
    peak = max(abs(b - a) for a, b in zip(path, path[1:]))
    for before, now in zip(path, path[1:]):
        angle = math.radians(start_deg + (before + now) / 2 - field_deg)
        size = emf_q15 * (now - before) / peak
        e_d, e_q = -size * math.sin(angle) + constant_q15[0], size * math.cos(angle) + constant_q15[1]
        encoder = round(sense * told * now / 360 * TURN) % TURN
        counts = round(sense * told * now * 100) - round(sense * told * before * 100)
        c.encoder_sense_step(state, round(e_d), round(e_q), round(field_deg / 360 * TURN) % TURN, encoder, counts)
    return c.encoder_sense_q15(state) / 32768


def expected(sweep_deg):
    """At constant speed a swing by w leaves sin(w) / w of the wrong hypothesis."""
    width = math.radians(sweep_deg)
    wrong = (math.sin(width) / width) ** 2
    return (1 - wrong) / (1 + wrong)


@pytest.mark.parametrize("sense", [1, -1])
def test_a_sixth_of_a_turn_shows_it_from_everywhere(c, sense):
    for sweep in (60, 90, 170, -75, -200):
        for start in range(0, 360, 45):
            for field in (0, 100, 250):
                sure = sense * felt(c, sweep, sense, start, field)
                assert sure > 0.1 and sure > expected(sweep) / 2, (sweep, start, field)


def test_half_a_turn_leaves_no_doubt(c):
    assert felt(c, 180) > 0.9 and felt(c, 180, -1) < -0.9


@pytest.mark.parametrize("sense", [1, -1])
def test_what_is_constant_cancels_between_forth_and_back(c, sense):
    for constant in ((150, 0), (-150, 60), (0, 150)):
        for start in range(0, 360, 60):
            assert sense * felt(c, 120, sense, start, constant_q15=constant, back=True) > 0.3, (constant, start)


@pytest.mark.parametrize("told", [0.5, 0.75, 1.5, 2])
def test_pole_pairs_told_wrongly_do_not_turn_it_round(c, told):
    for sweep in (100, 150):
        assert felt(c, sweep, told=told) > 0.05 and felt(c, sweep, -1, told=told) < -0.05, sweep


def test_a_small_swing_is_not_sure_of_anything(c):
    assert abs(felt(c, 20)) < 0.03 and felt(c, 0.001) == 0


def test_nothing_overflows(c):
    """Four thousand counts a millisecond at full voltage for longer than any start."""
    state = c.encoder_sense()
    c.encoder_sense_start(state)
    for k in range(20000):
        angle = 2 * math.pi * k / 50
        c.encoder_sense_step(state, -round(32767 * math.sin(angle)), round(32767 * math.cos(angle)), 0,
                             round(k / 50 * TURN) % TURN, 4096)
    assert c.encoder_sense_q15(state) > 32000
