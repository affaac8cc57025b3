# SPDX-License-Identifier: MIT
"""The supply and what stands on the bus, without a bridge: a load that steps, against an integration in small steps, and closed
forms of each part."""
import math

import numpy as np
import pytest

from twin.bench import INVERTER, c, near

STAGE = {**INVERTER, "vbus_v": 300, "supply_resistance_ohm": 0.3, "bus_capacitance_f": 200e-6}
R, C = 0.3, 200e-6
FULL = {"bus_esr_ohm": 0.1, "supply_inductance_h": 50e-6, "supply_r2_ohm": 0.5, "supply_c2_f": 2e-3}
ONE_WAY = {**FULL, "supply_sinks": 0}


class Supply:
    def __init__(self, **changes):
        self.p, self.s, self.source_j, self.bridge_j = c.inverter_params(**{**STAGE, **changes}), c.supply(), 0, 0
        c.supply_init(self.s, self.p)

    def run(self, load_a, duration_s):
        """As the bridge does, in steps of 2 us."""
        load = c.bridge_load(load_a, 0)
        for _ in range(round(duration_s / 2e-6)):
            flow = c.supply_step(self.s, self.p, load, c.supply_view(self.s, self.p, load, 2e-6), 2e-6)
            self.source_j += flow.source_j
            self.bridge_j += flow.bus_v * load_a * 2e-6
        return self.v(load_a)

    def v(self, load_a=0.0):
        return c.supply_bus_v(self.s, self.p, c.bridge_load(load_a, 0))

    def stored_j(self):
        return c.supply_stored_j(self.s, self.p)


class Small:
    """The same in small steps."""
    def __init__(self, **changes):
        none = dict.fromkeys(("rectifier_hz", "supply_inductance_h", "bus_esr_ohm", "supply_c2_f", "chopper_ohm"), 0)
        p = {**none, **STAGE, **changes}
        self.p, self.cap_v, self.feed_a, self.slow_v, self.t_s, self.chopper = p, p["vbus_v"], 0.0, 0.0, 0.0, False

    def bus_v(self, load_a, feed_a):
        share = self.p["bus_esr_ohm"] / self.p["chopper_ohm"] if self.chopper else 0
        return (self.cap_v + self.p["bus_esr_ohm"] * (feed_a - load_a)) / (1 + share)

    def step(self, load_a, dt):
        p = self.p
        drive_v = p["vbus_v"] - self.slow_v
        if p["rectifier_hz"]:  # the highest of six line-to-line voltages, of which two cross at t = 0
            rad = 2 * math.pi * p["rectifier_hz"] * self.t_s - math.pi / 6
            drive_v = p["vbus_v"] * math.cos(math.remainder(rad, math.pi / 3))
        if p["supply_inductance_h"]:
            self.feed_a += dt / p["supply_inductance_h"] * (
                drive_v - p["supply_resistance_ohm"] * self.feed_a - self.bus_v(load_a, self.feed_a))
        else:
            esr = self.bus_v(0, 1) - self.bus_v(0, 0)
            self.feed_a = (drive_v - self.bus_v(load_a, 0)) / (p["supply_resistance_ohm"] + esr)
        if p["rectifier_hz"] or not p["supply_sinks"]:
            self.feed_a = max(self.feed_a, 0.0)
        u = self.bus_v(load_a, self.feed_a)
        self.cap_v += dt / p["bus_capacitance_f"] * (self.feed_a - load_a - (u / p["chopper_ohm"] if self.chopper else 0))
        if p["supply_c2_f"]:
            self.slow_v += dt / p["supply_c2_f"] * (self.feed_a - self.slow_v / p["supply_r2_ohm"])
        if p["chopper_ohm"]:
            self.chopper = u > (p["chopper_off_v"] if self.chopper else p["chopper_on_v"])
        self.t_s += dt


@pytest.mark.parametrize("changes, within_v", [
    ({"bus_esr_ohm": 0.1}, 0.02), ({"bus_esr_ohm": 0.1, "supply_inductance_h": 50e-6}, 0.03), (FULL, 0.03), (ONE_WAY, 0.2),
    ({**ONE_WAY, "chopper_ohm": 15, "chopper_on_v": 305, "chopper_off_v": 301}, 0.3), ({"rectifier_hz": 50}, 0.1),
    ({"rectifier_hz": 50, "supply_inductance_h": 2e-3, "bus_esr_ohm": 0.05}, 0.3)],
    ids=["capacitor's resistance", "inductance", "slow branch", "no way back", "chopper", "rectifier", "with a choke"])
