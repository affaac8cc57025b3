# SPDX-License-Identifier: MIT
"""Field weakening: the table against brute force, and the whole limiter in many states."""
import cmath
import math
import random

import pytest
from launcher.capability import CIRCLE

from rigs.firmware import ROOT
from rigs.motor_numbers import compute, shipped, struct

Q15 = 32768
BASE_HZ = 1250
MACHINES = {"surface": {}, "salient": {"lq_uh": 400}, "reversed": {"ld_uh": 400},
            "finite psi over L": {"ld_uh": 700, "lq_uh": 700, "speed_bw_hz": 30},
            "reluctance": {"lq_uh": 1500, "flux_uwb": 3000}}
WHOLE = 21045  # v_d_max_steps of the handlers for weakening


def built(c, changes, v_d_max_steps=WHOLE):
    params, tuning, table, weakening = c.params(), c.tuning(), c.torque_map(), c.weakening()
    c.params_init(params)
    for name, value in changes.items():
        setattr(params, name, value)
    assert c.tuning_compute(params, tuning).error == c.ERROR_NONE
    c.torque_map_build(table, params, tuning)
    c.weakening_build(weakening, table, params, tuning, v_d_max_steps)
    return params, tuning, weakening


class Machine:
    """Constant inductances, per unit at the base speed."""

    def __init__(self, c, params):
        per_henry = 2 * math.pi * 1250 / (params.v_range_mv * 1e-3)
        self.magnet = params.flux_uwb * 1e-6 * per_henry
        self.x_d, self.x_q = (x * 1e-6 * params.i_range_ma * 1e-3 * per_henry for x in (params.ld_uh, params.lq_uh))
        self.unit = c.mtpa_flux_nwb(params) * 1e-9 * per_henry

    def flux(self, i_d, i_q):
        return math.hypot(self.magnet + self.x_d * i_d, self.x_q * i_q)

    def torque(self, i_d, i_q):
        return i_q * (self.magnet - (self.x_q - self.x_d) * i_d) / self.unit

    def most(self, flux, i_max):
        """Brute force over a grid of currents: no formula."""
        best = 0.0
        for angle in range(0, 361):
            turned = cmath.exp(1j * math.radians(angle / 2))
            for part in range(1, 121):
                i = turned * i_max * part / 120
                if self.flux(i.real, i.imag) <= flux:
                    best = max(best, self.torque(i.real, i.imag))
        return best


