# SPDX-License-Identifier: MIT
"""The motor alone against closed-form solutions of textbook cases: electrical, mechanical, what hangs on its shaft, and its
warming. The model integrates with an error per step of about 1e-8 of the change; tolerances of 1e-6 of the final value leave
room for the thousands of steps of a run, and where something starts or ends within a step of 10 us, that is the tolerance."""
import math

import numpy as np
import pytest

from twin.bench import MOTOR, c, coast, currents, motor, near, shorted, terminals, triple, vector

R, LD, LQ, FLUX, J, TURN = 0.3, 0.3e-3, 0.4e-3, 7.5e-3, 1e-5, 2 * math.pi


def rise(v, r_ohm, l_h, t_s):
    return v / r_ohm * (1 - math.exp(-t_s * r_ohm / l_h))


def locked(*arguments, **changes):
    m = motor(*arguments, **changes)
    c.motor_lock(m, True)
    return m


# ---- electrical ----

def test_locked_rotor():
    m, source = locked(0.7), vector(3, 0.7 + 1.1)
    for n in range(1, 51):
        coast(m, 100e-6, source)
        assert m.i_d_a == near(rise(3 * math.cos(1.1), R, LD, n * 100e-6), 10e-6)
        assert m.i_q_a == near(rise(3 * math.sin(1.1), R, LQ, n * 100e-6), 10e-6)
    assert m.theta_rad == near(0.7 / 4, 1e-12)
    rad, size = 0.7 + math.atan2(m.i_q_a, m.i_d_a), math.hypot(m.i_d_a, m.i_q_a)
    assert currents(m) == near(size * np.cos(rad - np.arange(3) * TURN / 3), 1e-9)


def test_two_terminals():
    """A to B with C open: R = 2 R, and the inductance of the axis at -30 degrees between d and q."""
    m = locked()
    coast(m, 0.5e-3, terminals(4, 0, 0, held=[2]))
    i = currents(m)
    assert i[0] == near(rise(4, 2 * R, 2 * (0.75 * LD + 0.25 * LQ), 0.5e-3), 10e-6)
    assert i[1] == near(-i[0], 1e-12) and i[2] == near(0, 1e-12)


def test_source_resistance():
    m = locked()
    coast(m, 0.8e-3, vector(4, 0, 0.2))
    assert m.i_d_a == near(rise(4, R + 0.2, LD, 0.8e-3), 10e-6)


@pytest.mark.parametrize("speed", [200, -35])
def test_spinning_short_circuit(speed):
    """Derivatives of the two voltage equations set to zero at constant speed, terminals joined."""
    w, m = 4 * speed, motor()
    det = R * R + w * w * LD * LQ
    i_d = -w * w * LQ * FLUX / det
    c.motor_spin(m, speed)
    coast(m, 40 * LQ / R, shorted())
    assert m.i_d_a == near(i_d, 1e-6 * abs(i_d)) and m.i_q_a == near(-w * FLUX * R / det, 1e-6 * abs(i_d))
    assert c.motor_torque_nm(m) * speed < 0


def flux_linkage(m):
    """In stator coordinates."""
    return (LD * m.i_d_a + FLUX + 1j * LQ * m.i_q_a) * np.exp(4j * m.theta_rad)


def complex_of(abc):
    return abc[0] + 1j * (abc[1] - abc[2]) / math.sqrt(3)


def test_driven_run():
    """Faraday: what the terminals saw is what the resistance dropped plus the change of flux linkage. The test knows neither dq
    derivatives nor rotational voltages; its own trapezoids leave 1e-7 Vs, a cross term left out leaves 1e-3."""
    m, dt, w = motor(0.2), 2e-6, TURN * 80
    start, seen = flux_linkage(m), np.zeros((20001, 3), complex)
    steps = np.exp(1j * w * dt * np.arange(20000)) * 8
    for n in range(20001):
        seen[n] = complex_of(currents(m)), m.speed_rad_s, c.motor_torque_nm(m)
        if n < 20000:
            c.motor_step(m, vector(8, w * n * dt), dt)
    drop, travelled, impulse = ((seen[1:] + seen[:-1]) / 2 * dt).sum(0)
    assert abs(flux_linkage(m) - start + R * drop - steps.sum() * dt) < 1e-6
    assert m.volt_alpha_vs + 1j * m.volt_beta_vs == pytest.approx(steps.sum() * dt, abs=1e-9), "the integrals of the trace"
    # a step that comes to standstill ends there, even if the shaft then goes on: up to 2 us of torque each time
    assert m.theta_rad - 0.2 / 4 == near(travelled.real, 2e-4) and m.speed_rad_s == near(impulse.real / J, 0.2)
    assert abs(m.theta_rad) > 0.1


