# SPDX-License-Identifier: MIT
"""Limits of torque by construction, on random states: no limiter turns a torque round, and each one is kept."""
import math
import os
import random

import pytest

Q15 = 32768
SALIENT = {"lq_uh": 400}
REVERSED = {"ld_uh": 400}


@pytest.fixture(scope="module")
def machines(c):
    """name -> (params, tuning, torque_control with its table)"""
    made = {}
    for name, changes in (("surface", {}), ("salient", SALIENT), ("reversed", REVERSED)):
        params, tuning, torque = c.params(), c.tuning(), c.torque_control()
        c.params_init(params)
        for key, value in changes.items():
            setattr(params, key, value)
        assert c.tuning_compute(params, tuning).error == c.ERROR_NONE
        c.torque_build(torque, params, tuning, 14000)
        made[name] = params, tuning, torque
    return made


def step(c, machine, wish, **state):
    """One step of a drive in this state; returns the current loop with its references."""
    _, tuning, torque = machine
    loop, view = c.current_loop(), c.torque_view()
    c.current_loop_init(loop)
    loop.pll.speed_q32 = state.get("w_q15", 0) * 8192
    loop.radius_q15 = state.get("radius_q15", 12000)
    view.speed_rpm_q4 = state.get("speed_rpm_q4", 0)
    view.i_limit_q15 = state.get("i_limit_q15", tuning.i_max_q15)
    view.limit_speed = state.get("limit_speed", False)
    torque.torque_q15 = state.get("last_q15", 0)
    torque.demand_sum_q15 = 2 * torque.torque_q15
    torque.sink_q18 = state.get("sink_q18", 0)
    torque.burn_q15, torque.copper_q15 = state.get("burn_q15", 0), state.get("copper_q15", 0)
    torque.return_q19 = state.get("return_q19", 0)
    torque.energy_q25 = state.get("energy_q25", 0)
    c.torque_measure(torque, loop, tuning, state.get("vbus_q15", 14000))
    c.torque_set_limits(torque, tuning, view)
    c.torque_ask(torque, loop, tuning, wish)
    return loop


def made_torque(machine, loop):
    """What the references make, as a fraction of the torque of i_range."""
    params = machine[0]
    flux, saliency = params.flux_uwb * 1e-6, (params.lq_uh - params.ld_uh) * 1e-9 * params.i_range_ma
    i_d, i_q = loop.i_d_ref_q15 / Q15, loop.i_q_ref_q15 / Q15
    return i_q * (flux - saliency * i_d) / (machine[1].torque_emf_q11 / 2048 * params.v_range_mv * 1e-3 / (2 * math.pi * 1250))


def any_state(rng, tuning):
    w_q15 = rng.choice((0, rng.randint(-40, 40), rng.randint(-31000, 31000)))
    rpm_q4 = w_q15 * 60 * 1250 * 16 // 4 // Q15
    return {"w_q15": w_q15, "speed_rpm_q4": rpm_q4, "radius_q15": rng.randint(3000, 17500),
            "i_limit_q15": rng.choice((0, rng.randint(-5, tuning.i_max_q15), 32767)), "limit_speed": rng.random() < 0.5,
            "last_q15": rng.randint(-Q15, Q15), "sink_q18": rng.choice((0, rng.randint(0, 8 * Q15))),
            "burn_q15": rng.choice((0, rng.randint(0, tuning.burn_max_q15))), "vbus_q15": rng.randint(8000, 32760),
            "energy_q25": rng.randint(0, tuning.bus_set_energy_q25 * 2)}


