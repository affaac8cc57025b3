# SPDX-License-Identifier: MIT
"""The bridge at switch level, with a motor on it: dead time, delays, diodes, drops and their heat, output charge, comparators,
and what can happen to the motor's cable. Cases small enough for a closed form; random ones are in test_energy.py."""
import ctypes
import math

import numpy as np
import pytest

from twin.bench import (A_HIGH_BC_LOW, ALL_LOW, BC_LOW, GATE, MOTOR, NEVER, STIFF, Bridge, Plant, c, currents, high, low, motor,
                        near, ps)

R, LD, BUS_V, PERIOD_S = 0.3, 0.3e-3, 24, 50e-6


def size(m):
    return math.hypot(m.i_d_a, m.i_q_a)


# ---- dead time and delays ----

@pytest.mark.parametrize("on_a, on_bc, on_s, off_s", [(2800, 2400, 0, 0), (2400, 2800, 0, 0), (2800, 2400, 300e-9, 100e-9),
                                                      (2400, 2800, 100e-9, 250e-9)])
def test_dead_time(on_a, on_bc, on_s, off_s):
    """Mean voltage against the star point once the currents are steady. While both switches are off, a leg whose current flows
    out of it lies one diode below the lower rail, and one diode above the upper rail if it flows in: the current keeps its
    sign."""
    p = Plant((on_a, on_bc, on_bc), inverter={**STIFF, "turn_on_delay_s": on_s, "turn_off_delay_s": off_s})
    c.motor_lock(p.motor, True)
    p.run(0.02)
    out_of_a, off, row, i = on_a > on_bc, 2 * (1e-6 + on_s - off_s), p.row, p.row.i_a[0]
    below, above = -0.8, BUS_V + 0.8
    leg = [((on * 10e-9 + off_s - on_s) * BUS_V + off * (below if out else above) - 5e-3 * own * (PERIOD_S - off)) / PERIOD_S
           for on, out, own in ((on_a, out_of_a, i), (on_bc, not out_of_a, -i / 2))]
    assert row.v_mean_v[0] == near(2 / 3 * (leg[0] - leg[1]), 1e-3), "1 mV: the ripple of the current on the switches' 5 mohm"
    assert row.v_mean_v[1] == near(-row.v_mean_v[0] / 2, 1e-6) and (i > 0) == out_of_a and abs(i) > 1


def test_delays():
    b = Bridge(turn_on_delay_s=300e-9, turn_off_delay_s=100e-9)
    b.gates(high(0))
    assert c.inverter_next_switch(b.inv) == 300_000
    for later_s, gates, conducts in ((299e-9, None, 0), (2e-9, None, 1), (0, 0, 1), (99e-9, None, 1), (2e-9, None, 0)):
        if gates is not None:
            b.gates(gates)
        b.advance(later_s)
        assert b.inv.conduct == (high(0) if conducts else 0)
    b.gates(high(0))
    b.advance(200e-9)
    b.gates(0)
    assert c.inverter_next_switch(b.inv) == NEVER, "too short a pulse is cancelled"


# ---- diodes ----

def test_freewheeling():
    """Lower diode of A, upper diodes of B and C: -(2/3)(bus + 2 V_diode) drives the current through R and Ld to zero, where the
    diodes end it."""
    tau, v = LD / R, 2 / 3 * (BUS_V + 1.6)
    zero_s, b = tau * math.log(1 + R * 8 / v), Bridge(STIFF, locked=True)
    c.motor_set_current(b.m, 8, 0)
    b.gates(A_HIGH_BC_LOW)
    b.gates(0)
    b.advance(10e-6)
    assert b.current() == near((8 + v / R) * math.exp(-10e-6 / tau) - v / R, 1e-5)
    assert b.inv.leg[:2] == [c.LEG_DIODE_LO, c.LEG_DIODE_HI]
    b.advance(zero_s - 10e-6 - 10e-9)
    assert 0.2 < b.current() / (v / LD * 10e-9) < 2
    for later_s in (20e-9, 1e-3):
        b.advance(later_s)
        assert size(b.m) < 1e-12
    assert b.inv.leg[:] == [c.LEG_BLOCKED] * 3