def test_torque_by_virtual_work():
    """The change of co-energy over the rotor's angle at fixed phase currents."""
    draw, h = np.random.default_rng(1), 1e-5
    for theta_e, i_d, i_q in draw.uniform((-math.pi, -20, -20), (math.pi, 20, 20), (50, 3)):
        m = motor(theta_e)
        c.motor_set_current(m, i_d, i_q)
        i = complex_of(currents(m))

        def coenergy(theta):
            own = i * np.exp(-4j * theta)
            return 1.5 * (LD * own.real**2 / 2 + LQ * own.imag**2 / 2 + FLUX * own.real)
        assert c.motor_torque_nm(m) == near((coenergy(m.theta_rad + h) - coenergy(m.theta_rad - h)) / (2 * h), 1e-7)
    m = motor()
    for i_d, torque_nm in ((0, 0.45), (-5, 0.45 + 6 * -0.1e-3 * -50)):
        c.motor_set_current(m, i_d, 10)
        assert c.motor_torque_nm(m) == near(torque_nm, 1e-12)


def test_integrated_once_more_in_currents():
    """The linear machine's equations as textbooks have them, by Runge and Kutta; the voltages jump every 100 us."""
    cogging, friction, draw = {"cogging_nm": 5e-3, "cogging_per_rev": 24}, 3e-5, np.random.default_rng(2)
    m, x, dt = motor(friction_viscous_nms=friction, **cogging), np.zeros(4), 1e-6

    def slope(x, v):
        i_d, i_q, speed, theta = x
        w, own = 4 * speed, v * complex(math.cos(4 * theta), -math.sin(4 * theta))
        torque = 6 * (FLUX + (LD - LQ) * i_d) * i_q - 5e-3 * math.sin(24 * theta) - friction * speed
        return np.array(((own.real - R * i_d + w * LQ * i_q) / LD, (own.imag - R * i_q - w * (LD * i_d + FLUX)) / LQ,
                         torque / J, speed))
    for n in range(150):
        angle, size = 2e-4 * n * n + draw.uniform(-0.5, 0.5), draw.uniform(3, 8)
        v = size * complex(math.cos(angle), math.sin(angle))
        coast(m, 100e-6, vector(size, angle))
        for _ in range(50):
            h = 2 * dt
            k1 = slope(x, v)
            k2 = slope(x + h / 2 * k1, v)
            k3 = slope(x + h / 2 * k2, v)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + slope(x + h * k3, v))
    assert [m.i_d_a, m.i_q_a, m.speed_rad_s, m.theta_rad] == near(x, 1e-5) and abs(x[3]) > 0.5


# ---- mechanical ----

def time_to_rest(m):
    for n in range(1, 1_000_000):
        coast(m, 10e-6)
        if m.speed_rad_s == 0:
            return n * 10e-6


@pytest.mark.parametrize("viscous, speed", [(0, 100), (5e-5, -100)])
def test_run_down(viscous, speed):
    m, coulomb = motor(friction_coulomb_nm=2e-3, friction_viscous_nms=viscous), 2e-3
    m.speed_rad_s = speed
    expected_s = J / viscous * math.log(1 + viscous * 100 / coulomb) if viscous else J * 100 / coulomb
    assert time_to_rest(m) == near(expected_s, 20e-6)
    coast(m, 0.01)
    assert m.speed_rad_s == 0 and m.stuck


def test_viscous_run_down_with_a_load():
    m = motor(friction_viscous_nms=5e-5, load={"inertia_kgm2": 4e-5, "viscous_nms": 5e-5})
    m.speed_rad_s = 100
    coast(m, 0.5)
    assert m.speed_rad_s == near(100 * math.exp(-0.5 * 1e-4 / 5e-5), 1e-4)


def test_stick_and_slip():
    m = motor(friction_coulomb_nm=2e-3)
    m.load_nm = 1.999e-3
    coast(m, 0.05)
    assert m.speed_rad_s == m.theta_rad == 0
    m.load_nm = 2.5e-3
    coast(m, 0.05)
    assert m.speed_rad_s == near(-0.5e-3 / J * 0.05, 1e-6), "backwards with the rest"
    m.load_nm = -4e-3
    coast(m, 0.1)  # backwards friction helps to brake: 6 mN m down to 0 in 4.1667 ms, then 2 mN m forwards
    assert m.speed_rad_s == near(2e-3 / J * (0.1 - 2.5e-5 / 6e-3), 0.01)


