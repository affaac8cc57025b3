# SPDX-License-Identifier: MIT
"""What varies with the rotor's angle, against closed forms: harmonics of the EMF from the phases' own flux linkages, torque
from virtual work at fixed phase currents, cogging from its potential. The saturation map: points of three machines as published
(or worked out with motulator's own code from the published coefficients), and what must hold of any map: each current has one
flux linkage, cross-coupling is the same both ways, no closed path of the flux linkage yields energy."""
import ctypes
import math

import numpy as np
import pytest

from twin.bench import BALDOR, MOTOR, SYRM, THOR, c, coast, currents, motor, near, terminals, triple, vector

ORDERS = np.array((5, 7, 11, 13, 17, 19))
SHARES = np.array((0.06, -0.03, 0.02, 0.025, -0.01, 0.05))
HARMONICS = {f"emf_{n}": share for n, share in zip(ORDERS, SHARES)}
PERMEANCE = {"permeance_6": 0.08, "permeance_12": -0.03}
THIRD, H = 2 * math.pi / 3, 1e-5
LD, LQ, FLUX, R = MOTOR["ld_h"], MOTOR["lq_h"], MOTOR["flux_wb"], MOTOR["resistance_ohm"]
VARIES = [HARMONICS, {"permeance_6": 0.08}, {**HARMONICS, **PERMEANCE}, {"permeance_12": -0.03}]


def magnet_flux(p, theta_e):
    """Of the phases, from the magnets: psi (cos x + sum of e_n/n cos n x), x = theta_e - 120 k degrees."""
    x = (theta_e - np.arange(3) * THIRD)[:, None]
    shares = np.array([p.get(f"emf_{n}", 0) for n in ORDERS])
    return FLUX * (np.cos(x)[:, 0] + (shares / ORDERS * np.cos(ORDERS * x)).sum(1))


# ---- EMF ----

@pytest.mark.parametrize("p", VARIES)
def test_emf(p):
    m = motor(0.3, **p)
    c.motor_spin(m, 150)
    for n in range(1, 201):
        coast(m, 50e-6)
        at = 0.3 + 600 * 50e-6 * n
        expected = 600 * (magnet_flux(p, at + H) - magnet_flux(p, at - H)) / (2 * H)
        assert triple(c.motor_star_voltages, m, terminals(0, 0, 0, held=(0, 1, 2))) == near(expected, 1e-5)
    assert abs(m.i_d_a) + abs(m.i_q_a) < 1e-12


def test_emf_of_a_saturated_machine():
    seen = []
    for changes in ({}, {"emf_5": 0.05}):
        m = motor(0.1, THOR, **changes)
        c.motor_spin(m, 100)
        seen.append(triple(c.motor_star_voltages, m, terminals(0, 0, 0, held=(0, 1, 2)))[0])
    assert seen[1] - seen[0] == near(-200 * motor(0.1, THOR).psi_vs.d * 0.05 * math.sin(0.5), 1e-9)


# ---- torque by virtual work ----

@pytest.mark.parametrize("p", VARIES)
def test_torque(p):
    """Co-energy at fixed stator currents: 3/2 (i L i / 2e + i psi_m), the magnets' part from the phases."""
    draw, ripple = np.random.default_rng(1), []
    for theta_e, i_d, i_q in draw.uniform((-math.pi, -20, -20), (math.pi, 20, 20), (100, 3)):
        m = motor(theta_e, **p)
        c.motor_set_current(m, i_d, i_q)
        abc = currents(m)
        i = abc[0] + 1j * (abc[1] - abc[2]) / math.sqrt(3)

        def coenergy(at):
            own = i * np.exp(-1j * at)
            e = 1 + p.get("permeance_6", 0) * math.cos(6 * at) + p.get("permeance_12", 0) * math.cos(12 * at)
            return 0.75 * (LD * own.real**2 + LQ * own.imag**2) / e + abc @ magnet_flux(p, at)
        work_nm = 4 * (coenergy(theta_e + H) - coenergy(theta_e - H)) / (2 * H)
        assert c.motor_torque_nm(m) == near(work_nm, 1e-7)
        ripple.append(abs(work_nm - 6 * (FLUX + (LD - LQ) * i_d) * i_q))
    assert 0.02 < max(ripple) < 1, "that is not the torque without"