def speed_for(v):
    """At which the line-to-line EMF peaks at v."""
    return v / (math.sqrt(3) * MOTOR["flux_wb"] * 4)


@pytest.mark.parametrize("share, least, most", [(0.999, 0, 1e-12), (1.01, 0.01, 1)])
def test_the_diodes_rectify(share, least, most):
    b, largest = Bridge(), 0
    c.motor_spin(b.m, speed_for(share * (BUS_V + 1.6)))
    for _ in range(1000):
        b.advance(20e-6)
        largest = max(largest, size(b.m))
    assert least <= largest <= most
    assert (b.m.energy_airgap_j < 0 and b.inv.energy_supply_j < 0) == (share > 1), "it brakes, and the supply takes it"


def test_the_bus_follows_the_emf_up():
    b = Bridge(supply_sinks=0, vbus_v=38, bus_capacitance_f=50e-6)
    c.motor_spin(b.m, speed_for(40))
    b.advance(0.1)
    assert b.inv.bus_v == near(40 - 1.6, 0.03)
    c.motor_spin(b.m, speed_for(20))
    b.advance(0.001)
    kept_v = b.inv.bus_v
    b.advance(0.05)
    assert b.inv.bus_v == near(kept_v, 1e-9)


def test_the_bus_s_charge():
    """Nothing supplied: what the bridge draws comes from the capacitor's charge."""
    b, charge_as = Bridge(supply_resistance_ohm=1e3, locked=True), 0
    b.gates(A_HIGH_BC_LOW)
    for _ in range(500):
        before = b.current()
        b.advance(1e-6)
        charge_as += (before + b.current()) / 2 * 1e-6
    assert BUS_V - b.inv.bus_v == near(charge_as / 1e-3, 1e-3)
    b.gates(ALL_LOW)
    held_v = b.inv.bus_v
    b.advance(100e-6)
    assert b.inv.bus_v == near(held_v, 1e-3), "a freewheeling current takes none"


# ---- drops: the current is held by a large inductance, i into A, half of it out of B and of C ----

SWITCH_V, R_ON, DIODE_V, DIODE_OHM = 1.1, 0.02, 0.9, 0.03


def drops(i, gates, of_a_v, drop_a_v, drop_bc_v):
    b = Bridge(STIFF, motor(ld_h=100, lq_h=100, flux_wb=0), True, r_on_ohm=R_ON, switch_v=SWITCH_V, diode_v=DIODE_V,
               diode_ohm=DIODE_OHM, oc_trip_a=100)
    c.motor_set_current(b.m, i, 0)
    b.gates(A_HIGH_BC_LOW)
    b.gates(gates)
    b.advance(1e-9)  # the drop follows the current of the last step
    before_vs, heat_j = b.m.volt_alpha_vs, b.inv.energy_conduction_j
    b.advance(5e-6)
    assert (b.m.volt_alpha_vs - before_vs) / 5e-6 == near(2 / 3 * (of_a_v - math.copysign(drop_a_v + drop_bc_v, i)), 1e-4)
    assert (b.inv.energy_conduction_j - heat_j) / 5e-6 == pytest.approx(abs(i) * (drop_a_v + drop_bc_v), rel=1e-4, abs=1e-9)


@pytest.mark.parametrize("i", [3, -3, 20, -20, 60])
@pytest.mark.parametrize("gates", [A_HIGH_BC_LOW, 0, BC_LOW])
def test_drops(i, gates):
    """Backwards through a switch that is on flows an IGBT's diode current."""
    def diode(own):
        return DIODE_V + DIODE_OHM * abs(own)

    def on(own):
        return diode(own) if i < 0 else SWITCH_V + R_ON * abs(own)
    of_a_v = {A_HIGH_BC_LOW: BUS_V, 0: -BUS_V if i > 0 else BUS_V, BC_LOW: 0 if i > 0 else BUS_V}[gates]
    drops(i, gates, of_a_v, on(i) if gates == A_HIGH_BC_LOW else diode(i), on(i / 2) if gates else diode(i / 2))


