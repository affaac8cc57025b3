# SPDX-License-Identifier: MIT
"""The table from torque to currents, and the limits of torque, against their definitions in floating point."""
import math
import random

import pytest

Q15 = 32768
NODES = 33

# what makes a machine: name -> parameters that differ from the initial ones
MACHINES = {
    "surface": {},
    "salient": {"lq_uh": 400},
    "slightly salient": {"lq_uh": 201},
    "reversed": {"ld_uh": 400},
    "reluctance": {"ld_uh": 4730, "lq_uh": 20000, "flux_uwb": 133700, "i_range_ma": 50000, "v_range_mv": 500000,
                   "i_max_ma": 33000, "i_trip_ma": 44000, "v_min_mv": 200000, "v_max_mv": 410000, "current_bw_hz": 300,
                   "speed_bw_hz": 20},
    "hardly a magnet": {"lq_uh": 600, "flux_uwb": 100, "speed_bw_hz": 1, "inertia_gmm2": 100},
    "small current": {"lq_uh": 400, "i_max_ma": 100, "i_align_ma": 50},
}


def built(c, changes):
    params, tuning, table = c.params(), c.tuning(), c.torque_map()
    c.params_init(params)
    for name, value in changes.items():
        setattr(params, name, value)
    assert c.tuning_compute(params, tuning).error == c.ERROR_NONE
    c.torque_map_build(table, params, tuning)
    return params, tuning, table


def least_current(p, amplitude):
    """(i_d, i_q, torque in flux times current) of a current as a fraction of i_range: the formula of mtpa.h, in floats."""
    flux, saliency = p.flux_uwb * 1e-6, (p.lq_uh - p.ld_uh) * 1e-6 * p.i_range_ma * 1e-3
    if saliency == 0:
        i_d = 0.0
    else:
        i_d = (flux - math.sqrt(flux ** 2 + 8 * (saliency * amplitude) ** 2)) / (4 * saliency)
    i_q = math.sqrt(amplitude ** 2 - i_d ** 2)
    return i_d, i_q, i_q * (flux - saliency * i_d)


def at(table, column, torque):
    """Interpolation as the firmware does it."""
    n, part = torque >> table.shift, torque & ((1 << table.shift) - 1)
    column = getattr(table, column)
    return column[n] + (((column[n + 1] - column[n]) * part + ((1 << table.shift) >> 1)) >> table.shift)


@pytest.mark.parametrize("name", MACHINES)
def test_nodes_are_currents_of_least_amplitude(c, name):
    params, tuning, table = built(c, MACHINES[name])
    full = least_current(params, 1.0)[2]
    for n in range(NODES):
        torque = (n << table.shift) / Q15
        i_d, i_q, amplitude = table.i_d_q15[n] / Q15, table.i_q_q15[n] / Q15, table.current_q15[n] / Q15
        want_d, want_q, want_torque = least_current(params, amplitude)
        assert (i_d, i_q) == pytest.approx((want_d, want_q), abs=1.5 / Q15)
        # half a unit of current, where torque rises by up to 2 for 1
        assert want_torque / full == pytest.approx(torque, abs=1.2 / Q15)
        volt_d = tuning.emf_q12 / 4096 + tuning.x_d_q11 / 2048 * i_d
        assert table.flux_q15[n] / Q15 == pytest.approx(math.hypot(volt_d, tuning.x_q_q11 / 2048 * i_q), abs=5 / Q15)


@pytest.mark.parametrize("name", MACHINES)
def test_no_other_current_of_that_amplitude_makes_more(c, name):
    """Not the formula but what it is for: turned by a degree either way, the same current makes less torque."""
    params, _, table = built(c, MACHINES[name])
    flux, saliency = params.flux_uwb * 1e-6, (params.lq_uh - params.ld_uh) * 1e-6 * params.i_range_ma * 1e-3
    n = NODES - 1
    current = complex(table.i_d_q15[n], table.i_q_q15[n]) / Q15

    def torque(i):
        return i.imag * (flux - saliency * i.real)
    for turn in (-1, 1):
        assert torque(current * complex(math.cos(math.radians(turn)), math.sin(math.radians(turn)))) < torque(current)


@pytest.mark.parametrize("name", MACHINES)
def test_between_nodes_torque_is_right_and_current_within_i_max(c, name):
    params, tuning, table = built(c, MACHINES[name])
    full = least_current(params, 1.0)[2]
    flux, saliency = params.flux_uwb * 1e-6, (params.lq_uh - params.ld_uh) * 1e-6 * params.i_range_ma * 1e-3
    assert table.torque_max_q15 / Q15 == pytest.approx(least_current(params, tuning.i_max_q15 / Q15)[2] / full, abs=1.5 / Q15)
    assert NODES // 2 << table.shift <= table.torque_max_q15 < (NODES - 1) << table.shift
    for torque in range(0, table.torque_max_q15 + 1, 7):
        i_d, i_q = at(table, "i_d_q15", torque), at(table, "i_q_q15", torque)
        made = i_q * (flux - saliency * i_d / Q15) / full
        # where reluctance makes the torque, it grows with the square of the current: a chord misses most in the first interval
        missed = 0.26 if name == "hardly a magnet" else 0.03
        assert made == pytest.approx(torque, abs=2 + missed * (1 << table.shift))
        assert math.hypot(i_d, i_q) <= tuning.i_max_q15 + 1.5
        assert (i_d == 0) if saliency == 0 else (i_d * saliency <= 0)