@pytest.mark.parametrize("n", range(12))
def test_inductance_at_the_rotor_s_position(n):
    """With the rotor locked, 1/L is the plain one times e."""
    theta_e = n * math.pi / 6 + 0.05
    m, e = motor(theta_e, **PERMEANCE), 1 + 0.08 * math.cos(6 * theta_e) - 0.03 * math.cos(12 * theta_e)
    c.motor_lock(m, True)
    coast(m, 300e-6, vector(6, theta_e))
    assert m.i_d_a == near(6 / R * (1 - math.exp(-300e-6 * R * e / LD)), 1e-5)


SLOTS6 = {"slots6_xx": -5.6, "slots6_qq": 0.16, "slots6_xqq": 3, "slots6_q4": -2.7, "slots6_xq": -1.4, "slots6_q3": 0.66}
SLOTS = {key.replace("6", str(order), 1): value * (1, -0.5, 1, -0.5)[n]
         for n, order in enumerate((6, 12, 18, 36)) for key, value in SLOTS6.items()}


@pytest.mark.parametrize("c_open", [False, True])
@pytest.mark.parametrize("base, changes, v", [
    (MOTOR, VARIES[2], 4), (THOR, {**PERMEANCE, "emf_5": 0.05, "emf_19": 0.05}, 40),
    (THOR, {**PERMEANCE, "emf_5": 0.05, "emf_19": 0.05, "sat_w": 4}, 40), (THOR, SLOTS, 40)],
    ids=["linear", "saturated", "bridges of W = 4", "slots"])
def test_power_balance(base, changes, v, c_open):
    """A turning machine on a voltage: what went in is in copper, air gap and field."""
    m, dt, turnover_j, before_j = motor(0.2, base, **changes), 5e-6, 0, 0
    c.motor_spin(m, 60)
    for n in range(4000):
        source = vector(v, 0.2 + base["pole_pairs"] * 60 * n * dt + (2 if n < 2000 else 4), base["resistance_ohm"])
        source.held[2] = c_open
        c.motor_step(m, source, dt)
        turnover_j, before_j = turnover_j + abs(m.energy_in_j - before_j), m.energy_in_j
    lost_j = m.energy_in_j - m.energy_copper_j - m.energy_airgap_j - c.motor_magnetic_energy_j(m)
    assert abs(lost_j) < 1e-6 * turnover_j


@pytest.mark.parametrize("base, v, stiffness", [(MOTOR, 6, 0), (MOTOR, 6, 2), (THOR, 40, 500)],
                         ids=["rigid", "two masses", "THOR"])
def test_everything_on(base, v, stiffness):
    m = motor(0, base, load={
        "inertia_kgm2": base["inertia_kgm2"], "viscous_nms": 1e-5, "stiffness_nm_rad": stiffness,
        "damping_nms": stiffness * 1e-5, "fan_nms2": 1e-7, "coulomb_nm": 3e-3, "stiction_nm": 6e-3, "stribeck_rad_s": 2},
        friction_coulomb_nm=1e-3, friction_viscous_nms=1e-5, emf_5=0.03, emf_11=0.01, emf_19=0.02, permeance_6=0.04,
        permeance_12=0.02, cogging_nm=5e-3, cogging_per_rev=24, cogging2_nm=2e-3, cogging2_per_rev=9, iron_hysteresis_nm=2e-3,
        iron_eddy_nms=1e-5, copper_tempco_per_k=3.9e-3, magnet_tempco_per_k=-1.2e-3, magnet_share=0.5, winding_rise_k=20)

    def stored_j():
        return c.motor_mechanical_energy_j(m) + c.motor_magnetic_energy_j(m)
    start_j, turnover_j, before_j, furthest_rad, dt = stored_j(), 0, 0, 0, 4e-6
    for n in range(40_000):
        m.hoist_nm = 5e-3 if n > 10_000 else 0
        if n == 24_000:
            c.motor_short_winding(m, 2, 0.1, 0.1)
        c.motor_step(m, vector(v, 4 * math.pi * (1 - math.cos(2 * math.pi * n * dt / 0.16)), base["resistance_ohm"] / 2), dt)
        turnover_j, before_j = turnover_j + abs(m.energy_in_j - before_j), m.energy_in_j
        furthest_rad = max(furthest_rad, abs(m.theta_rad))
    spent_j = m.energy_copper_j + m.energy_fault_j + m.energy_iron_j + m.energy_friction_j + m.energy_load_j
    assert abs(m.energy_in_j + m.energy_driver_j - spent_j - stored_j() + start_j) < 2e-5 * turnover_j and furthest_rad > 1


