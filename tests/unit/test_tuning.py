# SPDX-License-Identifier: MIT
"""Every number of struct tuning against exact rationals, over random parameters of the whole ranges and the shipped motors."""
import math
import random
from fractions import Fraction

import pytest
from launcher.data import MOTORS, available

from rigs.firmware import ROOT
from rigs.motor_numbers import BASE_HZ, PI, PWM_HZ, SLOW_HZ, compute, shipped, struct
from rows import param_rows

REFUSED_BEFORE = ("ERROR_SPEED_BEYOND_OBSERVER", "ERROR_SPEED_MAX_BEYOND_OVERSPEED", "ERROR_V_LIMITS", "ERROR_CHOPPER_LEVELS",
                  "ERROR_V_MIN_BELOW_MODULATOR", "ERROR_I_TRIP_BEYOND_RANGE", "ERROR_I_MAX_BEYOND_TRIP",
                  "ERROR_I_ALIGN_BEYOND_MAX")
CONSTANTS = Fraction(1, 10**8)  # relative, by which the C constants are rounded
REFUSED_FOR_GAINS = ("ERROR_CURRENT_GAIN", "ERROR_CURRENT_INTEGRAL_GAIN", "ERROR_DECOUPLING", "ERROR_SPEED_GAIN")


def ranges():
    return {name: (low, high) for name, (low, high, _) in param_rows(ROOT).items()}


