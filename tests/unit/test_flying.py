# SPDX-License-Identifier: MIT
"""The flying start's search on currents and voltages that somebody else makes: how long it looks, when it gives up, and how."""
import cmath
import math

import pytest

from rigs.searching import Searching, enough, regulating


def test_flying_pulses_grow_until_they_show_enough(c, searching):
    """Twice as long each time, up to the longest that fits, and then a whole period; what shows enough stays as it is."""
    flying = searching.axis.flying
    longest, lengths = c.emf_pulse_longest(searching.fabric.pwm), []
    assert longest == 1250 - 100 - 32
    first = flying.counts
    assert first == 100
    for _ in range(12):
        lengths.append(flying.counts)
        assert searching.look(100) == "SEARCHES"
    expected = [first]
    while expected[-1] < longest:
        expected.append(min(2 * expected[-1], longest))
    assert lengths[:len(expected) + 1] == expected + [5000]
    other = Searching(c)
    for _ in range(3):
        other.look(enough(other) + 2)
    assert other.axis.flying.counts == first


def test_flying_nothing_in_three_long_pulses_is_looked_at_without_current(c, searching):
    flying = searching.axis.flying
    while flying.counts != 5000:
        searching.look(0)
    quiet = [bool(searching.look(0) and flying.regulates) for _ in range(3)]
    assert quiet == [False, False, True] and searching.axis.loop.status_max == 1 and flying.ms == 0


@pytest.mark.parametrize("counts, result", ((100, "LOCK_LOST"), (5000, "NONE")))
def test_flying_gives_up_pulses_that_follow_no_rotor_after_40_ms(c, searching, counts, result):
    """Angles from anywhere: of short pulses it is a fault, of whole periods the voltage is to show more."""
    flying = searching.axis.flying
    flying.counts = counts
    for ms in range(1, 60):
        searching.look(cmath.rect(enough(searching) * 1.5, 2.4 * ms * ms))
        if searching.axis.faults.cause or flying.regulates:
            break
    assert ms == 41 and searching.axis.faults.cause == getattr(c, f"FAULT_{result}")
    assert flying.regulates == (result == "NONE")


@pytest.mark.parametrize("looks", (9, 10))
def test_flying_catches_a_rotor_that_ten_pulses_have_followed(c, searching, looks):
    """One after the other as a steady speed has it: here a current that stands, of an EMF that stands."""
    current = cmath.rect(enough(searching) * 1.5, math.radians(50))
    results = [searching.look(current) for _ in range(looks + 1)]
    assert results[-1] == ("CAUGHT" if looks == 10 else "SEARCHES")
    if looks == 10:
        assert searching.fabric.gate.CONTROL == 1 and searching.axis.sensorless.step == 0
        emf = (searching.axis.loop.pll.angle_q32 + 2**30) % 2**32 / 2**32 * 360
        assert emf == pytest.approx(230, abs=1), "the current flows against the EMF, a quarter ahead of the rotor"


@pytest.mark.parametrize("size, whole", ((200, True), (201, False)))
def test_flying_lets_a_whole_period_show_no_more_than_is_wanted(searching, size, whole):
    """The longest pulse is less than a quarter of it: what there is, four times."""
    flying = searching.axis.flying
    searching.axis.tuning.i_max_q15, flying.counts = 29260, 1118
    assert enough(searching) == 800 and searching.look(size) == "SEARCHES"
    assert (flying.counts, flying.track.looks) == ((5000, 0) if whole else (1118, 1))


@pytest.mark.parametrize("speed_q32", (3_000_000, -3_000_000))
def test_flying_goes_on_with_what_somebody_else_knows_of_the_rotor(c, searching, speed_q32):
    """At the next sample it is at that angle, and turns so; the gates are open."""
    loop = searching.axis.loop
    c.flying_resume(searching.axis, 0x12345678, speed_q32)
    off = (loop.pll.angle_q32 - 0x12345678 + 2**31) % 2**32 - 2**31
    assert abs(off) < 16 and loop.pll.speed_q32 == speed_q32 and searching.fabric.gate.CONTROL == 1
    rpm = speed_q32 / 2**32 * 20000 * 60 / 4
    assert searching.axis.speed.speed_rpm_q4 == pytest.approx(16 * rpm, abs=2)
    assert searching.axis.sensorless.ref_rpm_q16 == pytest.approx(65536 * rpm, rel=1e-3)


@pytest.mark.parametrize("size, seen", ((310, False), (315, True), (600, True)))
def test_flying_looks_at_voltages_from_a_128th_of_the_bus_on(searching, size, seen):
    regulating(searching, size, 0)
    for _ in range(10):
        searching.look()
    assert (searching.axis.flying.track.looks > 0) == seen


@pytest.mark.parametrize("size", (0, 300))
def test_flying_stands_after_32_ms_without_a_voltage(searching, size):
    regulating(searching, size, 0)
    assert [searching.look() for _ in range(33)] == ["SEARCHES"] * 32 + ["STANDS"] and searching.axis.flying.track.looks == 0


@pytest.mark.parametrize("size, caught", ((40000 // 32 + 10, True), (40000 // 32 - 10, False)))
def test_flying_catches_a_voltage_that_is_surely_an_emf(searching, size, caught):
    """3 % of the bus: eight good looks behind the first two, from the fourth millisecond on. Less that stands is none."""
    regulating(searching, 0, size)
    results = [searching.look() for _ in range(33)]
    assert results[:12] == ["SEARCHES"] * 12 and results[12] == ("CAUGHT" if caught else "SEARCHES")
    if not caught:
        assert "CAUGHT" not in results and results[-1] == "STANDS"