# ---- slots ----

def slots_energy(x, q, theta_e):
    """Written out; x is what current adds to the magnets' flux."""
    sum_j = 0
    for n, order in enumerate((6, 12, 18, 36)):
        xx, qq, xqq, qqqq, xq, qqq = (value * (1, -0.5, 1, -0.5)[n] for value in SLOTS6.values())
        sum_j += math.cos(order * theta_e) * (xx * x * x + qq * q * q + xqq * x * q * q + qqqq * q**4)
        sum_j += math.sin(order * theta_e) * (xq * x * q + qqq * q**3)
    return sum_j


def test_slots():
    """At fixed flux linkages torque is minus the change of energy over the angle; the current its change over the flux
    linkage."""
    draw, largest_nm = np.random.default_rng(3), 0
    for theta_e, i_d, i_q in draw.uniform((-math.pi, -22, -22), (math.pi, 5, 22), (100, 3)):
        m, plain, at = motor(theta_e, THOR, **SLOTS), motor(theta_e, THOR), c.field_point()
        assert c.motor_set_current(m, i_d, i_q)
        c.motor_field_at(plain.field, m.psi_vs, m.sin_e, m.cos_e, at)
        x, q = m.psi_vs.d - plain.field.map.psi_f_vs, m.psi_vs.q
        point = np.array((x, q, theta_e))
        by_x, by_q, turn = ((slots_energy(*(point + step)) - slots_energy(*(point - step))) / (2 * H) for step in H * np.eye(3))
        assert (m.i_d_a - at.i.d, m.i_q_a - at.i.q) == near(np.array((by_x, by_q)) / 1.5, 1e-6)
        vector_nm = 1.5 * 2 * (m.psi_vs.d * m.i_q_a - m.psi_vs.q * m.i_d_a)
        assert c.motor_torque_nm(m) == near(vector_nm - 2 * turn, 1e-6)
        largest_nm = max(largest_nm, abs(2 * turn))
    assert 1 < largest_nm < 20 and abs(c.motor_torque_nm(motor(0.3, THOR, **SLOTS))) < 1e-12, "nothing without current"


@pytest.mark.parametrize("short", [False, True])
def test_a_floating_terminal(short):
    """It shows the change of its own flux linkage. What it shows before a step has to be what the step then does, also where
    the inductance varies, other phases carry current, and shorted turns of theirs lend it some."""
    m, dt = motor(0.2, **VARIES[2]), 0.5e-6
    c.motor_spin(m, 150)
    if short:
        c.motor_short_winding(m, 0, 0.4, 0.01)

    def seen():
        """Of phase C: its flux linkage, the drop of what the field takes of current there, its voltage."""
        axis = 4 * m.theta_rad - 2 * THIRD
        cos, sin = math.cos(axis), math.sin(axis)
        return np.array((m.psi_vs.d * cos - m.psi_vs.q * sin, R * (m.i_d_a * cos - m.i_q_a * sin),
                         triple(c.motor_star_voltages, m, source)[2]))
    for n in range(5000):
        source = terminals(4 * math.sin(600 * 4 * n * dt), 0, 0, held=[2])
        before = seen()
        c.motor_step(m, source, dt)
        after = seen()
        assert (after[0] - before[0]) / dt + (before[1] + after[1]) / 2 == near((before[2] + after[2]) / 2, 1e-4)
    assert 0.5 < math.hypot(m.i_d_a, m.i_q_a) < 20


# ---- cogging ----

def test_cogging_potential():
    """A coasting rotor exchanges energy with the potential of three harmonics, over ten turns."""
    terms = ((8e-3, 24, 0.4), (3e-3, 7, -1), (5e-3, 72, 2))
    m, j = motor(**{f"cogging{n}_{key}": value for n, term in zip(("", 2, 3), terms)
                    for key, value in zip(("nm", "per_rev", "rad"), term)}), MOTOR["inertia_kgm2"]

    def potential_j(theta):
        return -sum(nm / n * math.cos(n * theta + rad) for nm, n, rad in terms)
    m.speed_rad_s, speeds = 40, []
    start_j = potential_j(0) + 0.5 * j * 1600
    while m.theta_rad < 20 * math.pi:
        coast(m, 250e-6)
        speeds.append(m.speed_rad_s)
        assert potential_j(m.theta_rad) + 0.5 * j * m.speed_rad_s**2 == near(start_j, 1e-9)
        assert c.motor_mechanical_energy_j(m) == near(start_j, 1e-9)
    assert 2 < max(speeds) - min(speeds) < 20
    m.speed_rad_s, at = 0, m.theta_rad
    coast(m, 1e-6)
    assert m.speed_rad_s / 1e-6 * j == near(-(potential_j(at + 1e-4) - potential_j(at - 1e-4)) / 2e-4, 1e-6)