def drawn(draw):
    """Any parameters of their ranges, evenly over the decades; limits put in order, so that most get as far as the gains."""
    p = {name: min(high, max(low, round(math.exp(draw.uniform(math.log(max(low, 1)), math.log(high))))))
         for name, (low, high) in ranges().items() if not name.startswith("chopper")}
    p["i_trip_ma"] = max(10, p["i_range_ma"] * draw.randint(50, 95) // 100)
    p["i_max_ma"] = max(10, p["i_trip_ma"] * draw.randint(30, 85) // 100)
    p["i_align_ma"] = max(10, p["i_max_ma"] * draw.randint(20, 100) // 100)
    p["v_max_mv"] = p["v_range_mv"] * draw.randint(60, 98) // 100
    p["v_min_mv"] = max(1000, p["v_range_mv"] * draw.randint(25, 50) // 100)
    p["chopper_on_mv"] = p["v_max_mv"] * (0, 90, 99)[p["v_max_mv"] % 3] // 100
    p["chopper_off_mv"] = p["v_max_mv"] * 85 // 100
    p["speed_max_rpm"] = draw.randint(1, max(1, min(20000, 60000 // p["pole_pairs"])))
    p["overspeed_rpm"] = p["speed_max_rpm"] + draw.randint(1, 100)
    p["pwm_update"], p["pwm_samples"] = draw.choice(((0, 1), (1, 1), (2, 1), (1, 2), (2, 2)))
    p["low_side_shunts"] = 2 - p["pwm_samples"]
    p["overmodulation"] *= p["pwm_samples"] - 1
    p.update({key: min(p[key], most * p[of]) for key, most, of in (
        ("ld_apparent_uh", 8, "ld_uh"), ("lq_apparent_uh", 8, "lq_uh"), ("lq_rest_uh", 16, "lq_uh"))})
    p["modulator_osr"] = 0 if p["low_side_shunts"] else draw.choice((0, 32, 64, 128))
    return p


def samples(p):
    return p.get("pwm_samples", 1)


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
    edge = Fraction(60 * SLOW_HZ * 16, 6 * p["pole_pairs"]) if p.get("angle_source") == 2 else count
    i_max_q15 = Fraction(p["i_max_ma"] * 32768, p["i_range_ma"])
    return {
        "update": Fraction(p["pwm_update"]),
        "delay_halves": Fraction(3 if (p["pwm_update"], samples(p)) == (1, 2) else 3 - p["pwm_update"]),
        "samples": Fraction(samples(p)), "loop_hz": Fraction(PWM_HZ * samples(p)),
        "loops_per_slow": Fraction(PWM_HZ * samples(p), SLOW_HZ), "loop_counts": Fraction(10**8, PWM_HZ * samples(p)),
        "kp_d_q12": reactance["d"] * p["current_bw_hz"] * 4096, "kp_q_q12": reactance["q"] * p["current_bw_hz"] * 4096,
        "ki_q17": 2 * PI * p["current_bw_hz"] * Fraction(p["resistance_mohm"], 1000) * per_unit / (PWM_HZ * samples(p)) * 2**17,
        "x_d_q11": reactance["d"] * BASE_HZ * 2048, "x_q_q11": reactance["q"] * BASE_HZ * 2048,
        "x_q_apparent_q11": min(2 * PI * Fraction(p["lq_apparent_uh"] or p["lq_uh"], 10**6) * per_unit * BASE_HZ * 2048,
                                131071),
        "ripple_q10": ripple_q10(p), **iron(p), "torque_mean_ms": Fraction(p["torque_mean_ms"]),
        "r_q12": Fraction(p["resistance_mohm"], 1000) * per_unit * 4096,
        "emf_q12": 2 * PI * BASE_HZ * Fraction(p["flux_uwb"], 1000) / p["v_range_mv"] * 4096,
        "speed_kp_q16": kp, "speed_ki_q16": kp * w / 4 / SLOW_HZ,
        "speed_accel_q8": amperes * (2 * PI / 60) / 65536 * SLOW_HZ * q15 * 65536 * 256,
        "speed_ki_min_q16": 0 if p.get("angle_source") == 1 else min(round(i_max_q15) * 65536 / edge / 100,
                                                                     kp * w / 4 / SLOW_HZ),
        "ramp_q16": Fraction(p["ramp_rpm_s"] * 65536, SLOW_HZ),
        "modulator_osr": Fraction(p.get("modulator_osr", 0)), "early_counts": Fraction(3 * p.get("modulator_osr", 0) * 5, 2),
        "settle_counts": Fraction(20 if p.get("low_side_shunts", 1) else 0),
        "modulator_trip_q15": min(round(Fraction(p["i_trip_ma"] * 32768, p["i_range_ma"])) + 2048, 31129),
        "i_trip_q15": Fraction(p["i_trip_ma"] * 32768, p["i_range_ma"]), "i_max_q15": i_max_q15,
        "v_min_q15": Fraction(p["v_min_mv"] * 32768, p["v_range_mv"]),
        "v_max_q15": Fraction(p["v_max_mv"] * 32768, p["v_range_mv"]),
        "chopper_on_q15": Fraction(p["chopper_on_mv"] * 32768, p["v_range_mv"]),
        "chopper_off_q15": Fraction(p["chopper_off_mv"] * 32768, p["v_range_mv"]),
        "overspeed_w_q15": Fraction(p["overspeed_rpm"] * p["pole_pairs"] * 32768, 60 * BASE_HZ),
        "encoder_scale_q32": Fraction(p["pole_pairs"] * 2**32, p["encoder_counts"]),
        "encoder_counts": Fraction(p["encoder_counts"]),
        "travel_per_count_q12": Fraction(60 * 1000 * 32768 * 4096, 256 * p["encoder_counts"]),
        "counts_per_travel_q16": Fraction(p["encoder_counts"] * 2**32, 60 * 1000 * 32768),
    }


def iron(p):
    """1 / L_q over that at rated current: at rest, and what it grows by with the square of the current."""
    rated_q15 = round(Fraction(p["i_rated_ma"] * 32768, p["i_range_ma"]))
    if p["lq_rest_uh"] <= p["lq_uh"] or rated_q15 == 0:
        return {"iron_rest_q15": 32768, "iron_grows_q10": 0}
    rest = Fraction(p["lq_uh"] * 32768, p["lq_rest_uh"])
    grows = Fraction((32768 - max(round(rest), 1)) * 2**10 * 2**15, rated_q15**2)
    return {"iron_rest_q15": max(rest, 1), "iron_grows_q10": min(grows, 65535)}


def ripple_q10(p):
    """Amplitude of a phase's ripple where its voltage is zero, by voltage; 0 if at v_max it is under 4 knees of 1/64."""
    inductance = Fraction(min(p["ld_uh"], p["lq_uh"]), 10**6)
    period_by_root_48 = Fraction(1, PWM_HZ) / Fraction(6928203230, 10**9)
    value = period_by_root_48 / inductance * Fraction(p["v_range_mv"], p["i_range_ma"])
    largest = Fraction(round(value * 1024), 1024) * Fraction(p["v_max_mv"], p["v_range_mv"]) * Fraction(18919, 32768)
    return 0 if largest < Fraction(4, 64) else min(value * 1024, 32767)


def check(c, tuning, p):
    for name, value in exact(c, p).items():
        error = abs(getattr(tuning, name) - value)
        assert error <= Fraction(1, 2) + CONSTANTS * value, f"{name} {getattr(tuning, name)}, exactly {float(value)}: {p}"


@pytest.mark.parametrize("told", ({}, {"pwm_samples": 2, "pwm_update": 2, "low_side_shunts": 0}))
@pytest.mark.parametrize("motor", available(MOTORS))
def test_shipped_motors(c, motor, told):
    p = {**shipped(motor), **told}
    error, _, tuning = compute(c, p)
    assert error == "ERROR_NONE"
    check(c, tuning, p)


def test_modulators_are_refused_where_they_cannot_be(c):
    """A result takes 3 OSR bits of 50 ns, and the handler needs time behind it: 41.4 us with 256, 22.2 with 128."""
    one = {**shipped(), "low_side_shunts": 0}
    two = {**one, "pwm_samples": 2, "pwm_update": 2}
    works = {osr: compute(c, {**one, "modulator_osr": osr})[0] == "ERROR_NONE" for osr in range(257)}
    assert {osr for osr, good in works.items() if good} == {0, 32, 64, 128, 256}
    assert compute(c, {**one, "modulator_osr": 33})[0] == "ERROR_MODULATOR_OSR"
    assert compute(c, {**one, "modulator_osr": 16})[0] == "ERROR_MODULATOR_OSR"
    assert compute(c, {**one, "modulator_osr": 64, "low_side_shunts": 1})[0] == "ERROR_MODULATOR_OF_SHUNTS"
    assert compute(c, {**two, "modulator_osr": 128})[0] == "ERROR_NONE"
    assert compute(c, {**two, "modulator_osr": 256})[0] == "ERROR_MODULATOR_TOO_SLOW"


def test_any_parameters(c):
    """Each gain within its rounding, or refused because it does not fit its format."""
    draw, seen = random.Random(9), {}
    for _ in range(2500):
        p = drawn(draw)
        error, _, tuning = compute(c, p)
        seen[error] = seen.get(error, 0) + 1
        value = exact(c, p)
        torque_emf_q11 = 2 * PI * BASE_HZ * Fraction(c.mtpa_flux_nwb(struct(c, p)), 10**6 * p["v_range_mv"]) * 2048
        fits = (("ERROR_CURRENT_GAIN", max(value["kp_d_q12"], value["kp_q_q12"]) < 131071.5),
                ("ERROR_CURRENT_INTEGRAL_GAIN", 0.5 <= value["ki_q17"] < 32767.5),
                ("ERROR_CURRENT_GAIN", max(value["x_d_q11"], value["x_q_q11"]) < 131071.5),
                ("ERROR_DECOUPLING", value["emf_q12"] < 32767.5), ("ERROR_CURRENT_INTEGRAL_GAIN", value["r_q12"] < 32767.5),
                ("ERROR_CURRENT_GAIN", torque_emf_q11 < 65535.5),
                ("ERROR_SPEED_GAIN", (value["speed_kp_q16"] >= 0.5
                                      and max(value["speed_kp_q16"], value["speed_accel_q8"]) < 2**31)))
        misfit = next((name for name, fitting in fits if not fitting), None)
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


@pytest.mark.parametrize("on_mv, off_mv, fits", ((35999, 35900, True), (36000, 35000, False), (30000, 0, False), (0, 0, True),
                                                 (0, 35000, True), (30000, 30000, False), (30000, 29940, True),
                                                 (30000, 29941, False)))
def test_levels_of_the_chopper(c, on_mv, off_mv, fits):
    """Of a range of 60 V, whose thousandth must lie between them, and a limit of 36 V."""
    p = {**shipped(), "v_range_mv": 60000, "chopper_on_mv": on_mv, "chopper_off_mv": off_mv}
    assert compute(c, p)[0] == ("ERROR_NONE" if fits else "ERROR_CHOPPER_LEVELS")


@pytest.mark.parametrize("error, name, limit, beyond", LIMITS)
def test_each_limit_where_it_is(c, error, name, limit, beyond):
    p = shipped()
    p[name] = limit(p)
    assert compute(c, p)[0] == "ERROR_NONE"
    p[name] += beyond
    assert compute(c, p)[0] == error


def is_reluctant(p):
    return apparent_difference_h(p) * p["i_max_ma"] * 1e-3 > 1.5 * p["flux_uwb"] * 1e-6


def wiring_a(p):
    """A tenth of i_trip, a thirtieth of it where the inductance holds the current longer."""
    return Fraction(p["i_trip_ma"], 30000 if is_reluctant(p) else 10000)


def exact_torque_and_start(c, p):
    """The rest of struct tuning, from the motor in SI units: (exact, how far it may be off)."""
    volt, ampere = Fraction(p["v_range_mv"], 1000), Fraction(p["i_range_ma"], 1000)
    flux = Fraction(c.mtpa_flux_nwb(struct(c, p)), 10**9)
    psi, i_max = Fraction(p["flux_uwb"], 10**6), Fraction(p["i_max_ma"], 1000)
    apparent_uh = [p[f"l{axis}_apparent_uh"] or p[f"l{axis}_uh"] for axis in "dq"]
    x_d, x_q = (2 * PI * BASE_HZ * Fraction(uh, 10**6) * ampere / volt for uh in apparent_uh)
    emf = 2 * PI * BASE_HZ * psi / volt
    coarser = Fraction(apparent_uh[0], p["ld_uh"]) + Fraction(apparent_uh[1], p["lq_uh"])  # than x_d and x_q
    farad = Fraction(p["bus_capacitance_uf"], 10**6)
    energy = farad * volt / (3 * ampere) * SLOW_HZ * 1024
    exact = {
        "torque_emf_q11": (2 * PI * BASE_HZ * flux / volt * 2048, Fraction(3, 2)),
        "bus_energy_q10": (min(energy, 32767), Fraction(1, 2)),
        "burn_max_q15": (min(emf / x_d, i_max / ampere) * 32768, 40),
        "saliency_q11": (max(min((x_q - x_d) * 2048, 65535), -65535), 2 + coarser / 2),
        "speed_max_rpm_q4": (p["speed_max_rpm"] * 16, 0), "pole_pairs": (p["pole_pairs"], 0),
        "wiring_i_q15": (wiring_a(p) / ampere * 32768, Fraction(1, 2) + 33 / ampere),
        "rpm_q4_per_w_q32": (Fraction(60 * 16 * PWM_HZ * samples(p), p["pole_pairs"]), 1),
        "i_sum_q15": (Fraction(p["i_trip_ma"] * 32768, p["i_range_ma"]) / 4, 2),
    }
    drop = min(wiring_a(p) * Fraction(p["resistance_mohm"], 1000), volt)
    exact["wiring_v_q15"] = (drop / volt * 32768, 1 + Fraction(p["resistance_mohm"] + 1000, 10**6) / volt * 32768)
    return exact


def pendulum_ms(p, i_ma):
    """A rotor in a field of this current: w0^2 = p Kt I / J."""
    kt = 1.5 * p["pole_pairs"] * p["flux_uwb"] * 1e-6
    period = 2 * math.pi * math.sqrt(p["inertia_gmm2"] * 1e-9 / (p["pole_pairs"] * kt * i_ma * 1e-3)) * 1000
    return min(max(period, 30), 1500)


def apparent_difference_h(p):
    ld, lq = (p[f"l{axis}_apparent_uh"] or p[f"l{axis}_uh"] for axis in "dq")
    return max(lq - ld, 0) * 1e-6


def check_reluctant(tuning, p):
    """Three times psi / (Lq - Ld), a quarter of i_max at least, then i_max.

    The rotor hangs at acos(x), x = psi / (Lq - Ld) I: (1 - x^2) / x as firmly.
    """
    psi, difference, i_max = p["flux_uwb"] * 1e-6, apparent_difference_h(p), p["i_max_ma"]
    first = min(max(3000 * psi / difference, i_max // 4 + 1), i_max)
    assert tuning.align_levels == (2 if round(first) < i_max else 1)
    for level, i_ma in zip(tuning.align, (first, i_max)):
        assert level.i_q15 == pytest.approx(i_ma / p["i_range_ma"] * 32768, abs=0.51 + 17000 / p["i_range_ma"])
        assert level.i_less_q15 == level.i_q15
        x = psi / (difference * i_ma * 1e-3)
        assert level.period_ms == pytest.approx(pendulum_ms(p, i_ma * (1 - x * x) / x), abs=1.1, rel=0.005)
    assert tuning.saliency_i_q15 == pytest.approx(i_max // 5 / p["i_range_ma"] * 32768, abs=0.51)
    v_mv = min(p["ld_uh"] * (i_max // 5) / 900, p["v_max_mv"] // 4)
    assert tuning.saliency_v_q15 == pytest.approx(v_mv / p["v_range_mv"] * 32768, abs=0.51 + 17000 / p["v_range_mv"])


def check_way(tuning, p, period_ms):
    """1.6 % of speed_max, or a sixth of a turn in a period of the swing if that is more; over as long as four counts take."""
    told = Fraction(2 * p["speed_max_rpm"] * p["pole_pairs"], 125 * 60000) * 2**32
    assert tuning.align_speed_q32 == pytest.approx(float(max(told, 2**32 // (6 * period_ms))), rel=1e-6, abs=1)
    counts_ms = 4 * p["pole_pairs"] / p["encoder_counts"] * 2**32 / tuning.align_speed_q32
    assert tuning.align_speed_ms == pytest.approx(min(max(counts_ms, 1), period_ms // 8), abs=0.51)


def rest_difference_h(p):
    """As the rotor on the field meets it: q iron without current, d iron with it."""
    lq = max(p["lq_uh"], p["lq_apparent_uh"], p["lq_rest_uh"])
    return max(lq - min(p["ld_uh"], p["ld_apparent_uh"] or p["ld_uh"]), 0) * 1e-6


def shows_axis(p):
    """Lq is 1.35 Ld or more, reluctance takes a third of the pull at i_max, and a count is at most 2.8 degrees."""
    difference = rest_difference_h(p)
    return (difference >= 0.35e-6 * p["ld_uh"] and p["encoder_counts"] > 128 * p["pole_pairs"]
            and difference * p["i_max_ma"] * 1e-3 >= p["flux_uwb"] * 1e-6 / 3)


def check_levels(tuning, p):
    """i_align first; then i_max where i_align is not far below; neither beyond what leaves half of the magnets' pull, or two
    thirds where the axis is not measured."""
    assert bool(tuning.reluctant) == is_reluctant(p)
    assert bool(tuning.shows_axis) == (not is_reluctant(p) and shows_axis(p))
    assert (tuning.saliency_v_q15 > 0) == bool(tuning.reluctant or tuning.shows_axis)
    if is_reluctant(p):
        check_reluctant(tuning, p)
        return
    difference = rest_difference_h(p)
    most = p["i_max_ma"] if p["i_align_ma"] * 4 >= p["i_max_ma"] else p["i_align_ma"]
    if difference > 0:
        most = min(most, p["flux_uwb"] * 1e-3 * (0.5 if shows_axis(p) else 0.333) / difference)
    first = min(p["i_align_ma"], most)
    assert tuning.align_levels == (2 if math.floor(most + 0.5) > p["i_align_ma"] else 1)
    for level, i_ma, ratio in zip(tuning.align, (first, most), (0.5, 0.6)):
        assert level.i_q15 == pytest.approx(i_ma / p["i_range_ma"] * 32768, abs=0.51 + 17000 / p["i_range_ma"])
        assert level.ratio_q15 == round(ratio * 32768) and abs(level.i_less_q15 - ratio * level.i_q15) <= 1
        reluctance = min(max(difference, 0) * i_ma * 1e-3 / (p["flux_uwb"] * 1e-6), 0.5)
        assert level.saliency_q15 == pytest.approx(reluctance * 32768, abs=0.51 + 33 * reluctance / i_ma * 1000, rel=1e-3)
        assert level.period_ms == pytest.approx(pendulum_ms(p, i_ma), abs=1.1, rel=0.002)


@pytest.mark.parametrize("motor", available(MOTORS))
@pytest.mark.parametrize("changes", (
    {}, {"lq_uh": 3}, {"ld_uh": 0.2, "flux_uwb": 0.2}, {"i_align_ma": 0.2}, {"inertia_gmm2": 100}, {"inertia_gmm2": 0.01},
    {"bus_capacitance_uf": 300}, {"resistance_mohm": 3}))
def test_torque_and_start_of_the_motors(c, motor, changes):
    p = shipped(motor)
    for name, factor in changes.items():
        p[name] = min(max(1, round(p[name] * factor)), ranges()[name][1])
    tuning = compute(c, p)[2]
    if not tuning.pole_pairs:
        pytest.skip("refused before the start is worked out")
    for name, (value, off) in exact_torque_and_start(c, p).items():
        assert abs(getattr(tuning, name) - value) <= off, f"{name} {getattr(tuning, name)}, exactly {float(value)}"
    set_q15 = tuning.v_max_q15 * 96 // 100
    assert tuning.bus_set_energy_q25 == (set_q15**2 >> 15) * tuning.bus_energy_q10
    check_levels(tuning, p)
    if not tuning.reluctant:
        check_way(tuning, p, tuning.align[0].period_ms)


def test_the_emf_of_a_weak_magnet_can_be_divided_by(c):
    """10 uWb beside a sensor of 413 V are less than half an LSB, and no reason to refuse them."""
    volts = {"v_range_mv": 413270, "v_max_mv": 400000, "v_min_mv": 120000}
    error, _, tuning = compute(c, {**shipped(), **volts, "flux_uwb": 10, "angle_source": 1})
    assert (error, tuning.torque_emf_q11) == ("ERROR_NONE", 1)


def test_thousandths_to_units_and_back(c):
    for milli, range_milli, q15 in ((0, 1000, 0), (1000, 1000, 32768), (-1000, 1000, -32768), (1, 65536, 1), (-1, 65536, -1),
                                    (1, 65537, 0), (4000, 1000, 131072), (-333, 1000, -10912), (333, 1000, 10912)):
        assert c.tuning_q15_from_milli(milli, range_milli) == q15
    for q15, range_milli, milli in ((0, 1000, 0), (32768, 1000, 1000), (-32768, 1000, -1000), (16384, 1, 1), (16383, 1, 0),
                                    (-16384, 1, 0), (-16385, 1, -1), (131071, 2000000, 7999939)):
        assert c.tuning_milli_from_q15(q15, range_milli) == milli


def test_the_observers_speed_in_rpm(c):
    _, _, tuning = compute(c, shipped())
    for rpm in (0, 1, 4000, -4000, -1):
        speed_q32 = round(rpm / 60 * 4 / PWM_HZ * 2**32)
        assert abs(speed_q32 * tuning.rpm_q4_per_w_q32 / 2**32 - rpm * 16) < 0.01


@pytest.mark.parametrize("name", ("i_trip_ma", "i_max_ma", "i_align_ma", "v_max_mv", "v_min_mv", "overspeed_rpm"))
def test_limits_hold_where_32_bits_would_not(c, name):
    """The largest parameters: each check still finds its own."""
    p = {**shipped(), "i_range_ma": 2000000, "v_range_mv": 2000000, "i_trip_ma": 1900000, "i_max_ma": 1615000,
         "i_align_ma": 1615000, "v_max_mv": 1960000, "v_min_mv": 500000, "resistance_mohm": 100}
    before = {error for error, *_ in LIMITS}
    assert compute(c, p)[0] not in before
    p[name] += -1 if name == "v_min_mv" else 1 if name != "overspeed_rpm" else 32000
    assert compute(c, p)[0] in before
