# SPDX-License-Identifier: MIT
"""Random switching, and random faults of the wiring: whatever happens, currents stay finite and sum to zero, and energy is
neither made nor lost. Each account is kept where it arises; nothing is known here of how the bridge works."""
import math
import random

import numpy as np
import pytest

from twin.bench import ALL_LOW, INVERTER, MOTOR, Bridge, Plant, c, currents, high, low, motor, near

RUNS, PIECES = 25, 200
LOSSLESS = {"r_on_ohm": 0, "diode_v": 0, "supply_resistance_ohm": 1e6}  # next to nothing comes from the supply


def any_gates(draw, faulty=False):
    """Any combination but both switches of a leg, and that at times."""
    gates = sum(draw.choice((0, high(k), low(k), low(k))) for k in range(3))
    return gates | high(0) | low(0) if faulty and draw.randrange(60) == 0 else gates


def motor_open_j(m):
    """Terminals = copper + air gap + magnetic field."""
    return m.energy_in_j - m.energy_copper_j - m.energy_airgap_j - c.motor_magnetic_energy_j(m)


def kinetic_j(m):
    return 0.5 * MOTOR["inertia_kgm2"] * m.speed_rad_s**2


def capacitor_j(inv):
    return 0.5 * inv.p.bus_capacitance_f * inv.bus_v**2


def any_fault(b, draw):
    k = draw.randrange(3)
    fault = draw.randrange(60)
    if fault == 0:
        c.inverter_short(b.inv, k, (k + 1) % 3, draw.uniform(0.01, 10))
    elif fault == 1:
        c.inverter_short_off(b.inv)
    elif fault == 2:
        c.motor_spin(b.m, draw.uniform(-1000, 1000))
    elif fault == 3:
        c.motor_release(b.m)


@pytest.mark.parametrize("changes, faults, within_j", [
    (LOSSLESS, False, 1e-5), ({}, False, 1e-5), ({"supply_sinks": 0}, False, 1e-5), ({}, True, 1e-3)],
    ids=["lossless", "supply that sinks", "rectifier supply", "shorts and shoot-through"])
def test_the_motor_on_random_gates(changes, faults, within_j):
    draw, largest, copper = random.Random(1), 0, 0
    for _ in range(RUNS):
        b = Bridge(**changes)
        b.m.speed_rad_s = draw.uniform(-1000, 1000)
        rotor_j, bus_j = kinetic_j(b.m), capacitor_j(b.inv)
        for _ in range(PIECES):
            if faults:
                any_fault(b, draw)
            b.gates(any_gates(draw, faults))
            b.advance(draw.uniform(1e-9, 40e-6))
            i = np.array((*currents(b.m), *b.legs(), b.inv.bus_v))
            assert np.isfinite(i).all() and abs(i[3:6].sum()) < 1e-9
            largest = max(largest, np.abs(i[:3]).max())
        assert motor_open_j(b.m) == near(0, within_j)
        copper = max(copper, b.m.energy_copper_j)
        from_bus_j, in_bridge_j = bus_j - capacitor_j(b.inv), b.inv.energy_bridge_j - b.m.energy_in_j
        if changes is LOSSLESS:  # of a turnover of some joules: what second-order steps of the bus leave
            open_j = (in_bridge_j, from_bus_j - b.inv.energy_bridge_j, kinetic_j(b.m) - rotor_j - b.m.energy_airgap_j)
            assert open_j == near(np.zeros(3), 1e-3)
        elif not faults:
            assert in_bridge_j >= 0 and b.inv.energy_supply_j + from_bus_j >= b.inv.energy_bridge_j, "they only lose"
    assert 20 < largest < 300 and 0.2 < copper < 30