# ---- magnets that are warm ----

@pytest.mark.parametrize("base, changes", [(MOTOR, {}), (THOR, {}), (THOR, {"sat_a_b": 0, "sat_i_f_a": 4})],
                         ids=["linear", "bridges", "in series with a gap"])
def test_flux_of_hot_magnets(base, changes):
    """Found once more by the map's equations, with the remanence of 100 degrees."""
    def seen(**more):
        m = motor(0, base, **changes, **more)
        c.motor_spin(m, 100)
        v = triple(c.motor_star_voltages, m, terminals(0, 0, 0, held=(0, 1, 2)))
        coast(m, 1e-4)
        assert math.hypot(m.i_d_a, m.i_q_a) < 1e-9
        return math.hypot(v[0], (v[1] - v[2]) / math.sqrt(3))

    def found(share):
        p, low, high = {**base, **changes}, 0, 1
        if "sat_s" not in p:
            return share
        for _ in range(60):
            psi = (low + high) / 2
            off = psi - p["sat_psi_n_wb"] * share
            bridge = p["sat_a_b"] * off**2 / (1 + p["sat_a_bp"] * off**2)
            i = psi * (p["sat_a_d0"] + p["sat_a_dd"] * psi**2) + bridge * off - p.get("sat_i_f_a", 0) * share
            low, high = (low, psi) if i > 0 else (psi, high)
        return low
    assert seen(magnet_tempco_per_k=-1.1e-3) == pytest.approx(seen(), rel=1e-12), "at 25 degrees"
    hot = seen(magnet_tempco_per_k=-1.1e-3, ambient_c=100) / seen()
    assert hot == near(found(1 - 1.1e-3 * 75) / found(1), 1e-9)


# ---- the map: published points ----

POINTS = [  # machine, i_d, i_q, psi_d, psi_q, tolerance of the larger, l_dd l_dq l_qq in mH, tolerance, torque, tolerance
    (SYRM, 0, 0, 0, 0, 1e-3, (57.5, 0, 19.2), 0.05, 0, 1e-9),
    (SYRM, 10, 10, 0.4213, 0.0767, 1e-3, (20.6, -1.73, 5.67), 0.05, 10.34, 0.01),
    (SYRM, 15.5, 15.5, 0.4964, 0.0962, 1e-3, (11.5, -1.36, 4.62), 0.05, 18.6, 0.05),
    (SYRM, 22, 22, 0.5488, 0.1158, 1e-3, (7.6, -1.1, 3.9), 0.05, 28.6, 0.05),
    (BALDOR, 0, 0, 0.4767, 0, 1e-3, (29.8, 0, 149.7), 0.05, 0, 1e-9),
    (BALDOR, 0, 12.4, 0.4510, 1.0336, 1e-3, (19.4, -2.89, 29.8), 0.05, 16.8, 0.05),
    (BALDOR, -8, 9.5, 0.3038, 0.9375, 1e-3, (18.0, 0.74, 45.1), 0.05, 31.2, 0.05),
    # measured
    (BALDOR, -6, 6, 0.3411, 0.7192, 0.04, None, 0, None, 0), (BALDOR, -12, 12, 0.2419, 1.0207, 0.04, None, 0, None, 0),
    # by finite elements
    (THOR, 0, 0, 0.1334, 0, 0.02, None, 0, None, 0), (THOR, 0, 11, 0.1506, 0.2888, 0.02, (6.0, 2.0, 13.9), 0.9, None, 0),
    (THOR, 0, 22, 0.1643, 0.3848, 0.02, (5.0, 0.5, 5.3), 0.4, None, 0),
    (THOR, -22, 22, 0.0745, 0.3644, 0.02, None, 0, None, 0), (THOR, -44, 44, 0.0252, 0.4456, 0.02, None, 0, None, 0),
    (THOR, -15, 16, None, None, 0, (3.6, 1.36, 10.0), 0.4, 19, 0.6),
]


def at_current(base, i_d, i_q):
    m = motor(0, base)
    assert c.motor_set_current(m, i_d, i_q)
    return m