@pytest.mark.parametrize("name", ["surface", "salient", "reversed"])
def test_no_limiter_turns_a_torque_round(c, machines, name):
    """Every limiter at work, in any combination. TORQUE_STATES asks for more states than the usual ones."""
    machine = machines[name]
    _, tuning, torque = machine
    rng = random.Random(name)
    for _ in range(int(os.environ.get("TORQUE_STATES", 20000))):
        wish, state = rng.choice((0, rng.randint(-Q15, Q15 - 1))), any_state(rng, tuning)
        loop = step(c, machine, wish, **state)
        got = torque.torque_q15
        assert torque.limits.low <= 0 <= torque.limits.high and torque.bus.low <= 0 <= torque.bus.high
        assert got * wish >= 0 and abs(got) <= abs(wish)
        assert torque.limits.low <= got <= torque.limits.high
        assert torque.bus.low <= torque.limits.low and torque.limits.high <= torque.bus.high
        assert loop.i_q_ref_q15 * wish >= 0
        limit = min(max(state["i_limit_q15"], 0), tuning.i_max_q15)
        if torque.flux.decides:  # what weakening takes without torque comes before the thermal limit
            limit = max(limit, least_i_d(c, torque))
        assert math.hypot(loop.i_d_ref_q15, loop.i_q_ref_q15) <= limit + 2 <= tuning.i_max_q15 + 2
        made = made_torque(machine, loop) * Q15
        assert abs(made) <= 1.02 * abs(got) + 40
        if torque.burn_q15 == 0 or name != "reversed":  # where burning takes from the torque
            assert made == pytest.approx(got, rel=0.02, abs=40)


def least_i_d(c, torque):
    """The current of the present flux limit without torque."""
    row = c.weakening_row(torque.weakening, torque.flux.flux_q15)
    return math.hypot(*(getattr(c.weakening_currents(row, 0), name) for name in ("i_d_q15", "i_q_q15")))


def volts_q15(tuning, loop, w_q15):
    d = tuning.emf_q12 / 4096 * Q15 + tuning.x_d_q11 / 2048 * loop.i_d_ref_q15
    q = tuning.x_q_q11 / 2048 * loop.i_q_ref_q15
    return math.hypot(d, q) * abs(w_q15) / Q15


SHARE = 21207 / 40000  # of the bus: the circle, in steps


@pytest.mark.parametrize("name", ["surface", "salient", "reversed"])
def test_the_voltage_suffices(c, machines, name):
    """And it is used: 31/32 of the circle are filled where the voltage limits the torque."""
    machine = machines[name]
    _, tuning, torque = machine
    rng = random.Random(name)
    limited = 0
    for _ in range(4000):
        w_q15, vbus = rng.randint(1500, 15000), rng.randint(8000, 32760)
        torque.flux = c.flux_limit(flux_q15=2**31 - 1)
        torque.torque_q15 = Q15 - 1  # no step, which takes its time
        torque.emf_q15 = 0
        loop = step(c, machine, Q15 - 1, w_q15=w_q15, vbus_q15=vbus, last_q15=Q15 - 1)
        kept = 31 / 32 * SHARE * vbus
        drop = torque.flux.drop_q15 / Q15
        usable = math.sqrt(max((kept / Q15) ** 2 - drop, 0)) * Q15
        volts = volts_q15(tuning, loop, w_q15)
        weakest = (tuning.emf_q12 / 4096 * Q15 - tuning.x_d_q11 / 2048 * tuning.i_max_q15) * w_q15 / Q15
        assert volts <= max(usable, weakest) * 1.005 + 30
        if torque.flux.decides and usable > 1.05 * weakest:
            limited += 1
            assert volts >= 0.93 * usable - 30
    assert limited > 60


@pytest.mark.parametrize("name", ["surface", "salient", "reversed"])
def test_a_smaller_current_limit(c, machines, name):
    machine = machines[name]
    tuning = machine[1]
    for limit in range(0, tuning.i_max_q15, 97):
        loop = step(c, machine, -Q15, i_limit_q15=limit)
        assert limit - 3 - 0.001 * Q15 <= math.hypot(loop.i_d_ref_q15, loop.i_q_ref_q15) <= limit + 2


def at_voltage(tuning, vbus_q15):
    """A bus that has been there before."""
    return {"vbus_q15": vbus_q15, "energy_q25": ((vbus_q15 ** 2) >> 15) * tuning.bus_energy_q10}


def room_q15(tuning, state):
    """Power that fills in a millisecond a quarter of what is left up to 99.7 % of v_max."""
    top = tuning.bus_set_energy_q25 + tuning.bus_set_energy_q25 // 64 * 5
    return max(0, top - state["energy_q25"]) / 1024 / 4


