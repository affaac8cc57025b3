# SPDX-License-Identifier: MIT
"""A speed loop that swings with its shaft finds it, says at which frequency, and ends it; nothing else is taken for that."""
import cmath
import math
import random

import pytest

from rigs.drive import World
from rigs.two_masses import Shaft

FOUND_MS = 130  # from the ramp on
CALM = 0.06     # of i_max, peak to peak


def tone(c, values):
    x, t = [round(value) for value in values], c.tone()
    around = [before + after for before, after in zip(x, x[2:])]
    t.squares, t.sums = sum(at * at for at in x[1:-1]), sum(both * both for both in around)
    t.products = sum(at * both for at, both in zip(x[1:], around))
    return c.tone_find(t)


@pytest.mark.parametrize("hz", (20, 81, 120, 250, 333, 410, 499))
@pytest.mark.parametrize("size", (60, 30000))
def test_a_tone_is_found_by_its_frequency(c, hz, size):
    found = tone(c, [size * math.cos(2 * math.pi * hz * n / 1000 + 0.4) for n in range(22)])
    assert c.tone_hz(found.c_q13, 1000) == pytest.approx(hz, abs=3 if size == 60 else 1)
    assert found.rest_q13 < 0.02 * 8192


def test_noise_is_no_tone(c):
    draw = random.Random(5)
    rests = [tone(c, [draw.gauss(0, 3000) for _ in range(16)]).rest_q13 / 8192 for _ in range(300)]
    assert sum(rest < 1.2 for rest in rests) < 60 and sum(rests) / len(rests) > 1.6
    assert tone(c, [0] * 16).rest_q13 > 2 * 8192, "nor is silence"


@pytest.mark.parametrize("size, edge, found", ((1.0, 0, True), (1.0, 0.4, True), (1.0, 0.6, False), (0.4, 0, False)))
def test_what_the_limit_has_made_no_tone_is_found_by_how_long_it_lasts(c, size, edge, found):
    """Of two tones, by parts of i_max: neither purity nor a coarse encoder's edges tell it; a smaller one may be anything."""
    o, i_max_q15 = c.oscillation(), 16000
    c.oscillation_init(o)
    o.edge_q12 = round(edge * i_max_q15 / 8)
    amplitude = size * i_max_q15 / 8
    says = [c.oscillation_step(o, round(amplitude * (math.cos(0.754 * n) + math.cos(2.827 * n + 0.3))), 0, i_max_q15)
            for n in range(160)]
    assert (o.found > 0) == found
    assert c.OSCILLATION_LET_GO not in says[:63], "four blocks of it"


@pytest.mark.parametrize("fade, answers", ((0.4, 0), (0.55, 0), (1.0, 1)))
@pytest.mark.parametrize("begins", range(0, 16, 3))
def test_what_a_ramps_end_sets_off_takes_no_more_gain(c, fade, answers, begins):
    """After an answer; by what is left of the swing from block to block. A light rotor before a heavy load swings so."""
    o, i_max_q15 = c.oscillation(), 16000
    c.oscillation_init(o)
    o.listened, o.answered = True, 1
    swing = [0.3 * i_max_q15 / 8 * fade**(ms / 16) * math.cos(2 * math.pi * 0.12 * ms) for ms in range(64 - begins)]
    says = [c.oscillation_step(o, round(seen), 0, i_max_q15) for seen in [0] * (96 + begins) + swing]
    assert sum(said != c.OSCILLATION_NOTHING for said in says) == answers


@pytest.mark.parametrize("size, blocks", ((1.05, 2), (0.95, 5), (0.85, 5)))
def test_after_an_answer_less_than_the_limit_may_still_fade(c, size, blocks):
    """By parts of i_max: what meets the limit is answered again in the second block of 16 ms."""
    o, i_max_q15 = c.oscillation(), 16000
    c.oscillation_init(o)
    o.listened, o.answered, o.blocks = True, 1, 0
    says = [c.oscillation_step(o, round(size * i_max_q15 / 8 * math.cos(2 * math.pi * 0.125 * ms)), 0, i_max_q15)
            for ms in range(16 * blocks)]
    assert says == [c.OSCILLATION_NOTHING] * (16 * blocks - 1) + [c.OSCILLATION_LESS]