def test_a_wire_that_breaks_under_current():
    """It takes the field's energy with it (there is no arc), so only the flow is checked."""
    draw = random.Random(2)
    for _ in range(RUNS):
        b = Bridge()
        b.m.speed_rad_s = draw.uniform(-1000, 1000)
        for _ in range(PIECES):
            if draw.randrange(40) == 0:
                c.inverter_open_wire(b.inv, draw.randrange(3), draw.randrange(2))
            b.gates(any_gates(draw))
            b.advance(draw.uniform(1e-9, 40e-6))
            assert abs(b.legs().sum()) < 1e-9
            assert all(abs(i) < 1e-6 for i, wire_open in zip(currents(b.m), b.inv.wire_open) if wire_open)


# ---- any bridge, any switching, any fault, and all of it at once ----

def any_params(draw):
    def maybe(low_, high_):
        return draw.uniform(low_, high_) if draw.randrange(3) else 0
    battery = draw.randrange(2)
    return {**INVERTER, "supply_resistance_ohm": draw.uniform(0.01, 0.5), "supply_sinks": draw.randrange(2),
            "supply_inductance_h": maybe(1e-7, 1e-4), "supply_r2_ohm": battery * draw.uniform(0.01, 0.1),
            "supply_c2_f": battery * draw.uniform(0.01, 10), "rectifier_hz": maybe(40, 70),
            "bus_capacitance_f": draw.uniform(20e-6, 2e-3), "bus_esr_ohm": maybe(1e-3, 0.3), "chopper_ohm": maybe(0.5, 10),
            "chopper_off_v": 27, "chopper_on_v": draw.uniform(27, 32), "switch_v": maybe(0, 1.5), "diode_ohm": maybe(0, 0.1),
            "coss_c": maybe(1e-9, 400e-9), "oc_trip_a": draw.uniform(20, 100), "oc_blanking_s": maybe(0, 10e-6),
            "oc_delay_s": maybe(0, 5e-6)}


def any_wiring(b, draw):
    k, fault = draw.randrange(3), draw.randrange(60)
    if fault < 4:
        any_fault(b, draw)
    further = {4: (c.inverter_open_wire, k, draw.randrange(2)), 5: (c.inverter_swap_wires, k, (k + 1) % 3),
               6: (c.inverter_swap_off,), 7: (c.inverter_chopper, draw.randrange(2)),
               8: (lambda inv, sinks: setattr(inv.p, "supply_sinks", sinks), draw.randrange(2))}
    if fault in further:
        function, *arguments = further[fault]
        function(b.inv, *arguments)


@pytest.mark.parametrize("faulty", [False, True])
def test_any_bridge(faulty):
    draw = random.Random(3)
    for _ in range(40):
        params = any_params(draw)
        assert c.inverter_mismatch(c.inverter_params(**params)) is None
        ld = draw.choice((25e-6, 0.3e-3))
        b = Bridge(params, motor(ld_h=ld, lq_h=1.4 * ld))
        c.motor_spin(b.m, draw.uniform(-1000, 1000))

        def stored_j():
            return c.supply_stored_j(b.inv.supply, b.inv.p) + c.coss_stored_j(b.inv)
        before_j = stored_j()
        for _ in range(150):
            if faulty:
                any_wiring(b, draw)
            b.gates(any_gates(draw, faulty))
            b.advance(draw.uniform(1e-9, 40e-6))
            legs, inv = b.legs(), b.inv
            assert math.isfinite(legs.sum() + inv.bus_v + inv.supply.feed_a + sum(inv.node[k].v for k in range(3)))
            assert abs(legs.sum()) < (1e-7 if faulty else 1e-9)
            if inv.short_from < 0:
                assert all(abs(legs[k]) < 1e-6 for k in range(3) if inv.wire_open[k]), "open wires carry nothing"
        if not faulty:
            s = b.inv.supply
            open_j = (b.m.energy_in_j + s.heat_j + s.chopper_j + b.inv.energy_conduction_j + b.inv.energy_edges_j
                      + b.inv.energy_switching_j - b.inv.energy_supply_j + stored_j() - before_j)
            assert abs(open_j) < 2e-3 * (abs(b.inv.energy_bridge_j) + abs(b.inv.energy_supply_j) + 0.1)


# ---- every effect of the power stage on, while the drive motors and brakes ----