def test_shaft_in_a_vice():
    m = motor()
    m.speed_rad_s, m.load_nm = 50, 1
    c.motor_lock(m, True)
    coast(m, 0.01)
    assert m.speed_rad_s == m.theta_rad == 0
    c.motor_spin(m, 30)
    coast(m, 0.1)
    assert m.theta_rad == near(3, 1e-9)
    c.motor_release(m)
    m.load_nm = 0.1
    coast(m, 0.001)
    assert m.speed_rad_s == near(30 - 0.1 / J * 0.001, 1e-6)


def test_cogging_swings():
    """It holds the rotor at 0 like a spring of T N: a pendulum's quarter period, which its amplitude lengthens by less than 0.1
    %."""
    m = motor(initial_angle_rad=0.004, cogging_nm=5e-3, cogging_per_rev=24)
    w, t_s = math.sqrt(5e-3 * 24 / J), 0
    while m.theta_rad > 0 and t_s < 0.1:
        coast(m, 2e-6)
        t_s += 2e-6
    assert t_s == pytest.approx(math.pi / 2 / w, rel=1e-3) and m.speed_rad_s == pytest.approx(-0.004 * w, rel=2e-3)


# ---- two masses: the bench of the 2.2 kW ABB motor (Saarakkala, Hinkkanen 2015, as reduced by motulator) ----

SPRING, MASS = 700, 5e-3


def two_masses(inertia_kgm2=MASS, **load):
    return motor(inertia_kgm2=inertia_kgm2, load={"inertia_kgm2": MASS, "stiffness_nm_rad": SPRING, **load})


@pytest.mark.parametrize("hold, masses, published_hz", [(False, 2, 84), (True, 1, 59.6)])
def test_resonance(hold, masses, published_hz):
    m, twist = two_masses(), []
    c.motor_lock(m, hold)
    m.twist_rad = 1e-3
    for _ in range(12_000):
        coast(m, 20e-6)
        twist.append(m.twist_rad)
    twist = np.array(twist)
    up = np.flatnonzero((twist[:-1] < 0) & (twist[1:] >= 0))
    times = (up - twist[up] / (twist[up + 1] - twist[up])) * 20e-6
    found_hz = (len(times) - 1) / (times[-1] - times[0])
    assert found_hz == near(math.sqrt(SPRING * masses / MASS) / TURN, 1e-3) == near(published_hz, 0.5)
    assert c.motor_mechanical_energy_j(m) == near(0.5 * SPRING * 1e-6, 1e-9)
    assert m.speed_rad_s == m.theta_rad == 0 if hold else m.speed_rad_s + m.load_speed_rad_s == near(0, 1e-9)


def test_damped_shaft():
    """The twist decays by D (1/J1 + 1/J2) / 2."""
    m = two_masses(damping_nms=0.05)
    m.twist_rad = 1e-3
    decay = 0.05 / MASS
    w = math.sqrt(SPRING * 2 / MASS - decay**2)
    coast(m, 0.05)
    assert m.twist_rad == near(1e-3 * math.exp(-decay * 0.05) * (math.cos(w * 0.05) + decay / w * math.sin(w * 0.05)), 1e-9)
    coast(m, 1)
    assert m.energy_friction_j == near(0.5 * SPRING * 1e-6, 1e-9)


def test_load_on_the_far_mass():
    m = two_masses(damping_nms=2)
    c.motor_lock(m, True)
    m.load_nm = 3
    coast(m, 1)
    assert m.twist_rad == near(3 / SPRING, 1e-9) and m.load_speed_rad_s == near(0, 1e-9), "the spring carries it"
    c.motor_release(m)
    coast(m, 1)
    assert m.speed_rad_s == near(-300, 0.1) and m.twist_rad == near(1.5 / SPRING, 1e-6), "half accelerates the motor"


def test_the_load_spun():
    m = two_masses(damping_nms=0.2)
    m.p.friction_viscous_nms = 0.01
    c.motor_spin(m, 100)
    coast(m, 0.5)
    assert m.load_speed_rad_s == 100 and m.twist_rad == near(-1 / SPRING, 1e-5), "the spring drags the motor along"
    assert m.energy_driver_j + 0.5 * 2 * MASS * 100**2 == near(m.energy_friction_j + c.motor_mechanical_energy_j(m), 1e-6)