def test_a_machine_without_saliency_has_torque_for_q_current(c):
    _, tuning, table = built(c, {})
    assert table.torque_max_q15 == tuning.i_max_q15
    assert all(at(table, "i_q_q15", torque) == torque for torque in range(table.torque_max_q15))
    assert not any(table.i_d_q15)


@pytest.mark.parametrize("name", MACHINES)
def test_what_torque_is_worth(c, name):
    """The speed controller's gains and the bus's power stand on it."""
    params, tuning, _ = built(c, MACHINES[name])
    flux_wb = least_current(params, 1.0)[2]
    assert c.mtpa_flux_nwb(params) * 1e-9 == pytest.approx(flux_wb, rel=1e-5)
    emf = 2 * math.pi * 1250 * flux_wb / (params.v_range_mv * 1e-3)
    assert tuning.torque_emf_q11 / 2048 == pytest.approx(emf, abs=1 / 2048)


def test_the_speed_gain_goes_by_what_torque_is_worth(c):
    """The same inertia: twice the torque for a torque of 1.0, half the gain."""
    products = [tuning.speed_kp_q16 * tuning.torque_emf_q11
                for _, tuning, _ in (built(c, MACHINES[name]) for name in ("surface", "salient", "reversed"))]
    assert products[1:] == pytest.approx(products[:1] * 2, rel=2e-3)


def test_apparent_inductances_make_the_map_and_nothing_else(c):
    """Saturated iron: MTPA and flux go by flux over current, the current loop by small changes."""
    _, plain, plain_table = built(c, MACHINES["salient"])
    params, tuning, table = built(c, {**MACHINES["salient"], "ld_apparent_uh": 250, "lq_apparent_uh": 1200})
    for name in ("kp_d_q12", "kp_q_q12", "x_d_q11", "x_q_q11"):
        assert getattr(tuning, name) == getattr(plain, name)
    params.ld_uh, params.lq_uh = 250, 1200
    for n in range(NODES):
        i_d, i_q, _ = least_current(params, table.current_q15[n] / Q15)
        assert (table.i_d_q15[n] / Q15, table.i_q_q15[n] / Q15) == pytest.approx((i_d, i_q), abs=1.5 / Q15)
        volt_d = tuning.emf_q12 / 4096 + tuning.x_d_q11 / 2048 * 250 / 200 * i_d
        volt_q = tuning.x_q_q11 / 2048 * 1200 / 400 * i_q
        assert table.flux_q15[n] / Q15 == pytest.approx(math.hypot(volt_d, volt_q), abs=5 / Q15)
    assert table.i_d_q15[NODES - 1] < 1.5 * plain_table.i_d_q15[NODES - 1]


EXTREME = {"flux_uwb": (10, 10000000), "ld_uh": (1, 1000000), "lq_uh": (1, 1000000), "i_range_ma": (100, 2000000)}


def test_any_parameters(c):
    """No combination overflows (the build traps it), and torque stands for a positive flux."""
    rng = random.Random(5)
    params, tuning, table = c.params(), c.tuning(), c.torque_map()
    c.params_init(params)
    assert c.tuning_compute(params, tuning).error == c.ERROR_NONE
    cases = [{k: v[(n >> i) & 1] for i, (k, v) in enumerate(EXTREME.items())} for n in range(16)]
    cases += [{k: round(math.exp(rng.uniform(math.log(low), math.log(high)))) for k, (low, high) in EXTREME.items()}
              for _ in range(300)]
    for case in cases:
        for key, value in case.items():
            setattr(params, key, value)
        tuning.i_max_q15 = rng.choice((1, 100, 26460))
        c.torque_map_build(table, params, tuning)
        flux, saliency = params.flux_uwb * 1e-6, (params.lq_uh - params.ld_uh) * 1e-9 * params.i_range_ma
        want = least_current(params, 1.0)[2]
        assert c.mtpa_flux_nwb(params) * 1e-9 == pytest.approx(want, rel=2e-4), case
        last = [table.i_q_q15[n] for n in range(NODES)]
        assert last == sorted(last) and list(table.current_q15) == sorted(table.current_q15)
        if abs(saliency) > 1e-3 * flux:
            n = NODES - 1
            want_d, want_q, _ = least_current(params, table.current_q15[n] / Q15)
            assert (table.i_d_q15[n] / Q15, table.i_q_q15[n] / Q15) == pytest.approx((want_d, want_q), abs=2 / Q15), case