@pytest.mark.parametrize("i", [0.5, 0])
def test_the_knee(i):
    """Within a hundredth of the trip level the constant drop falls to zero with the current: no jump at zero."""
    drops(i, A_HIGH_BC_LOW, BUS_V, i * (SWITCH_V + R_ON), i / 2 * (SWITCH_V + R_ON))


def test_decay_through_drops():
    b = Bridge(switch_v=SWITCH_V, oc_trip_a=100, locked=True)
    c.motor_set_current(b.m, 12, 0)
    b.gates(ALL_LOW)
    b.advance(50e-6)
    r = R + 5e-3 / 3  # A drops its diode's constant part in one direction, B and C a switch's in the other, beside R i
    end = -2 / 3 * (SWITCH_V + 0.8) / r
    assert b.current() == near(end + (12 - end) * math.exp(-50e-6 * r / LD), 2e-3)
    b.advance(5e-3)
    assert b.current() == near(0, 0.01)


# ---- output charge and hard edges ----

QOSS, DEAD_S = 115e-9, 1e-6


def ideal_bridge(coss_c, inductance_h, diode_v=0):
    machine = motor(ld_h=inductance_h, lq_h=inductance_h, resistance_ohm=0, flux_wb=0)
    return Bridge(STIFF, machine, True, coss_c=coss_c, r_on_ohm=0, diode_v=diode_v)


def cycle_error_v(b, high_s=20e-6):
    """A cycle of leg A with dead times, B and C low: its mean voltage against its ideal. A against the star point is two thirds
    of A against B and C."""
    before_vs = b.m.volt_alpha_vs
    low_s = PERIOD_S - high_s - 2 * DEAD_S
    for gates, duration_s in ((A_HIGH_BC_LOW, high_s), (BC_LOW, DEAD_S), (ALL_LOW, low_s), (BC_LOW, DEAD_S)):
        b.gates(gates)
        b.advance(duration_s)
    return 1.5 * (b.m.volt_alpha_vs - before_vs) / PERIOD_S - BUS_V * (high_s + DEAD_S) / PERIOD_S


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("of_corner", [0.02, 0.1, 0.3, 0.7, 0.95, 1.05, 1.5, 3, 10, 60])
def test_dead_time_with_output_charge(of_corner, way):
    """Both switches swing, so twice Qoss moves."""
    full_v, corner_a = BUS_V * DEAD_S / PERIOD_S, 2 * QOSS / DEAD_S
    i = way * of_corner * corner_a
    late = full_v * (1 - QOSS / abs(i) / DEAD_S) if of_corner >= 1 else full_v * DEAD_S * abs(i) / (4 * QOSS)
    for coss, expected_v, within in ((QOSS, late, 1e-3 * full_v), (0, full_v, 1e-9)):
        b = ideal_bridge(coss, 10)
        c.motor_set_current(b.m, i, 0)
        cycle_error_v(b)
        assert cycle_error_v(b) == near(-way * expected_v, within)


def test_hard_edges():
    """No current in any leg, 4 cycles: every edge is hard and turns Qoss vbus into heat, supplied by the bus."""
    b, one_j = ideal_bridge(QOSS, 1000), QOSS * BUS_V
    for _ in range(4):
        cycle_error_v(b)
    assert b.inv.energy_edges_j == near(8 * one_j, 0.01 * one_j) == near(b.inv.energy_supply_j, 0.01 * one_j)
    assert b.current() == near(0, 1e-3)
    b = Bridge(coss_c=QOSS, supply_resistance_ohm=1e3, bus_capacitance_f=10e-6)  # that nothing feeds
    b.gates(ALL_LOW)
    before_v = b.inv.bus_v
    b.gates(high(0) | high(1) | high(2))
    b.gates(ALL_LOW)
    assert (before_v - b.inv.supply.cap_v) * 10e-6 == pytest.approx(6 * QOSS, rel=5e-3)