@pytest.mark.parametrize("name", MACHINES)
def test_the_table_gives_what_brute_force_finds(c, name):
    params, tuning, weakening = built(c, MACHINES[name])
    machine, i_max = Machine(c, params), tuning.i_max_q15 / Q15
    low, top = weakening.flux_q15[0], weakening.top_q15
    for share in (0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 0.99):
        flux_q15 = round(low + share * (top - low))
        row = c.weakening_row(weakening, flux_q15)
        most = c.weakening_torque(row, tuning.i_max_q15)
        assert most / Q15 >= 0.975 * machine.most(flux_q15 / Q15, i_max), share
        for torque in (0, most // 3, 2 * most // 3, most):
            at = c.weakening_currents(row, torque)
            i_d, i_q = at.i_d_q15 / Q15, at.i_q_q15 / Q15
            assert machine.flux(i_d, i_q) <= flux_q15 / Q15 * 1.001 + 3 * (machine.x_d + machine.x_q) / Q15
            assert math.hypot(i_d, i_q) <= i_max + 1.5 / Q15
            first = c.weakening_currents(row, 0).torque_q15  # the map serves below that
            if torque >= first:
                assert machine.torque(i_d, i_q) == pytest.approx(torque / Q15, rel=0.02, abs=0.001)


def test_rows_rise_and_one_is_the_magnets_own(c):
    for changes in MACHINES.values():
        params, _, weakening = built(c, changes)
        fluxes = list(weakening.flux_q15)
        assert fluxes == sorted(fluxes) and fluxes[-1] >= weakening.top_q15
        magnet = 2 * math.pi * 1250 * params.flux_uwb * 1e-3 / params.v_range_mv * Q15
        assert fluxes[c_below()] == pytest.approx(magnet, abs=2)


def c_below():
    text = (ROOT / "firmware/control/weakening.h").read_text()
    return int(next(line for line in text.splitlines() if line.startswith("#define WEAKENING_BELOW")).split()[2])


def test_a_smaller_current_limit_is_kept(c):
    _, tuning, weakening = built(c, MACHINES["surface"])
    for flux in range(weakening.flux_q15[0], weakening.top_q15, 500):
        row = c.weakening_row(weakening, flux)
        last = 0
        for limit in range(0, tuning.i_max_q15 + 1, 200):
            torque = c.weakening_torque(row, limit)
            at = c.weakening_currents(row, torque)
            assert torque == 0 or math.hypot(at.i_d_q15, at.i_q_q15) <= limit + 2
            assert torque >= last
            last = torque


STATES, UNLIMITED = 12_000, 2**31 - 1


def any_state(c, draw, s, loop, t):
    """Of a drive with that torque control: what it measures and what was left from before; the view of its limits."""
    def any_of(low, high):
        return int(draw.uniform(low, high))

    def seldom(low, high, otherwise):
        return any_of(low, high) if draw.random() < 0.3 else otherwise
    w_q15 = any_of(-31000, 31000)
    loop.pll.speed_q32, loop.weaken.on = w_q15 * 8192, t.weakens
    loop.v_d_q15, loop.v_q_q15 = any_of(-9000, 9000), any_of(-9000, 9000)
    loop.i_d_ref_q15, loop.i_q_ref_q15 = any_of(-t.i_max_q15, 0), any_of(-t.i_max_q15, t.i_max_q15)
    s.torque_q15, s.burn_q15, s.sink_q18 = any_of(-32768, 32767), seldom(0, t.burn_max_q15, 0), any_of(0, 262144)
    s.energy_q25 = any_of(0, t.bus_set_energy_q25)
    s.flux.trim_q21, s.flux.drop_q15 = any_of(-200000, 60000), any_of(-3000, 3000)
    t.power_max_q15, t.regen_max_q15 = seldom(0, 20000, 65535), seldom(0, 20000, 65535)
    view = c.torque_view()
    view.speed_rpm_q4, view.i_limit_q15 = int(w_q15 * 9.155), seldom(-10, t.i_max_q15, t.i_max_q15)
    view.limit_speed = draw.random() < 0.3
    return view, any_of(-32768, 32767) if draw.random() < 0.9 else 0, any_of(8000, 32760)


@pytest.mark.parametrize("ld_uh, lq_uh", ((200, 200), (200, 400), (400, 200), (600, 600), (200, 1200)))
def test_in_any_state_no_limit_is_passed(c, ld_uh, lq_uh):
    """No torque turned round, no current beyond i_max, no flux that the voltage does not carry, the torque that was granted."""
    params, t, s, loop, draw = c.params(), c.tuning(), c.torque_control(), c.current_loop(), random.Random(ld_uh + lq_uh)
    c.params_init(params)
    params.ld_uh, params.lq_uh, params.speed_max_rpm, params.overspeed_rpm = ld_uh, lq_uh, 9000, 10000
    assert c.tuning_compute(params, t).error == c.ERROR_NONE
    c.torque_build(s, params, t, 13600)
    machine, weakened, limited = Machine(c, params), 0, 0
    c.current_loop_init(loop)
    lsb = (machine.x_d + machine.x_q) * 3 / Q15 + 0.002 * machine.magnet
    least = max(machine.magnet - machine.x_d * t.i_max_q15 / Q15, 0)
    for n in range(STATES):
        view, wish, vbus = any_state(c, draw, s, loop, t)
        before = s.torque_q15
        c.torque_measure(s, loop, t, vbus)
        ends = loop.weaken.on and loop.weaken.q_first != 0 and (before ^ s.emf_q15) < 0
        c.torque_set_limits(s, t, view)
        c.torque_ask(s, loop, t, wish)
        i_d, i_q, torque = loop.i_d_ref_q15 / Q15, loop.i_q_ref_q15 / Q15, s.torque_q15
        made = machine.torque(i_d, i_q) * Q15
        # what brakes deep in weakening may end later than it is wished, but gets no larger
        fades = ends and torque * before >= 0 and abs(torque) < abs(before)
        assert fades or (torque * wish >= 0 and made * wish >= 0 and abs(torque) <= abs(wish)), n
        assert s.limits.low <= 0 <= s.limits.high and math.hypot(i_d, i_q) * Q15 <= t.i_max_q15 + 2, n
        assert s.flux.flux_q15 == UNLIMITED or machine.flux(i_d, i_q) <= max(s.flux.flux_q15 / Q15, least) + lsb, n
        assert abs(made) <= 1.03 * abs(torque) + 60, n
        weakened, limited = weakened + s.flux.decides, limited + (torque != wish)
    assert weakened > 0.3 * STATES and limited > 0.3 * STATES


@pytest.mark.parametrize("overspeed, told, fits", ((7759, 0, True), (7760, 0, False), (7760, 1, True)))
def test_magnets_that_would_charge_the_bus(c, overspeed, told, fits):
    """36 V between two phases of 6.395 mWb and 4 pole pairs are 7759 rpm."""
    params = c.params()
    c.params_init(params)
    params.overspeed_rpm, params.emf_beyond_v_max = overspeed, told
    outcome = c.tuning_check_motor(params)
    assert outcome.error == (c.ERROR_NONE if fits else c.ERROR_EMF_BEYOND_V_MAX)
    assert fits or outcome.value == 7759


def test_theory_has_the_circle_of_the_firmware(c):
    loop = c.current_loop()
    c.current_loop_init(loop)
    assert max(loop.circle_steps) / 40000 == pytest.approx(CIRCLE, rel=1e-3)  # the bus is 2500 counts of 16 steps


def test_limits_of_power(c):
    """50 W at 3000 rpm are 0.159 N m, driving and braking each by its own limit, whichever way the shaft turns."""
    params, tuning, torque, view = c.params(), c.tuning(), c.torque_control(), c.torque_view()
    c.params_init(params)
    params.power_max_w, params.regen_max_w = 50, 20
    assert c.tuning_compute(params, tuning).error == c.ERROR_NONE
    c.torque_build(torque, params, tuning, 14000)
    view.i_limit_q15 = tuning.i_max_q15
    loop = c.current_loop()
    c.current_loop_init(loop)
    newton_metres = 1.5 * params.pole_pairs * params.flux_uwb * 1e-6 * params.i_range_ma * 1e-3 / Q15
    for sign in (1, -1):
        loop.pll.speed_q32 = sign * round(3000 / 60 * 4 / 20000 * 2**32)
        view.speed_rpm_q4 = sign * 3000 * 16
        torque.torque_q15 = 0
        c.torque_measure(torque, loop, tuning, 14000)
        c.torque_set_limits(torque, tuning, view)
        drive, brake = (torque.limits.high, torque.limits.low) if sign > 0 else (torque.limits.low, torque.limits.high)
        assert sign * drive * newton_metres * math.pi * 100 == pytest.approx(50, rel=0.01)
        assert -sign * brake * newton_metres * math.pi * 100 == pytest.approx(20, rel=0.01)


@pytest.mark.parametrize("motor", ("teknic_m2310p", "baldor_ecs101m0h7ef4"))
@pytest.mark.parametrize("w", (-20, -1, 0, 1, 20))
def test_at_rest_no_limit_of_power_holds_the_shaft(c, w, motor):
    """No braking, and a watt, less than a step with baldor_ecs101m0h7ef4: the sign of the speed is noise, and it begins."""
    told = {**shipped(motor), "power_max_w": 1, "regen_max_w": 0}
    error, _, tuning = compute(c, told)
    assert error == "ERROR_NONE"
    torque, view, loop = c.torque_control(), c.torque_view(), c.current_loop()
    vbus_q15 = 10 * tuning.v_min_q15 // 8
    c.torque_build(torque, struct(c, told), tuning, vbus_q15)
    c.current_loop_init(loop)
    loop.pll.speed_q32 = w << loop.w_shift
    view.i_limit_q15 = tuning.i_max_q15
    view.speed_rpm_q4 = round(w / Q15 * BASE_HZ * 60 / told["pole_pairs"] * 16)
    c.torque_measure(torque, loop, tuning, vbus_q15)
    c.torque_set_limits(torque, tuning, view)
    braking, driving = sorted((torque.limits.low, torque.limits.high), reverse=torque.emf_q15 < 0)
    assert abs(braking) == torque.map.torque_max_q15 and driving != 0