@pytest.mark.parametrize("base, i_d, i_q, psi_d, psi_q, within, inductances, within_mh, torque, within_nm", POINTS)
def test_published(base, i_d, i_q, psi_d, psi_q, within, inductances, within_mh, torque, within_nm):
    m = at_current(base, i_d, i_q)
    if psi_d is not None:
        assert math.hypot(m.psi_vs.d - psi_d, m.psi_vs.q - psi_q) <= within * (math.hypot(psi_d, psi_q) + 1e-3)
    if inductances:
        def difference(d, q):
            ends = [at_current(base, i_d + way * d, i_q + way * q).psi_vs for way in (1e-4, -1e-4)]
            return (ends[0].d - ends[1].d) / 2e-7, (ends[0].q - ends[1].q) / 2e-7
        assert (difference(1, 0)[0], *difference(0, 1)) == near(np.array(inductances), within_mh)
    if torque is not None:
        assert c.motor_torque_nm(m) == near(torque, within_nm)


# ---- the equations once more, as published ----

def published_current(p, d, q):
    p = {"sat_v": 0, "sat_k_q": 0, "sat_psi_n_wb": 0, "sat_a_b": 0, "sat_a_bp": 0, "sat_i_f_a": 0, **p}
    s, t, u, v, w, k = (p[f"sat_{key}"] for key in ("s", "t", "u", "v", "w", "k_q"))
    x = math.sqrt((d - p["sat_psi_n_wb"])**2 + k * q * q)
    bridge = p["sat_a_b"] * x**w / (1 + p["sat_a_bp"] * x**w)
    return np.array((d * (p["sat_a_d0"] + p["sat_a_dd"] * abs(d)**s + p["sat_a_dq"] / (v + 2) * abs(d)**u * abs(q)**(v + 2))
                     + bridge * (d - p["sat_psi_n_wb"]) - p["sat_i_f_a"],
                     q * (p["sat_a_q0"] + p["sat_a_qq"] * abs(q)**t + p["sat_a_dq"] / (u + 2) * abs(d)**(u + 2) * abs(q)**v)
                     + k * bridge * q))


MACHINES = pytest.mark.parametrize("base, most_a", [(SYRM, 22), (BALDOR, 20), (THOR, 44)], ids=["SyRM", "Baldor", "THOR"])


@MACHINES
def test_each_current_has_its_flux_linkage(base, most_a):
    """Put into the published equations; the derivatives that solve for it are right only if it converges so far."""
    draw = np.random.default_rng(4)
    for size, rad in draw.uniform((0, -math.pi), (2 * most_a, math.pi), (200, 2)):
        i = size * np.array((math.cos(rad), math.sin(rad)))
        psi = at_current(base, *i).psi_vs
        assert published_current(base, psi.d, psi.q) == near(i, 1e-9)


def test_maps_of_all_exponents():
    """Current as published; slopes by differences, reciprocal; the energy's gradient is 3/2 the current."""
    draw, h = np.random.default_rng(5), 1e-6
    for _ in range(300):
        p = {**THOR, **{f"sat_{key}": int(draw.integers(0, 9)) for key in "stuv"}, "sat_w": int(draw.choice((2, 4))),
             "sat_a_bp": draw.choice((0, draw.uniform(0, 30))), "sat_i_f_a": draw.choice((0, draw.uniform(0, 2)))}
        m, (d, q) = c.motor_map(), draw.uniform(-0.4, 0.4, 2)
        c.motor_map_init(m, c.motor_params(**p))
        i, g = c.motor_map_current(m, c.dq(d, q)), c.motor_map_slopes(m, c.dq(d, q))
        expected, scale = published_current(p, d, q), abs(g.dd) + abs(g.qq)
        size = 1 + np.hypot(*expected)
        by_d, by_q = ((published_current(p, d + x, q + y) - published_current(p, d - x, q - y)) / (2 * h)
                      for x, y in h * np.eye(2))
        assert (i.d, i.q) == near(expected, 1e-12 * size)
        assert np.array((g.dd, g.dq, g.dq, g.qq)) == near(np.array((*by_d, *by_q)), 1e-6 * scale)
        gradient = [(c.motor_map_energy(m, c.dq(d + x, q + y)) - c.motor_map_energy(m, c.dq(d - x, q - y))) / (2 * h)
                    for x, y in h * np.eye(2)]
        energy = ctypes.c_double()
        both = c.motor_map_current_energy(m, c.dq(d, q), energy)
        assert gradient == near(1.5 * expected, 1e-6 * size) and (both.d, both.q) == near(expected, 1e-12 * size)
        assert energy.value == near(c.motor_map_energy(m, c.dq(d, q)), 1e-9)