@pytest.mark.parametrize("i", [4, -4, 20, 0])
def test_switching_heat(i):
    """Voltage and current together at the two hard edges that a leg has in a cycle, whichever way its current flows."""
    b = ideal_bridge(0, 10)
    b.inv.p.switching_s = 50e-9
    c.motor_set_current(b.m, i, 0)
    cycle_error_v(b)

    def out_of_the_bus_j():
        return b.inv.energy_bridge_j - b.inv.energy_conduction_j - b.inv.energy_edges_j - b.m.energy_in_j
    before_j, heat_j, expected_j = out_of_the_bus_j(), b.inv.energy_switching_j, 5 * BUS_V * abs(i) * 50e-9
    for _ in range(5):
        cycle_error_v(b)
    assert b.inv.energy_switching_j - heat_j == pytest.approx(expected_j, rel=1e-3, abs=1e-9)
    assert out_of_the_bus_j() - before_j == pytest.approx(expected_j, rel=0.01, abs=1e-9)


def swing(i, v, inductance_h, diode_v, duration_s):
    """Leg A lets go of i at the upper rail: L di/dt = 2/3 v, 2 C dv/dt = -i, diodes at the rails; in steps of 0.2 ns."""
    dt, node_f = 0.2e-9, 2 * QOSS / BUS_V
    for _ in range(round(duration_s / dt)):
        middle = i + dt / 3 * v / inductance_h
        v = min(max(v - dt * middle / node_f, -diode_v), BUS_V + diode_v)
        i = middle + dt / 3 * v / inductance_h
    return i, v


@pytest.mark.parametrize("i, inductance_h, duration_s, within_v", [
    (0.2, 1e-3, 0.5e-6, 0.03), (0.5, 1e-3, 0.9e-6, 0.03), (0.05, 27e-6, 0.4e-6, 0.3), (-0.15, 27e-6, 0.6e-6, 0.5),
    (0.2, 27e-6, 1.2e-6, 0.3)], ids=["going", "at the rail", "the current grows", "it turns round", "into the lower diode"])
def test_a_swing_in_which_the_current_changes(i, inductance_h, duration_s, within_v):
    b, diode_v = ideal_bridge(QOSS, inductance_h, 0.8), 0.8
    b.gates(BC_LOW | high(0))
    c.motor_set_current(b.m, i, 0)
    b.inv.energy_edges_j = 0
    b.gates(BC_LOW)
    b.advance(duration_s)
    expected_a, expected_v = swing(i, BUS_V, inductance_h, diode_v, duration_s)
    leg = b.inv.leg[0]
    v = b.inv.node[0].v if leg == c.LEG_SWING else -diode_v if leg == c.LEG_DIODE_LO else BUS_V + diode_v
    assert v == near(expected_v, within_v)
    assert b.current() == near(expected_a, within_v / math.sqrt(1.5 * inductance_h * BUS_V / (2 * QOSS)))
    assert b.inv.energy_edges_j == near(0, 1e-3 * QOSS * BUS_V), "it meets no switch"


def test_caught_at_the_rail():
    """Next to it, with hardly a current, but an EMF of 21 V that makes one. A node beyond it would have to be brought back by
    the diode, as heat."""
    b = Bridge(machine=motor(math.pi / 2, ld_h=27e-6, lq_h=27e-6), coss_c=QOSS)
    c.motor_spin(b.m, 700)
    b.gates(ALL_LOW)
    b.m.i_q_a = -0.001
    b.gates(BC_LOW)
    edges_j = b.inv.energy_edges_j
    b.advance(0.5e-6)
    assert b.inv.leg[0] == c.LEG_DIODE_LO and b.inv.energy_edges_j == near(edges_j, 1e-3 * QOSS * BUS_V)