def test_the_bus_limits_braking_alone(c, machines):
    """Above v_set nothing is fed back but what the windings burn, either way round; driving and standing still are free."""
    machine = machines["surface"]
    _, tuning, torque = machine
    above = at_voltage(tuning, tuning.v_max_q15 - 100)
    for w_q15 in (4000, -4000):
        rpm_q4 = w_q15 * 60 * 1250 * 16 // 4 // Q15
        sign = 1 if w_q15 > 0 else -1
        for burnt in (0, 3000):
            step(c, machine, -sign * 9000, w_q15=w_q15, speed_rpm_q4=rpm_q4, copper_q15=burnt, **above)
            watts_q15 = abs(torque.torque_q15 * torque.emf_q15) / Q15
            assert watts_q15 == pytest.approx(min(burnt, room_q15(tuning, above)), abs=2)
        step(c, machine, sign * 9000, w_q15=w_q15, speed_rpm_q4=rpm_q4, **above)
        assert torque.torque_q15 == sign * 9000
        step(c, machine, -sign * 9000, w_q15=sign * 20, speed_rpm_q4=sign * 29 * 16, **above)
        assert torque.torque_q15 == -sign * 9000


def test_the_bus_allows_what_is_missing_up_to_its_set_point(c, machines):
    """In joules: in a millisecond a quarter of C/2 (v_set^2 - v^2), with 96 % of v_max as v_set."""
    machine = machines["surface"]
    params, tuning, torque = machine
    w_q15, set_v = 6000, 0.96 * params.v_max_mv * 1e-3
    rpm = w_q15 / Q15 * 1250 * 60 / params.pole_pairs
    for volt in (33.0, 30.0, 24.0):
        vbus_q15 = round(volt / (params.v_range_mv * 1e-3) * Q15)
        step(c, machine, -10000, w_q15=w_q15, speed_rpm_q4=round(rpm * 16), **at_voltage(tuning, vbus_q15))
        watts = params.bus_capacitance_uf * 1e-6 / 2 * (set_v ** 2 - volt ** 2) / 4 / 1e-3
        newton_metres = 1.5 * params.pole_pairs * params.flux_uwb * 1e-6 * -torque.bus.low / Q15 * params.i_range_ma * 1e-3
        assert newton_metres * rpm * math.pi / 30 == pytest.approx(watts, rel=0.01, abs=0.3)


def test_the_observed_power_is_what_went_away(c, machines):
    """A bus that takes 60 W while the motor brakes with 100 W: the capacitor gets 40, and 60 are found."""
    params, tuning, torque = machines["surface"][0], c.tuning(), machines["surface"][2]
    params.bus_capacitance_uf = 30000
    assert c.tuning_compute(params, tuning).error == c.ERROR_NONE
    params.bus_capacitance_uf = 1000
    loop = c.current_loop()
    c.current_loop_init(loop)
    loop.pll.speed_q32 = 8000 * 8192
    unit_w = 1.5 * 57.528 * 23.571
    torque.torque_q15 = -round(100 / unit_w * Q15 * Q15 / (tuning.torque_emf_q11 * 8000 / 2048))
    torque.sink_q18, torque.energy_q25 = 0, round(24 ** 2 / 57.528 ** 2 * Q15) * tuning.bus_energy_q10
    joule, capacitance = 30e-3 / 2 * 24 ** 2, 30e-3
    for _ in range(40):
        joule += 80e-3  # in two milliseconds
        torque.demand_sum_q15 = 2 * torque.torque_q15
        vbus_q15 = round(math.sqrt(2 * joule / capacitance) / 57.528 * Q15)
        c.torque_measure(torque, loop, tuning, vbus_q15)
    assert torque.sink_q18 / 8 / Q15 * unit_w == pytest.approx(60, rel=0.03)


def test_the_motor_runs_away_from_no_torque_command(c, machines):
    """Towards speed_max torque ends as the speed controller would let it end; the other way it is free."""
    machine = machines["surface"]
    params, tuning, torque = machine
    for sign in (1, -1):
        last = None
        for rpm in range(3000, 4200, 10):
            step(c, machine, sign * 15000, w_q15=sign * 100, speed_rpm_q4=sign * rpm * 16, limit_speed=True)
            pushed = torque.torque_q15 * sign
            room = max(params.speed_max_rpm - rpm, 0) * 16 * tuning.speed_kp_q16 / 65536
            assert pushed == pytest.approx(min(room, tuning.i_max_q15), abs=1.5)
            assert last is None or pushed <= last
            last = pushed
            step(c, machine, -sign * 15000, w_q15=sign * 100, speed_rpm_q4=sign * rpm * 16, limit_speed=True)
            assert torque.torque_q15 == -sign * tuning.i_max_q15
        assert last == 0