FULL = {**INVERTER, "supply_resistance_ohm": 0.03, "supply_inductance_h": 1e-6, "supply_r2_ohm": 0.02, "supply_c2_f": 1,
        "bus_esr_ohm": 0.02, "chopper_ohm": 4, "chopper_on_v": 28, "chopper_off_v": 26, "switch_v": 0.1, "diode_v": 0.12,
        "diode_ohm": 0.01, "switching_s": 60e-9, "coss_c": 115e-9, "turn_on_delay_s": 120e-9, "turn_off_delay_s": 150e-9,
        "oc_trip_a": 100, "oc_blanking_s": 2e-6}
OPEN = 1e-4  # of what passed, both ways


@pytest.mark.parametrize("inverter, ld_h", [
    *(({**FULL, **changes}, ld_h) for ld_h in (0.3e-3, 27e-6)
      for changes in ({}, {"rectifier_hz": 50}, {"rectifier_hz": 50, "supply_inductance_h": 0})),
    ({**INVERTER, "coss_c": 115e-9}, 0.3e-3)])
def test_balance(inverter, ld_h):
    """Spun at a speed whose EMF is half the bus, with a vector that drives, brakes or hardly does either."""
    p = Plant(motor={"ld_h": ld_h, "lq_h": 1.3 * ld_h}, inverter=inverter)
    c.motor_spin(p.motor, 250)
    inv, m = p.inverter, p.motor

    def sides_j():
        """Left open on either side of the bridge's terminals."""
        s = inv.supply
        return np.array((inv.energy_supply_j - s.heat_j - s.chopper_j - inv.energy_bridge_j - c.supply_stored_j(s, inv.p),
                         inv.energy_bridge_j - inv.energy_conduction_j - inv.energy_edges_j - inv.energy_switching_j
                         - c.coss_stored_j(inv) - m.energy_in_j))
    before, passed_j, braking_j = sides_j(), 0, 0
    for n in range(1000):
        bridge_j, share = inv.energy_bridge_j, (0.85, 0.62, 0.42)[n // 100 % 3]
        rad = 4 * m.theta_rad + math.pi / 2
        p.legs(*(round(2500 + 2300 * share * math.cos(rad - k * 2 * math.pi / 3)) for k in range(3)))
        p.run(50e-6)
        period_j = inv.energy_bridge_j - bridge_j
        passed_j, braking_j = passed_j + abs(period_j), braking_j + max(-period_j, 0)
    assert sides_j() - before == near(np.zeros(2), OPEN * passed_j)
    assert inv.energy_edges_j > 3 * OPEN * passed_j and inv.energy_conduction_j > 100 * OPEN * passed_j
    assert (inv.energy_switching_j > 10 * OPEN * passed_j) == ("switching_s" in inverter) and braking_j > 0.01 * passed_j


@pytest.mark.parametrize("ld_h", [0.3e-3, 27e-6])
def test_against_slices(ld_h):
    """The same in slices of 10 ns, in which every current is a straight line."""
    whole = Bridge({**FULL, "turn_on_delay_s": 0, "turn_off_delay_s": 0}, motor(ld_h=ld_h, lq_h=1.3 * ld_h))
    c.motor_spin(whole.m, 50)
    sliced = whole.copied()
    b_low = ALL_LOW ^ low(1)
    for _ in range(40):
        for gates, duration_s in ((b_low | high(1), 9e-6), (b_low, 1e-6), (ALL_LOW, 9e-6), (b_low, 1e-6)):
            whole.gates(gates)
            sliced.gates(gates)
            whole.advance(duration_s)
            for _ in range(round(duration_s / 10e-9)):
                sliced.advance(10e-9)
    assert whole.inv.energy_bridge_j == pytest.approx(sliced.inv.energy_bridge_j, rel=3e-4)
    assert whole.inv.bus_v == near(sliced.inv.bus_v, 2e-3) and whole.current(1) == pytest.approx(sliced.current(1), rel=1e-3)