def test_the_first_swing_is_taken_as_it_begins(c):
    """As lot 138: at the limit it falls below the frequencies that are looked at, and would stay."""
    o, i_max_q15 = c.oscillation(), 16000
    c.oscillation_init(o)
    swing = [0.5 * i_max_q15 / 8 * math.cos(2 * math.pi * 0.12 * ms) for ms in range(16)]
    says = [c.oscillation_step(o, round(seen), 0, i_max_q15) for seen in [0] * 32 + swing]
    assert says[-1] == c.OSCILLATION_LET_GO


@pytest.mark.parametrize("fades_ms", (3, 4, 5, 8, 12))
@pytest.mark.parametrize("size", (-0.3, 0.6, 1.0, -1.5))
def test_the_answer_to_a_step_is_no_swing_as_it_begins(c, size, fades_ms):
    """Wherever in a block: a master's first set-point, by parts of i_max, with an undershoot of a quarter."""
    for begins in range(16):
        o, i_max_q15 = c.oscillation(), 16000
        c.oscillation_init(o)
        fade = [math.exp(-ms / fades_ms) - 0.25 * (ms / fades_ms) * math.exp(-ms / fades_ms / 2) for ms in range(64)]
        says = [c.oscillation_step(o, round(size * i_max_q15 / 8 * seen), 0, i_max_q15) for seen in [0] * (80 + begins) + fade]
        assert set(says) == {c.OSCILLATION_NOTHING}, begins


@pytest.mark.parametrize("hz", (101, 150, 280, 400, 490))
def test_a_notch_takes_its_frequency_and_leaves_what_rests(c, hz):
    n = c.notch()
    c.notch_set(n, round(2 * math.cos(2 * math.pi * hz / 1000) * 8192), 10**8)
    assert all(abs(c.notch_step(n, 10**8) - 10**8) < 4e4 for _ in range(50)), "without a step"

    def gain(at_hz):
        c.notch_reset(n, 0)
        out = [c.notch_step(n, round(1e8 * math.cos(2 * math.pi * at_hz * k / 1000))) for k in range(2000)]
        return abs(sum(y * cmath.exp(-2j * math.pi * at_hz * k / 1000) for k, y in enumerate(out[1000:]))) / 1e8 / 500
    assert gain(hz) < 0.01 and gain(hz * 1.02) < 0.1 and gain(10) == pytest.approx(1, abs=0.03)
    assert max(gain(f) for f in range(5, 500, 45)) < 1.7


@pytest.mark.parametrize("hz, load_ratio, damping", ((230, 3.0, 0.02), (300, 6.0, 0.015), (190, 9.0, 0.03), (420, 5.0, 0.02)))
def test_a_coupling_that_swings_is_found_and_filtered(c, hz, load_ratio, damping):
    """Rated speed after a ramp: the notch is where the shaft rings."""
    shaft = Shaft(c, hz, load_ratio, damping).go(1500)
    while not shaft.speed.oscillation.found:
        assert len(shaft.demands) < FOUND_MS
        shaft.step(1)
    shaft.step(1500)
    notch = shaft.speed.notch
    assert notch.on and c.tone_hz(notch.c_q13, 1000) == pytest.approx(hz, rel=0.05)
    assert shaft.swing(500) < CALM and shaft.rpms[-1] == pytest.approx(1500, rel=0.01)
    assert shaft.speed.kp_q16 > 0.08 * shaft.t.speed_kp_q16 and shaft.speed.oscillation.answered <= 4