def test_a_stiff_shaft_is_rigid():
    l = {"inertia_kgm2": MASS, "coulomb_nm": 0.3, "viscous_nms": 1e-3}
    stiff, rigid = two_masses(stiffness_nm_rad=7e6, damping_nms=20, **l), motor(inertia_kgm2=MASS, load=l)
    for m in (stiff, rigid):
        m.load_nm = -1
        coast(m, 0.1)
    assert stiff.speed_rad_s == near(rigid.speed_rad_s, 1e-4)
    assert rigid.speed_rad_s == near(0.7 / 1e-3 * (1 - math.exp(-0.1 * 1e-3 / (2 * MASS))), 1e-6)


def test_friction_on_the_far_mass():
    """It alone stops both, and all of the motion is in it."""
    m, t_s = two_masses(coulomb_nm=0.5, damping_nms=0.2), 0
    m.speed_rad_s = m.load_speed_rad_s = 20
    start_j = c.motor_mechanical_energy_j(m)
    while (not m.load_stuck or abs(m.speed_rad_s) > 1e-6) and t_s < 5:
        coast(m, 1e-3)
        t_s += 1e-3
    assert m.load_stuck and m.load_speed_rad_s == 0 and 0.4 < t_s < 1.5
    assert m.energy_friction_j + c.motor_mechanical_energy_j(m) == near(start_j, 1e-4 * start_j)


# ---- kinds of load ----

@pytest.mark.parametrize("speed", [300, -300])
def test_fan(speed):
    """J dw/dt = -k w^2"""
    m, k = motor(load={"fan_nms2": 2e-7}), 2e-7
    m.speed_rad_s = speed
    coast(m, 0.5)
    assert m.speed_rad_s == near(speed / (1 + k * 300 * 0.5 / J), 1e-6)
    assert m.energy_load_j == near(0.5 * J * (90000 - m.speed_rad_s**2), 1e-9)


@pytest.mark.parametrize("way", [1, -1])
def test_stiction(way):
    m = motor(friction_coulomb_nm=1e-3, load={"coulomb_nm": 4e-3, "stiction_nm": 10e-3, "stribeck_rad_s": 5})
    m.load_nm = -10.9e-3 * way
    coast(m, 0.1)
    assert m.speed_rad_s == 0 and m.stuck
    m.load_nm = -11.1e-3 * way
    coast(m, 1e-5)
    assert m.speed_rad_s * way > 0 and not m.stuck
    coast(m, 1)
    before = m.speed_rad_s
    coast(m, 0.01)
    assert (m.speed_rad_s - before) / 0.01 * J == near(6.1e-3 * way, 1e-6), "once fast, Coulomb's torque is left"
    m.speed_rad_s, m.load_nm = 5 * way, 0
    coast(m, 1e-5)
    assert (5 * way - m.speed_rad_s) / 1e-5 * J == near(8e-3 * way, 1e-4), "half the difference at its speed"
    coast(m, 0.2)
    assert m.speed_rad_s == 0 and m.stuck


@pytest.mark.parametrize("way", [1, -1])
def test_hoist(way):
    """It turns nothing from rest, and is let down by a quarter of its torque."""
    m = motor()
    m.hoist_nm = 5e-3 * way

    def pulled(torque_nm, duration_s):
        m.load_nm = -torque_nm * way
        coast(m, duration_s)
        return m.speed_rad_s * way
    assert pulled(0, 0.1) == pulled(4.9e-3, 0.01) == m.theta_rad == 0
    assert pulled(7e-3, 0.05) == near(2e-3 / J * 0.05, 1e-6)
    assert pulled(0, 0.05) == 0 and m.stuck
    lifted_j = m.energy_load_j
    assert pulled(-1.2e-3, 0.01) == 0 and m.stuck
    assert pulled(-1.3e-3, 0.01) == near(-6.3e-3 / J * 0.01, 1e-6) and m.energy_load_j < lifted_j, "it gives its energy back"


def test_a_spring_needs_a_mass():
    def check(**load):
        return c.motor_params_check(c.motor_params(**MOTOR), c.load_params(**load), 0)
    assert check(stiffness_nm_rad=SPRING) and check(stiffness_nm_rad=SPRING, inertia_kgm2=MASS) is None


# ---- warming ----