def test_the_ringing_ends():
    """A current too small to reach a rail at once: the ringing, 4 us, ends after one of its periods and costs nothing any
    more."""
    b = Bridge(machine=motor(ld_h=27e-6, lq_h=27e-6), locked=True, coss_c=QOSS)
    b.gates(A_HIGH_BC_LOW)
    c.motor_set_current(b.m, 0.02, 0)
    b.gates(0)
    b.advance(8e-6)
    assert b.inv.leg[:] == [c.LEG_BLOCKED] * 3 and size(b.m) < 1e-12
    v = b.inv.node[0].v
    b.advance(1e-3)
    assert b.inv.node[0].v == v
    c.motor_spin(b.m, 1200)  # 62 V from line to line
    b.advance(5e-3)
    assert size(b.m) > 1, "the diodes start all the same"


@pytest.mark.parametrize("currents, turns", [
    ((1, 0.5e-6, -0.5e-6, 1), 0), ((-1, -0.5e-6, 0.5e-6, -1), 0), ((1, -2e-6), 1), ((-1, 2e-6), 1), ((0.5e-6, -1), 0),
    ((1, 0, -1, 0, 1), 2), ((-1, 0.5e-6, 1), 1)])
def test_a_current_that_has_ended_has_not_turned_round(currents, turns):
    """Below a microampere: of leg B alone, which swings."""
    b = Bridge(coss_c=QOSS)
    c.coss_begin_swing(b.inv, 1, 9)
    for i in currents:
        c.coss_move(b.inv, (ctypes.c_double * 3)(-i, 0, 0), (ctypes.c_double * 3)(-i, i, i), 1e-9)
    assert [node.turns_allowed for node in b.inv.node] == [0, 9 - turns, 0]


def test_charge_of_a_swing():
    """All of the charge of a whole swing is Qoss; half its current comes from the bus."""
    b = ideal_bridge(QOSS, 10)
    b.gates(BC_LOW | high(0))
    c.motor_set_current(b.m, 2, 0)
    b.gates(BC_LOW)

    def now():
        return np.array((b.inv.energy_supply_j, b.m.energy_in_j, c.coss_stored_j(b.inv), b.inv.energy_edges_j))
    before = now()
    assert before[2] == near(1.5 * QOSS * BUS_V, 1e-9), "in each node's two"
    b.advance(1e-6)
    assert now() - before == near(np.array((1, 1, 0, 0)) * QOSS * BUS_V, 0.01 * QOSS * BUS_V)
    assert c.coss_stored_j(b.inv) == near(before[2], 1e-12)


# ---- comparators: A carries i = v/r (1 - exp(-t/tau)), B and C half of it ----

TRIP_A, BLANK, DELAY = 12, 3e-6, 1.5e-6
CROSSING_S = -LD / (R + 5e-3) * math.log(1 - TRIP_A * (R + 5e-3) / (2 / 3 * BUS_V))


def tripping(blanking_s=0.0, delay_s=0.0):
    b = Bridge(STIFF, locked=True, oc_trip_a=TRIP_A, oc_blanking_s=blanking_s, oc_delay_s=delay_s)
    b.gates(A_HIGH_BC_LOW)
    return b


def seen_s(b, until_s=5e-3):
    """When the gate block first sees it; None if not until then."""
    b.b.now = c.inverter_advance(b.inv, b.m, b.b.now, b.b.now + ps(until_s))
    return b.b.now * 1e-12 if b.inv.overcurrent else None