def test_burning_makes_no_torque_and_ends(c, machines):
    """The bus takes nothing: a current against the magnets grows, within the limits, while the wish for torque is not met."""
    for machine in machines.values():
        _, tuning, torque = machine
        state = {"w_q15": 6000, "speed_rpm_q4": 1000 * 16, **at_voltage(tuning, tuning.v_max_q15 - 400)}
        burn, steps = 0, 0
        while steps < 40:
            loop = step(c, machine, -9000, burn_q15=burn, return_q19=1 << 19, **state)  # more than they can burn
            assert loop.i_q_ref_q15 <= 0
            burn, steps = torque.burn_q15, steps + 1
        assert -loop.i_d_ref_q15 == pytest.approx(tuning.burn_max_q15, abs=2)
        assert tuning.burn_max_q15 == pytest.approx(
            min(tuning.i_max_q15, tuning.emf_q12 / 4096 / (tuning.x_d_q11 / 2048) * Q15), abs=2)
        for _ in range(300):
            loop = step(c, machine, 1000, burn_q15=burn, **state)
            burn = torque.burn_q15
        assert burn == 0 and made_torque(machine, loop) * Q15 == pytest.approx(1000, abs=12)


def test_no_more_is_burnt_than_braking_would_return(c, machines):
    """A demand that swings about nothing returns nothing; a small one is burnt by a small current."""
    for name in ("surface", "salient"):
        params, tuning, torque = machines[name]
        state = {"w_q15": 6000, "speed_rpm_q4": 1000 * 16, **at_voltage(tuning, tuning.v_max_q15 - 400)}
        for demands, returned in (((600, -600), 0), ((-900, -900), 900)):
            burn, mean, burns = 0, 0, []
            for n in range(200):
                step(c, machines[name], demands[n % 2], burn_q15=burn, return_q19=mean, **state)
                burn, mean = torque.burn_q15, torque.return_q19
                burns.append(burn)
            watts_q15 = max(0, returned - tuning.i_max_q15 / 64) * torque.emf_q15 / Q15
            enough = min(math.sqrt(watts_q15 * Q15 / (tuning.r_q12 / 4096)), tuning.burn_max_q15)
            step_q15 = tuning.i_max_q15 / 16
            assert enough - 1.5 * step_q15 <= min(burns[100:]) and max(burns[100:]) <= 1.03 * enough + 2, (name, returned)


def test_while_braking_voltages_are_too_long_no_torque_grows(c, machines):
    """It does where they are short, and where the motor drives; less torque is there at once."""
    _, tuning, torque = machines["salient"]

    def asked(wish, last, length_q15, vbus_q15=12000):
        loop = c.current_loop()
        c.current_loop_init(loop)
        c.torque_reset(torque)
        loop.pll.speed_q32 = 8000 * 8192
        loop.v_q_q15, torque.torque_q15 = length_q15, last
        c.torque_measure(torque, loop, tuning, vbus_q15)
        torque.limits.low, torque.limits.high = -8000, 8000
        c.torque_ask(torque, loop, tuning, wish)
        return torque.torque_q15

    assert asked(-4000, -500, 2000) < -500 and asked(4000, 500, 14000) > 500
    assert asked(-4000, -500, 14000) == pytest.approx(-500, abs=2)
    assert asked(0, -500, 14000) == 0
    for vbus_q15 in (12000, 13000):  # what grows is as fast as the reserve of the bus can move its current
        slew_q15 = c.flux_limit_slew_q15(tuning, vbus_q15)
        assert asked(8000, 500, 14000, vbus_q15) == pytest.approx(500 + slew_q15, abs=5)
        assert asked(-8000, -500, 2000, vbus_q15) == pytest.approx(-500 - slew_q15, abs=5)