def test_warming():
    m, source = locked(), vector(10 * R, 0)
    m.p.thermal_capacity_j_k = 0.1  # a time constant of 0.2 s
    c.motor_set_current(m, 10, 0)
    heat_w = 1.5 * R * 100
    coast(m, 0.2, source)
    assert m.winding_c - 25 == near(heat_w * 2 * (1 - math.exp(-1)), 1e-3)
    coast(m, 3, source)
    assert m.winding_c - 25 == near(heat_w * 2, 1e-3) and m.energy_copper_j == near(heat_w * 3.2, 1e-6 * heat_w)
    m.p.copper_tempco_per_k, m.winding_c, m.p.thermal_capacity_j_k = 0.0039, 125, 1e6
    assert c.motor_resistance_ohm(m) == near(R * 1.39, 1e-12)
    coast(m, 0.05, source)
    assert m.i_d_a == near(10 / 1.39, 1e-4)


def test_two_thermal_nodes():
    """A heated winding in its housing, and magnets that follow the housing: the matrix's exponential."""
    p = {"thermal_resistance_k_w": 2, "winding_resistance_k_w": 0.5, "thermal_capacity_j_k": 11, "winding_capacity_j_k": 1,
         "magnet_share": 0.4}
    m = locked(**p)
    c.motor_set_current(m, 10, 0)
    coast(m, 1.5, vector(10 * R, 0))
    rates, modes = np.linalg.eig(np.array(((-2, 2), (2 / 10, (-2 - 1 / 1.5) / 10))))
    settled_k = np.array((2, 1.5)) * 1.5 * R * 100
    winding_k, housing_k = settled_k - modes @ (np.exp(1.5 * rates) * np.linalg.solve(modes, settled_k))
    assert m.winding_c - 25 == pytest.approx(winding_k, rel=2e-4) and m.housing_c - 25 == pytest.approx(housing_k, rel=2e-3)
    assert c.motor_magnet_c(m) - 25 == pytest.approx(0.4 * housing_k * 2 / 1.5, rel=2e-3) and winding_k > 4 * housing_k
    assert motor(**p, winding_rise_k=40).housing_c == near(25 + 40 * 0.75, 1e-12), "a warm start is a settled one"


def test_magnets_warm_with_the_winding():
    """They share 40 % of its rise, and torque falls with their flux."""
    m = locked(thermal_capacity_j_k=0.1, magnet_tempco_per_k=-2e-3, magnet_share=0.4, winding_rise_k=10)
    assert m.winding_c == near(35, 1e-12) and c.motor_magnet_c(m) == near(29, 1e-12)
    coast(m, 3, vector(10 * R, math.pi / 2))
    rise_k = 2 * 1.5 * R * 100
    assert m.winding_c == near(25 + rise_k, 0.01)
    assert c.motor_torque_nm(m) == near(6 * (FLUX * (1 - 2e-3 * 0.4 * rise_k) - 0.1e-3 * m.i_d_a) * 10, 1e-4)


# ---- iron ----

def driver_nm(m, source, speed_rad_s, duration_s=0.1):
    """Mean torque of whoever spins the shaft."""
    c.motor_spin(m, speed_rad_s)
    before_j = m.energy_driver_j
    coast(m, duration_s, source)
    return (m.energy_driver_j - before_j) / (speed_rad_s * duration_s)


@pytest.mark.parametrize("way", [1, -1])
def test_iron_drags(way):
    m, drag_nm = motor(iron_hysteresis_nm=3e-3, iron_eddy_nms=2e-5), 3e-3 + 2e-5 * 300
    assert driver_nm(m, None, 300 * way) == near(drag_nm * way, 1e-7) and m.energy_iron_j == near(drag_nm * 30, 1e-6)


def test_run_down_by_eddy_currents():
    m = motor(iron_eddy_nms=2e-5)
    m.speed_rad_s = 200
    coast(m, 1.5)
    assert m.speed_rad_s == near(200 * math.exp(-1.5 * 2e-5 / J), 1e-6)


def short_circuit(speed):
    """i_d and the size of the flux linkage, against the magnets'."""
    w = 4 * speed
    det = R * R + w * w * LD * LQ
    i_d = -w * w * LQ * FLUX / det
    return i_d, math.hypot(FLUX + LD * i_d, LQ * -w * FLUX * R / det) / FLUX