def test_against_small_steps(changes, within_v):
    """Loads of up to 20 A both ways for 4 ms; the worst difference of the bus, and what the energies leave open."""
    s, x, draw, seen = Supply(**changes), Small(**changes), np.random.default_rng(1), []
    before_j, dt = s.stored_j(), 1e-7
    for load_a in draw.uniform(-8, 20, 40):
        for _ in range(1000):
            x.step(load_a, dt)
        seen.append(s.run(load_a, 1000 * dt))
        assert seen[-1] == near(x.bus_v(load_a, x.feed_a), within_v)
    assert max(seen) - min(seen) > 20 * within_v, "the bus moved by more than the tolerance"
    open_j = s.source_j + before_j - s.stored_j() - s.s.heat_j - s.s.chopper_j - s.bridge_j
    assert abs(open_j) < 1e-5 * abs(s.bridge_j) and 1e-3 < s.s.heat_j < 10


@pytest.mark.parametrize("inductance_h, of", [(0, 0.3 / 0.4), (10e-6, 1)])
def test_a_load_step_shows_at_once(inductance_h, of):
    """By the capacitor's resistance beside the supply's; behind an inductance all of it."""
    s = Supply(bus_esr_ohm=0.1, supply_inductance_h=inductance_h)
    assert s.v(0) - s.v(10) == near(10 * 0.1 * of, 1e-9)


def test_ringing():
    """Underdamped L and C after a load step: v - 300 + r i = e^-at (A cos wt + B sin wt), v(0) = 300, dv/dt(0) = -i/c."""
    s, i, damping = Supply(supply_inductance_h=100e-6), 10, R / (2 * 100e-6)
    w = math.sqrt(1 / (100e-6 * C) - damping**2)
    for n in range(1, 101):
        t = n * 10e-6
        v = 300 - R * i + math.exp(-damping * t) * (R * i * math.cos(w * t) + (damping * R * i - i / C) / w * math.sin(w * t))
        assert s.run(i, 10e-6) == near(v, 2e-3)


def test_battery():
    """R at once, R2 slowly: the capacitor's 60 us are over, the slow branch has 10 ms."""
    s = Supply(supply_r2_ohm=0.2, supply_c2_f=0.05)
    for n in range(1, 5):
        assert s.run(20, 5e-3) == near(300 - 20 * R - 20 * 0.2 * (1 - math.exp(-n * 0.5)), 0.05)


def test_rectifier():
    """Nothing drawn: the capacitor keeps the peak, and what comes back. With next to no capacitor: the pulses themselves."""
    s = Supply(rectifier_hz=50)
    assert s.run(0, 20e-3) == near(300, 0.1)
    s.run(-5, 2e-3)
    assert s.v() == near(300 + 5 * 2e-3 / C, 0.5)
    s = Supply(rectifier_hz=50, bus_capacitance_f=1e-6)
    s.run(30, 10e-3)
    v = [s.run(30, 20e-6) for _ in range(1000)]
    assert max(v) == near(300 - 30 * R, 0.05) and min(v) == near(300 * math.cos(math.pi / 6) - 30 * R, 0.1)
    assert np.mean(v) == near(300 * 3 / math.pi - 30 * R, 0.05)


def test_chopper():
    """The motor brakes with 5 A into a bus that nobody relieves: up by i/C to the upper level, and down through the
    resistor."""
    i, on_v, off_v, r = 5, 380, 360, 40
    s, times, highest = Supply(supply_sinks=0, chopper_ohm=r, chopper_on_v=on_v, chopper_off_v=off_v), [], 0
    for n in range(20_000):
        was = s.s.chopper_on
        highest = max(highest, s.run(-i, 2e-6))
        if s.s.chopper_on != was:
            times.append(n * 2e-6)
        if len(times) == 4:
            break
    down = r * C * math.log((on_v - r * i) / (off_v - r * i))
    assert np.diff(times[:3], prepend=0) == near(np.array(((on_v - 300) * C / i, down, (on_v - off_v) * C / i)), 5e-6)
    assert highest == near(on_v, 0.1)
    assert s.s.chopper_j + s.stored_j() - 0.5 * C * 300**2 == pytest.approx(-s.bridge_j, rel=1e-6), "what came back is in it"
    s.s.chopper_enabled = False
    assert s.run(-i, 4e-3) > 450 and not s.s.chopper_on


@pytest.mark.parametrize("sinks", [True, False])
def test_the_plain_bus_in_closed_form(sinks):
    """Against many small steps of C dv/dt = (supply - v) / R - i, for both kinds of supply."""
    draw, steps = np.random.default_rng(2), 20_000
    r, cap, v0, i, dt = draw.uniform((0.02, 10e-6, 20, -30, 1e-6), (1, 1e-3, 28, 30, 1e-4), (200, 5)).T
    v = v0.copy()
    for _ in range(steps):
        feed = (24 - v) / r
        v += dt / steps * ((feed if sinks else np.maximum(feed, 0)) - i) / cap
    found = [c.bus_voltage_after(c.bus(24, *one, sinks), *rest) for one, rest in zip(zip(r, cap), zip(v0, i, dt))]
    assert found == near(v, 0.01)
    assert c.bus_voltage_after(c.bus(24, 0, 1e-3, sinks), 24, 50, 1e-3) == 24