@MACHINES
def test_a_closed_path_yields_no_energy(base, most_a):
    m, steps = c.motor_map(), 4000
    c.motor_map_init(m, c.motor_params(**base))
    a = 2 * math.pi * (np.arange(steps) + 0.5) / steps
    i = [c.motor_map_current(m, c.dq(0.1 + 0.3 * math.cos(one), 0.35 * math.sin(one))) for one in a]
    along = np.array([(one.d, one.q) for one in i]) * np.stack((-0.3 * np.sin(a), 0.35 * np.cos(a)), 1)
    pieces = 1.5 * along.sum(1) * 2 * math.pi / steps
    turnover_j = np.abs(pieces).sum()
    stored_j = c.motor_map_energy(m, c.dq(0.1, 0.35)) - c.motor_map_energy(m, c.dq(0.4, 0))
    assert abs(pieces.sum()) < 1e-6 * turnover_j and pieces[:steps // 4].sum() == near(stored_j, 1e-6 * turnover_j)


@pytest.mark.parametrize("base, most_a, v, duration_s", [(SYRM, 22, 25, 50e-3), (BALDOR, 20, 30, 50e-3), (THOR, 44, 100, 5e-3)])
def test_a_locked_rise_into_saturation(base, most_a, v, duration_s):
    """The published equations by Runge and Kutta, against motor_step() through a map that saturates."""
    m, r, h = motor(0, base), base["resistance_ohm"], duration_s / 2500
    psi, u = np.array((m.psi_vs.d, 0.0)), v * np.array((math.cos(2), math.sin(2)))

    def slope(psi):
        return u - r * published_current(base, *psi)
    for _ in range(2500):
        k1 = slope(psi)
        k2 = slope(psi + h / 2 * k1)
        k3 = slope(psi + h / 2 * k2)
        psi = psi + h / 6 * (k1 + 2 * k2 + 2 * k3 + slope(psi + h * k3))
    c.motor_lock(m, True)
    coast(m, duration_s, vector(v, 2))
    i = published_current(base, *psi)
    assert (m.i_d_a, m.i_q_a) == near(i, 1e-5 * np.hypot(*i)) and most_a < np.hypot(*i) < 3 * most_a


def test_an_open_phase_while_the_map_bends():
    m = at_current(THOR, 0, 0)
    c.motor_lock(m, True)
    for _ in range(50):
        coast(m, 100e-6, terminals(100, 0, 0, held=[2]))
        assert abs(currents(m)[2]) < 1e-9
    assert 20 < currents(m)[0] < 400


def test_a_wire_that_breaks():
    """Its flux goes, along its own axis, and what stands across that stays."""
    m = at_current(THOR, -20, 30)
    before = np.array((m.psi_vs.d, m.psi_vs.q))
    assert 10 < abs(currents(m)[2]) < 40
    c.motor_hold_phase(m, 2)
    across = np.array((-math.sin(-THIRD), math.cos(-THIRD)))
    assert abs(currents(m)[2]) < 1e-12 and across @ (np.array((m.psi_vs.d, m.psi_vs.q)) - before) == near(0, 1e-12)


@pytest.mark.parametrize("change, right", [
    ({}, True), *(({f"sat_{key}": THOR[f"sat_{key}"] + 0.5}, False) for key in "stuv"), ({"sat_w": 3}, False),
    ({"sat_a_dq": 1e6}, False), ({"sat_a_q0": 0}, False), ({"pole_pairs": 1.5}, False),
    ({"temperature_sensor": 0.5}, False), ({"temperature_sensor": 1}, True),
    *(({f"{cogging}_per_rev": 6.5}, False) for cogging in ("cogging", "cogging2", "cogging3")),
    ({"winding_capacity_j_k": 1, "winding_resistance_k_w": 0.1}, True), ({"winding_capacity_j_k": 1}, False),
    ({"winding_resistance_k_w": 0.1}, False), ({"winding_capacity_j_k": 1e4, "winding_resistance_k_w": 0.1}, False),
    ({"winding_capacity_j_k": 1, "winding_resistance_k_w": 1}, False)])
def test_what_is_no_map(change, right):
    refused = c.motor_params_check(c.motor_params(**{**THOR, **change}), c.load_params(), 60)
    assert (refused is None) == right