@pytest.mark.parametrize("speed, power, teeth", [(400, 0, 0), (400, 1.8, 0.05)])
def test_iron_follows_flux_and_current(speed, power, teeth):
    """In the short circuit of a spinning machine the flux linkage all but vanishes, and the drag with it; i_d adds in the
    teeth."""
    law = {"iron_flux_power": power, "iron_teeth_per_a": teeth, "iron_hysteresis_nm": 3e-3, "iron_hysteresis_power": 0.3,
           "iron_hysteresis_rad_s": 300} if power else {}
    m, (i_d, strength) = motor(iron_eddy_nms=2e-5, **law), short_circuit(speed)
    c.motor_spin(m, speed)
    coast(m, 0.1, shorted())
    before_j = m.energy_iron_j
    coast(m, 0.1, shorted())
    share = strength**(power or 2) + teeth * abs(i_d)
    expected_nm = (2e-5 * speed + (3e-3 * (speed / 300)**0.3 if power else 0)) * share
    assert (m.energy_iron_j - before_j) / (speed * 0.1) == near(expected_nm, 1e-6 if power else 1e-8) and strength**2 < 0.5


@pytest.mark.parametrize("speed", [60, 300, 600])
def test_hysteresis_grows_with_a_power_of_the_speed(speed):
    m = motor(iron_hysteresis_nm=3e-3, iron_hysteresis_power=0.3, iron_hysteresis_rad_s=300, iron_flux_power=1.8)
    c.motor_spin(m, speed)
    coast(m, 0.1)
    assert m.energy_iron_j / (speed * 0.1) == near(3e-3 * (speed / 300)**0.3, 2e-6)


def test_iron_warms_the_machine():
    m = motor(iron_eddy_nms=2e-5, thermal_capacity_j_k=0.05)
    c.motor_spin(m, 500)
    coast(m, 2)
    assert m.winding_c - 25 == near(2 * 2e-5 * 500**2, 1e-3)


# ---- shorted turns ----

MU, R_S = 0.2, 0.05


@pytest.mark.parametrize("k", range(3))
def test_dc_through_shorted_turns(k):
    """The phase is its healthy turns in series with the shorted ones beside R_s."""
    m, source, beside = locked(), terminals(*(1.5 if n == k else 0 for n in range(3))), MU * R * R_S / (MU * R + R_S)
    c.motor_short_winding(m, k, MU, R_S)
    coast(m, 40e-3, source)
    i = currents(m)[k]
    assert i == near(1.5 / ((1 - MU) * R + beside + R / 2), 1e-6) and m.loop_a == near(i * beside / R_S, 1e-6)
    before_j = m.energy_in_j - m.energy_copper_j - m.energy_fault_j
    coast(m, 1e-3, source)
    assert m.energy_in_j - m.energy_copper_j - m.energy_fault_j == near(before_j, 1e-9), "all of the power is heat"
    c.motor_short_winding(m, (k + 1) % 3, MU, R_S)
    assert m.loop_a == 0, "others begin without a current"


def test_spinning_shorted_turns():
    """Open terminals: the loop is the EMF of its turns on R_s and their own resistance and inductance, of a machine that is not
    salient, so that one inductance does."""
    m, w = motor(lq_h=LD), 400
    c.motor_short_winding(m, 1, MU, R_S)
    c.motor_spin(m, 100)
    coast(m, 10e-3)
    loop_h, loop_ohm, turn_s = m.fault.loop_h + 2 / 3 * MU * MU * LD, R_S + MU * R, TURN / w
    peak_a, found_a, before_j = MU * w * FLUX / math.hypot(loop_ohm, w * loop_h), 0, m.energy_driver_j
    for _ in range(1000):
        coast(m, turn_s / 1000)
        found_a = max(found_a, abs(m.loop_a))
        assert np.abs(currents(m)).sum() < 1e-9
    heat_j = 0.5 * loop_ohm * peak_a**2 * turn_s
    assert found_a == near(peak_a, 1e-4 * peak_a) and m.energy_driver_j - before_j == near(heat_j, 1e-3 * heat_j)
    c.motor_mend_winding(m)
    before_j = m.energy_driver_j
    coast(m, 1e-3)
    assert m.energy_driver_j - before_j == near(0, 1e-9)


def test_open_terminals_show_the_emf():
    m = motor(0.3)
    c.motor_spin(m, 150)
    for n in range(1, 201):
        coast(m, 50e-6)
        x = 0.3 + 600 * 50e-6 * n - np.arange(3) * TURN / 3
        assert triple(c.motor_star_voltages, m, terminals(0, 0, 0, held=(0, 1, 2))) == near(-600 * FLUX * np.sin(x), 1e-6)
    assert np.abs(currents(m)).max() < 1e-12 and abs(c.motor_torque_nm(m)) < 1e-12
