# SPDX-License-Identifier: MIT
"""Every number of struct tuning against exact rationals, over random parameters of the whole ranges and the shipped motors."""
import math
import random
import re
from fractions import Fraction

import pytest
from launcher.data import MOTORS, available
from launcher.drive import console_params, load_drive

from unit.conftest import SOURCE

PI = Fraction(314159265358979323846264338328, 10**29)
PWM_HZ, SLOW_HZ, BASE_HZ = 20000, 1000, 1250
REFUSED_BEFORE = ("ERROR_SPEED_BEYOND_OBSERVER", "ERROR_SPEED_MAX_BEYOND_OVERSPEED", "ERROR_V_LIMITS",
                  "ERROR_V_MIN_BELOW_MODULATOR", "ERROR_I_TRIP_BEYOND_RANGE", "ERROR_I_MAX_BEYOND_TRIP",
                  "ERROR_I_ALIGN_BEYOND_MAX")
CONSTANTS = Fraction(1, 10**8)  # relative, by which the C constants are rounded
REFUSED_FOR_GAINS = ("ERROR_CURRENT_GAIN", "ERROR_CURRENT_INTEGRAL_GAIN", "ERROR_DECOUPLING", "ERROR_SPEED_GAIN")


def struct(c, values):
    params = c.params()
    for name, value in values.items():
        setattr(params, name, value)
    return params


def compute(c, values):
    """(error's name, value, struct tuning)."""
    tuning = c.tuning()
    outcome = c.tuning_compute(struct(c, values), tuning)
    names = {number: name for name, number in c.enums["error"].items()}
    return names[outcome.error], outcome.value, tuning


def ranges():
    source = (SOURCE / "firmware/settings/params.c").read_text()
    rows = re.findall(r"^\s+PARAM\((\w+), (-?\d+), (-?\d+), (-?\d+)\)", source, re.MULTILINE)
    return {name: (int(low), int(high)) for name, low, high, _ in rows}


def shipped(motor="teknic_m2310p"):
    return console_params(load_drive(motor))