@pytest.mark.parametrize("told_ratio", (8.0, 20.0, 50.0))
def test_an_inertia_told_far_too_large_is_found_and_answered(c, told_ratio):
    """It once swung with the largest current for ever; at rest, too, where what is left of the gains is slow."""
    shaft = Shaft(c, told_ratio=told_ratio).go(1500)
    shaft.step(1500)
    o = shaft.speed.oscillation
    assert o.found and not shaft.speed.notch.on and shaft.swing(300) < 3 * CALM
    assert 1 / 6 < shaft.speed.kp_q16 / shaft.t.speed_kp_q16 * told_ratio < 4
    assert o.light and (told_ratio == 20 or shaft.speed.accel_share_q15 * told_ratio / 32768 < 4)
    shaft.go(0).step(1500)
    assert shaft.swing(300) < 3 * CALM and abs(shaft.rpms[-1]) < (5 if told_ratio == 8 else 30)


@pytest.mark.parametrize("hz, load_ratio", ((0, 0), (40, 0.5), (700, 1.0)))
def test_what_a_drive_does_otherwise_is_none(c, hz, load_ratio):
    """Ramps, load steps with rated torque, reversals, and a host's sine from 1 to 400 Hz."""
    shaft = Shaft(c, hz, load_ratio)
    for rpm, load_nm in ((2000, 0.0), (2000, 0.27), (2000, -0.27), (-2000, 0.0), (-2000, 0.27), (0, 0.0)):
        shaft.load_nm = load_nm
        shaft.go(rpm).step(400)
    begun = len(shaft.demands)
    shaft.step(1200, lambda ms: 60 * math.sin(math.pi * (2 * 10**-3 * (ms - begun) + 0.33e-3 * (ms - begun)**2)))
    assert shaft.speed.oscillation.found == 0 and shaft.speed.kp_q16 == shaft.t.speed_kp_q16


def test_where_less_is_not_allowed_it_is_only_counted(c):
    shaft = Shaft(c, 300, 6.0)
    c.speed_loop_allow_less(shaft.speed, False)
    shaft.go(1500).step(600)
    assert shaft.speed.oscillation.found > 5 and shaft.speed.oscillation.answered == 0
    assert shaft.speed.kp_q16 == shaft.t.speed_kp_q16 and not shaft.speed.notch.on
    assert shaft.speed.oscillation.hz == pytest.approx(300, rel=0.1)


def world_with(c, choice=None, state="OPERATION_ENABLED"):
    w = World(c)
    if choice:
        assert w.choose("OSCILLATION", choice).error == c.ERROR_NONE
    c.supervision_begin(w.axis)
    w.put(state)
    return w


def find(w, hz=237):
    w.axis.speed.oscillation.found += 1
    w.axis.speed.oscillation.hz = hz
    w.c.speed_watch_step(w.axis)
    w.c.reaction_step(w.axis)


@pytest.mark.parametrize("choice, ends", ((None, False), ("CARRY", False), ("WARN", False), ("OFF", True), ("STOP", True)))
def test_the_drive_says_it_and_reacts_as_chosen(c, choice, ends):
    w = world_with(c, choice)
    find(w)
    assert (w.fault == "OSCILLATION") == ends and c.fault_warned(w.axis.reports, c.FAULT_OSCILLATION) != ends
    if ends:
        assert w.axis.faults.detail[0] == 237


@pytest.mark.parametrize("state", ("OPERATION_ENABLED", "QUICK_STOP"))
def test_what_no_answer_ends_is_a_fault(c, state):
    w = world_with(c, state=state)
    w.axis.speed.oscillation.answered = 8
    find(w)
    assert w.fault == "OSCILLATION" and w.fabric.gate.CONTROL == 0


@pytest.mark.parametrize("choice, counts", ((None, False), ("WARN", True), ("OFF", True)))
def test_the_speed_loop_takes_less_only_if_that_was_chosen(c, choice, counts):
    w = World(c)
    if choice:
        assert w.choose("OSCILLATION", choice).error == c.ERROR_NONE
    w.fabric.adc.OFFSET_A = w.fabric.adc.OFFSET_B = w.fabric.adc.OFFSET_C = 32768
    w.axis.loop.vbus_q15 = 13670
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    assert w.step() == "SWITCHED_ON" and not w.axis.speed.oscillation.only_counts, "identify may"
    w.axis.start.aligned = True  # found by this very start, which goes on
    assert w.step(129) == "OPERATION_ENABLED" and w.axis.speed.oscillation.only_counts == counts