@pytest.mark.parametrize("blanking_s, delay_s", [(0, 0), (BLANK, 0), (0, DELAY), (BLANK, DELAY)])
def test_when_it_trips(blanking_s, delay_s):
    b = tripping(blanking_s, delay_s)
    assert seen_s(b) == near(CROSSING_S + blanking_s + delay_s, 1e-9)
    if not blanking_s + delay_s:
        assert b.current() == near(TRIP_A, 1e-5)
    b.gates(0)
    b.advance(0.5e-3)
    assert not b.inv.overcurrent, "it releases"


@pytest.mark.parametrize("k", range(3))
@pytest.mark.parametrize("way", [1, -1])
def test_it_trips_on_each_leg_either_way(k, way):
    b, others = Bridge(STIFF, motor(lq_h=LD), locked=True, oc_trip_a=TRIP_A), [n for n in range(3) if n != k]
    one, other = (high, low) if way > 0 else (low, high)
    b.gates(one(k) | sum(other(n) for n in others))
    assert seen_s(b) == near(CROSSING_S, 1e-9) and b.current(k) == near(way * TRIP_A, 1e-5)


def test_shorter_than_the_blanking():
    b = tripping(BLANK, DELAY)
    b.advance(CROSSING_S + 0.3 * BLANK)
    assert b.current() > TRIP_A
    b.gates(0)
    assert seen_s(b, 1e-3) is None


def test_a_pulse_within_the_delay_comes_all_the_same():
    b = tripping(0, DELAY)
    b.advance(CROSSING_S + 0.01e-6)
    b.gates(0)
    b.advance(0.5 * DELAY)
    assert b.current() < TRIP_A and not b.inv.overcurrent
    assert seen_s(b, 1e-3) == near(CROSSING_S + DELAY, 1e-9)
    b.advance(10 * DELAY)
    assert not b.inv.overcurrent


@pytest.mark.parametrize("between, blanks", [(BC_LOW, 1.5), (high(0) | low(2), 1)], ids=["its own leg", "another leg"])
def test_turning_on_again_blanks_anew(between, blanks):
    b = tripping(BLANK)
    b.advance(CROSSING_S + BLANK / 2)
    b.gates(between)
    b.gates(A_HIGH_BC_LOW)
    assert seen_s(b, 1e-3) == near(CROSSING_S + blanks * BLANK, 1e-9)


def test_the_bus_s_comparator():
    b = tripping(BLANK, DELAY)
    b.gates(ALL_LOW)
    b.advance(10e-6)
    b.gates(ALL_LOW | high(0))
    assert seen_s(b, 1e-3) == near(10e-6 + BLANK + DELAY, 1e-9) and abs(b.current()) < TRIP_A


@pytest.mark.parametrize("blanking_s, delay_s", [(0, 0), (BLANK, DELAY)])
def test_a_trip_in_the_plant(blanking_s, delay_s):
    """The latch sets at that instant, and the gates follow; triggers keep their time."""
    p, beyond = Plant((4500, 500, 500), inverter={"oc_trip_a": 8, "oc_blanking_s": blanking_s, "oc_delay_s": delay_s}), 0
    c.motor_lock(p.motor, True)
    while not p.inverter.overcurrent and p.read(GATE.STATUS) & 1 and p.now < ps(5e-3):
        p.run(10e-9)
        beyond = beyond or (p.now if abs(currents(p.motor)[0]) > 8 else 0)
    if delay_s:
        assert (p.now - beyond) * 1e-12 == near(BLANK + DELAY, 25e-9)
    assert p.read(GATE.STATUS) & 0x3 == 0x2 and p.inverter.conduct == 0
    p.run(1e-3)
    assert p.read(GATE.STATUS) == 0x2 and size(p.motor) < 1e-12 and p.row.gates == 0, "the latch stays, the input is quiet"
    assert np.diff([row.t_s for row in p.rows]) == near(PERIOD_S, 1e-12)


