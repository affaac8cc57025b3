# SPDX-License-Identifier: MIT
"""The verilated RTL on the twin's bench, its currents from modulators: results against the true current, and how soon the fast
path has the gates off."""
import math

import pytest
from places import REGISTERS

from twin.bench import ADC, GATE, PWM, Plant, c, currents, ps, signed, triple

ON, BIT_S, RANGE_A, TRIP_A = 0x9, 50e-9, 25, 15  # ENABLE, MODULATORS
RASTER_S = 16 * BIT_S  # of the fast path; three times as many bits make a result
LATENCY_S = 13 * 10e-9  # of bits through flip-flops, filter, comparison


def with_modulators(on):
    return Plant(on, sensors={"modulators": 1, "modulator_noise": 6.6e-4}, seed=3, rtl=REGISTERS / "axis.so")


@pytest.mark.parametrize("modulator, osr, bound_a", [(0x510, 32, 0.03), (0x511, 64, 0.01), (0x512, 128, 0.01)])
def test_results_are_the_current_in_the_middle_of_their_window(modulator, osr, bound_a):
    p, window_s = with_modulators((2900, 2500, 2200)), 3 * osr * BIT_S
    p.write(PWM.TRIGGER_1, 2500 - round(window_s / 2 / 10e-9) | 1 << 17)
    p.write(ADC.MODULATOR, modulator)
    p.write(ADC.CONTROL, ON)
    errors, largest_a = [], 0
    for n in range(80):
        p.to(p.next_trigger() + ps(window_s / 2))
        true_a = currents(p.motor)[0]
        before = p.read(ADC.SEQUENCE)
        while p.read(ADC.SEQUENCE) == before:
            p.run(0.1e-6)
        p.write(ADC.STATUS, 1)
        if n > 2:
            errors.append(signed(p.read(ADC.IA)) / 32768 * RANGE_A - true_a)
            largest_a = max(largest_a, abs(true_a))
    assert 0.3 < largest_a < 20 and math.sqrt(sum(error**2 for error in errors) / len(errors)) < bound_a


def trip_s(ohm, after_s, limit):
    """From the instant at which a phase's current passes 15 A to the gates; None: they stay. The short, of `ohm` between two
    legs, comes so much after some instant of the modulators' clock."""
    p = with_modulators((4000, 1000, 2500))
    p.write(ADC.MODULATOR_TRIP, limit)
    p.write(ADC.CONTROL, ON)
    p.run(30e-6)
    p.write(ADC.STATUS, 1)
    p.run(30e-6 + after_s)  # A high, B low
    assert p.read(GATE.STATUS) == 1, "quiet before"
    c.inverter_short(p.inverter, 0, 1, ohm)
    beyond = None
    for n in range(5000):
        p.run(10e-9)
        if beyond is None and abs(triple(c.inverter_leg_currents, p.inverter, p.motor)[:2]).max() > TRIP_A:
            beyond = n
        if p.gates == 0:
            p.run(1e-6)
            assert p.read(GATE.STATUS) & 2 and p.read(ADC.STATUS) & 0x100 and p.read(GATE.CONTROL) == 0
            return (n - beyond) * 10e-9
    return None


@pytest.mark.parametrize("ohm", (0.2, 1.3), ids=("120 A", "18 A"))
def test_the_fast_path_trips_wherever_in_its_raster_a_short_comes(ohm):
    times = [trip_s(ohm, n * RASTER_S / 8, round(TRIP_A / RANGE_A * 32768)) for n in range(8)]
    assert all(0.3e-6 < one < 4 * RASTER_S + LATENCY_S for one in times)
    assert max(times) - min(times) > 0.3 * RASTER_S, "where in the raster tells"


def test_without_a_limit_it_does_not():
    assert trip_s(0.2, 0, 0x1FFFF) is None