def drawn(draw):
    """Any parameters of their ranges, evenly over the decades; limits put in order, so that most get as far as the gains."""
    p = {name: min(high, max(low, round(math.exp(draw.uniform(math.log(max(low, 1)), math.log(high))))))
         for name, (low, high) in ranges().items()}
    p["i_trip_ma"] = max(10, p["i_range_ma"] * draw.randint(50, 95) // 100)
    p["i_max_ma"] = max(10, p["i_trip_ma"] * draw.randint(30, 85) // 100)
    p["i_align_ma"] = max(10, p["i_max_ma"] * draw.randint(20, 100) // 100)
    p["v_max_mv"] = p["v_range_mv"] * draw.randint(60, 98) // 100
    p["v_min_mv"] = max(1000, p["v_range_mv"] * draw.randint(25, 50) // 100)
    p["speed_max_rpm"] = draw.randint(1, max(1, min(20000, 60000 // p["pole_pairs"])))
    p["overspeed_rpm"] = p["speed_max_rpm"] + draw.randint(1, 100)
    return p


def exact(c, p):
    """What the header promises, unrounded."""
    per_unit = Fraction(p["i_range_ma"], p["v_range_mv"])
    reactance = {axis: 2 * PI * Fraction(p[f"l{axis}_uh"], 10**6) * per_unit for axis in "dq"}
    kt = Fraction(3, 2) * p["pole_pairs"] * Fraction(c.mtpa_flux_nwb(struct(c, p)), 10**9)
    amperes = Fraction(p["inertia_gmm2"], 10**9) / kt  # per rad/s^2
    q15 = Fraction(32768 * 1000, p["i_range_ma"])
    w = 2 * PI * p["speed_bw_hz"]
    kp = amperes * w * (2 * PI / 60) / 16 * q15 * 65536
    count = Fraction(60 * SLOW_HZ * 16, p["encoder_counts"])  # a count a slow period, rpm Q4
    i_max_q15 = Fraction(p["i_max_ma"] * 32768, p["i_range_ma"])
    return {
        "kp_d_q12": reactance["d"] * p["current_bw_hz"] * 4096, "kp_q_q12": reactance["q"] * p["current_bw_hz"] * 4096,
        "ki_q17": 2 * PI * p["current_bw_hz"] * Fraction(p["resistance_mohm"], 1000) * per_unit / PWM_HZ * 2**17,
        "x_d_q11": reactance["d"] * BASE_HZ * 2048, "x_q_q11": reactance["q"] * BASE_HZ * 2048,
        "r_q12": Fraction(p["resistance_mohm"], 1000) * per_unit * 4096,
        "emf_q12": 2 * PI * BASE_HZ * Fraction(p["flux_uwb"], 1000) / p["v_range_mv"] * 4096,
        "speed_kp_q16": kp, "speed_ki_q16": kp * w / 4 / SLOW_HZ,
        "speed_accel_q8": amperes * (2 * PI / 60) / 65536 * SLOW_HZ * q15 * 65536 * 256,
        "speed_ki_min_q16": min(round(i_max_q15) * 65536 / count / 100, kp * w / 4 / SLOW_HZ),
        "ramp_q16": Fraction(p["ramp_rpm_s"] * 65536, SLOW_HZ),
        "i_trip_q15": Fraction(p["i_trip_ma"] * 32768, p["i_range_ma"]), "i_max_q15": i_max_q15,
        "v_min_q15": Fraction(p["v_min_mv"] * 32768, p["v_range_mv"]),
        "v_max_q15": Fraction(p["v_max_mv"] * 32768, p["v_range_mv"]),
        "overspeed_w_q15": Fraction(p["overspeed_rpm"] * p["pole_pairs"] * 32768, 60 * BASE_HZ),
        "encoder_scale_q32": Fraction(p["pole_pairs"] * 2**32, p["encoder_counts"]),
        "encoder_counts": Fraction(p["encoder_counts"]),
        "speed_per_count": Fraction(60 * 10**8 * 32768, 16 * 256 * p["encoder_counts"]),
        "way_per_count_q12": Fraction(60 * 1000 * 32768 * 4096, 256 * p["encoder_counts"]),
        "count_per_way_q16": Fraction(p["encoder_counts"] * 2**32, 60 * 1000 * 32768),
    }


def check(c, tuning, p):
    for name, value in exact(c, p).items():
        error = abs(getattr(tuning, name) - value)
        assert error <= Fraction(1, 2) + CONSTANTS * value, f"{name} {getattr(tuning, name)}, exactly {float(value)}: {p}"


@pytest.mark.parametrize("motor", available(MOTORS))
def test_shipped_motors(c, motor):
    error, _, tuning = compute(c, shipped(motor))
    assert error == "ERROR_NONE"
    check(c, tuning, shipped(motor))


def test_any_parameters(c):
    """Each gain within its rounding, or refused because it does not fit its format."""
    draw, seen = random.Random(9), {}
    for _ in range(1500):
        p = drawn(draw)
        error, _, tuning = compute(c, p)
        seen[error] = seen.get(error, 0) + 1
        value = exact(c, p)
        fits = {"ERROR_CURRENT_GAIN": max(value["kp_d_q12"], value["kp_q_q12"]) < 32767.5,
                "ERROR_CURRENT_INTEGRAL_GAIN": 0.5 <= value["ki_q17"] < 32767.5,
                "ERROR_DECOUPLING": max(value[name] for name in ("x_d_q11", "x_q_q11", "emf_q12", "r_q12")) < 32767.5,
                "ERROR_SPEED_GAIN": (value["speed_kp_q16"] >= 0.5
                                     and max(value["speed_kp_q16"], value["speed_accel_q8"]) < 2**31)}
        misfit = next((name for name in REFUSED_FOR_GAINS if not fits[name]), None)
        if error in REFUSED_BEFORE:
            continue
        assert (error if error in REFUSED_FOR_GAINS else None) == misfit, p
        if misfit is None:
            check(c, tuning, p)
    assert min(seen.get(name, 0) for name in ("ERROR_NONE", *REFUSED_FOR_GAINS)) > 20, seen


def test_products_over_a_divisor(c):
    draw = random.Random(3)
    for _ in range(5000):
        a, b, d = (draw.getrandbits(draw.randint(0, 63)) for _ in range(3))
        d = max(d, 1)
        expected = (a * b + d // 2) // d
        got = c.scale(a, b, d)
        assert got == min(expected, 2**63 - 1), (a, b, d)


LIMITS = [
    ("ERROR_I_TRIP_BEYOND_RANGE", "i_trip_ma", lambda p: p["i_range_ma"] * 95 // 100, +1),
    ("ERROR_I_MAX_BEYOND_TRIP", "i_max_ma", lambda p: p["i_trip_ma"] * 85 // 100, +1),
    ("ERROR_I_ALIGN_BEYOND_MAX", "i_align_ma", lambda p: p["i_max_ma"], +1),
    ("ERROR_V_LIMITS", "v_max_mv", lambda p: p["v_range_mv"] * 98 // 100, +1),
    ("ERROR_V_LIMITS", "v_min_mv", lambda p: p["v_max_mv"] - 1, +1),
    ("ERROR_SPEED_MAX_BEYOND_OVERSPEED", "speed_max_rpm", lambda p: p["overspeed_rpm"] - 1, +1),
    ("ERROR_V_MIN_BELOW_MODULATOR", "v_min_mv", lambda p: p["v_range_mv"] // 4, -1),
    ("ERROR_SPEED_BEYOND_OBSERVER", "overspeed_rpm", lambda p: 60 * BASE_HZ * 95 // 100 // p["pole_pairs"], +1),
]


@pytest.mark.parametrize("error, name, limit, beyond", LIMITS)
def test_each_limit_where_it_is(c, error, name, limit, beyond):
    p = shipped()
    p[name] = limit(p)
    assert compute(c, p)[0] == "ERROR_NONE"
    p[name] += beyond
    assert compute(c, p)[0] == error