def test_trips_keep_time():
    """They come between events; those that were due still come at their own time. Braking on the low sides for most of a
    period, at several speeds, so that some trips are the last thing before a trigger."""
    for n in range(20):
        p = Plant((200, 200, 200), inverter={"oc_trip_a": 8})
        c.motor_spin(p.motor, 200 + 5 * n)
        p.run(3e-3)
        assert p.read(GATE.STATUS) == 0x2 and np.diff([row.t_s for row in p.rows]) == near(PERIOD_S, 1e-12)


@pytest.mark.parametrize("off_s, status", [(1.5e-6, 0x2), (0.9e-6, 0x1)])
def test_shoot_through(off_s, status):
    """Turn-off slower than turn-on by more than the dead time: the new switch closes before the old one opens."""
    p = Plant(inverter={"turn_off_delay_s": off_s, "oc_trip_a": 40})
    p.run(1e-3)
    assert p.read(GATE.STATUS) == status, "OVERCURRENT, no INTERLOCK"
    if status == 0x2:
        assert p.inverter.conduct == 0 and p.inverter.energy_bridge_j > 0.01 and size(p.motor) < 0.1


def test_both_switches_on():
    """Half the bus behind half of R_on, and the bus feeds the short circuit beside the motor."""
    b, r_on = Bridge(STIFF, locked=True, r_on_ohm=0.2), 0.2
    b.gates(A_HIGH_BC_LOW | low(0))
    b.advance(30e-3)
    i, before_j = 12 / (R + r_on / 2 + (R + r_on) / 2), b.inv.energy_bridge_j
    assert b.current() == near(i, 1e-6)
    b.advance(1e-3)
    assert (b.inv.energy_bridge_j - before_j) / 1e-3 == near(24 * (24 / (2 * r_on) + i / 2), 1e-3)


# ---- the motor's cable ----

SHORT_OHM = 0.5


@pytest.mark.parametrize("bus, source_ohm, within", [
    ({}, 0, 1e-6),
    ({"supply_resistance_ohm": 0.3, "supply_inductance_h": 1e-6, "bus_esr_ohm": 0.02, "coss_c": 100e-9}, 0.3, 1e-4)])
def test_terminals_joined(bus, source_ohm, within):
    """Locked long enough, every phase is its resistance to a common star point: Ohm's law on switches of 0.2 ohm, and a soft
    bus."""
    b = Bridge(STIFF, locked=True, r_on_ohm=0.2, **bus)
    b.gates(A_HIGH_BC_LOW)
    c.inverter_short(b.inv, 0, 1, SHORT_OHM)
    b.advance(60e-3)
    legs, i = b.legs(), currents(b.m)
    v = np.array((24 - source_ohm * legs[0], 0, 0)) - 0.2 * legs
    assert b.inv.bus_v == near(24 - source_ohm * legs[0], 1e-4)
    assert legs - i == near(np.array((1, -1, 0)) * (v[0] - v[1]) / SHORT_OHM, within), "it returns in the other leg"
    assert v - R * i == near(np.full(3, v[0] - R * i[0]), within), "all agree on the star point"
    c.inverter_short_off(b.inv)
    assert b.legs()[0] == near(i[0], 1e-12)


@pytest.mark.parametrize("ends", [(0, 1), (1, 0)])
def test_a_short_to_an_idle_leg(ends):
    """B feeds A's phase through it, in parallel with its own; both return through C."""
    b = Bridge(STIFF, locked=True, r_on_ohm=0.2)
    b.gates(high(1) | low(2))
    c.inverter_short(b.inv, *ends, 0.4)
    b.advance(30e-3)
    both = (R + 0.4) * R / (R + 0.4 + R)
    total = 24 / (0.4 + both + R)
    assert b.legs()[:2] == near(np.array((0, total)), 1e-6) and currents(b.m)[0] == near(total * both / (R + 0.4), 1e-6)


@pytest.mark.parametrize("gates", [0, low(2)])
def test_a_short_without_the_bridge(gates):
    """The switches of A and B off and the rotor turned slowly, so that resistances decide and no diode starts: the EMF
    circulates through the short, C and the bridge have no part, even with a switch of C on."""
    b, seen = Bridge(machine=motor(math.pi / 6)), []  # a twelfth of a turn before the EMF's peak
    b.gates(gates)
    c.inverter_short(b.inv, 0, 1, 0.4)
    c.motor_spin(b.m, 8)
    for _ in range(150):
        b.advance(200e-6)
        seen.append((*currents(b.m), *b.legs()))
    seen, emf_v = np.array(seen), math.sqrt(3) * MOTOR["flux_wb"] * 4 * 8
    assert seen[:, 0].max() == near(emf_v / (2 * R + 0.4), 1e-3) and np.abs(seen[:, 2:]).max() < 1e-9


def test_a_wire_breaks_and_closes():
    p, seen = Plant((2600, 2400, 2500)), []
    c.motor_spin(p.motor, 100)
    p.run(0.01)
    c.inverter_open_wire(p.inverter, 0, True)
    for _ in range(1000):
        p.run(7e-6)
        seen.append(np.abs(currents(p.motor)))
    assert np.max(seen, axis=0)[0] < 1e-9 and 0.5 < np.max(seen, axis=0)[1] < 20
    c.inverter_open_wire(p.inverter, 0, False)
    p.run(1e-3)
    assert abs(currents(p.motor)[0]) > 0.1


@pytest.mark.parametrize("one, other, on_a_s_wire", [(0, 1, 1), (1, 2, 0), (2, 0, 2)])
def test_wires_exchanged(one, other, on_a_s_wire):
    """The current of leg A is that of the motor's phase on its wire, and returns in equal parts."""
    b, i = Bridge(STIFF, locked=True, coss_c=100e-9), 24 / (1.5 * (R + 5e-3))
    c.inverter_swap_wires(b.inv, one, other)
    b.gates(A_HIGH_BC_LOW)
    b.advance(30e-3)
    assert b.legs() == near(np.array((i, -i / 2, -i / 2)), 1e-6) and currents(b.m)[on_a_s_wire] == near(i, 1e-6)
    c.inverter_swap_off(b.inv)
    b.advance(30e-3)
    assert b.current() == near(i, 1e-6)


@pytest.mark.parametrize("swap", [False, True])
def test_two_wires_exchanged_turn_the_field_backwards(swap):
    """Where the current of the locked motor points follows the legs' field through two turns, one way or the other."""
    b, turned = Bridge(locked=True), []
    if swap:
        c.inverter_swap_wires(b.inv, 1, 2)
    for n in range(13):
        b.gates(sum(high(k) if (n % 6 - 2 * k + 1) % 6 < 3 else low(k) for k in range(3)))
        b.advance(10e-3)
        turned.append(math.atan2(b.m.i_q_a, b.m.i_d_a))
    assert np.unwrap(turned)[-1] - turned[0] == near((-1 if swap else 1) * 4 * math.pi, 0.01)


def test_exchanged_beside_another_fault():
    """Both are of the legs' wires, so the motor's other phase has them."""
    b = Bridge(STIFF, locked=True)
    c.inverter_swap_wires(b.inv, 0, 1)
    c.inverter_open_wire(b.inv, 0, True)
    b.gates(high(1) | low(0) | low(2))
    b.advance(30e-3)
    assert currents(b.m)[:2] == near(np.array((24 / (2 * 0.305), 0)), 1e-6), "leg B feeds A"
    legs = []
    for swap in (True, False):
        b = Bridge(STIFF, locked=True)
        if swap:
            c.inverter_swap_wires(b.inv, 0, 1)
        c.inverter_short(b.inv, 0, 2, SHORT_OHM)
        b.gates(A_HIGH_BC_LOW)
        b.advance(30e-3)
        legs.append(b.legs())
    assert legs[0] == near(legs[1], 1e-6), "a short at the legs is the same for them"
