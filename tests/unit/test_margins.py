# SPDX-License-Identifier: MIT
"""What `on` refuses for its margin, against the loop's own frequency response; and that the value it offers works."""
import cmath
import math
import random

import pytest
from launcher.data import MOTORS, available
from launcher.rules import speed_margin_deg

from rigs.motor_numbers import compute, shipped, struct

PWM_HZ, SLOW_S, LOOP_S = 20000, 1e-3, 50e-6


def crossover(gain):
    """Where |gain(w)| falls through 1, rad/s."""
    low, high = 1e-3, 1e6
    while high / low > 1 + 1e-12:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if abs(gain(middle)) > 1 else (low, middle)
    return low


# (pwm_update, pwm_samples): at the valley, at both ends, at once; two samples at both ends, at once
MODES = {(0, 1): 1647, (1, 1): 2636, (2, 1): 3183, (1, 2): 3295, (2, 2): 6366}


def current_margin_deg(bandwidth_hz, update, samples=1):
    """A phase rises by the newest voltage only in mode 2, and falls by an old one only in mode 0.

    With two samples it rises after the one and falls after the other, by an old one unless it acts at once.
    """
    loop_hz = PWM_HZ * samples
    a = 2 * math.pi * bandwidth_hz / loop_hz

    def loop(w):
        z = cmath.exp(1j * w / loop_hz)
        rise, fall = (1 if update == 2 else 1 / z), (1 / z if update == 0 or samples == 2 and update == 1 else 1)
        return a * (rise + fall) / 2 / (z - 1)
    return 180 + math.degrees(cmath.phase(loop(crossover(lambda w: loop(min(w, loop_hz * math.pi))))))


def mode(update, samples):
    return {**shipped(), "pwm_update": update, "pwm_samples": samples, "low_side_shunts": 0}


def speed_margin(bandwidth_hz, current_bw_hz, mean_ms=1):
    w0, delay_s = 2 * math.pi * bandwidth_hz, SLOW_S + LOOP_S + SLOW_S / 8 + (mean_ms - 1) / 2 * SLOW_S

    def loop(w):
        return w0 / (1j * w) * (1 + w0 / 4 / (1j * w))
    w = crossover(loop)
    return 180 + math.degrees(cmath.phase(loop(w))) - math.degrees(math.atan(w / (2 * math.pi * current_bw_hz)) + w * delay_s)


@pytest.mark.parametrize("update, samples", MODES)
def test_the_current_loops_limit(c, update, samples):
    limit, degrees = c.margin_current_bw_hz(update, samples), 60 if update == 2 else 45
    assert current_margin_deg(limit, update, samples) >= degrees > current_margin_deg(limit + 1, update, samples)
    assert limit == MODES[update, samples]
    p = mode(update, samples)
    assert compute(c, {**p, "current_bw_hz": limit})[0] == "ERROR_NONE"
    assert compute(c, {**p, "current_bw_hz": limit + 1})[:2] == ("ERROR_CURRENT_MARGIN", limit)


@pytest.mark.parametrize("update, samples", MODES)
@pytest.mark.parametrize("share", (0.01, 0.3, 0.6, 1))
def test_the_current_loops_margin(c, update, samples, share):
    bandwidth_hz = round(share * MODES[update, samples])
    tuning = compute(c, {**mode(update, samples), "current_bw_hz": bandwidth_hz, "speed_bw_hz": 1})[2]
    expected = current_margin_deg(bandwidth_hz, update, samples)
    assert tuning.current_margin_u16 * 360 / 65536 == pytest.approx(expected, abs=0.03)


def test_the_speed_loops_margin(c):
    for speed_bw_hz in (1, 5, 20, 60, 100, 200):
        for current_bw_hz in (50, 300, 1000, 1647):
            for mean_ms in (1, 2, 3, 4):
                loop = speed_bw_hz, current_bw_hz, mean_ms
                expected = speed_margin(*loop)
                assert c.margin_of_speed_u16(*loop) * 360 / 65536 == pytest.approx(expected, abs=0.03)
                assert speed_margin_deg(*loop) == pytest.approx(expected, abs=0.03)


@pytest.mark.parametrize("mean_ms", [1, 3])
@pytest.mark.parametrize("current_bw_hz", [60, 200, 500, 1000, 1647])
def test_the_speed_loops_limit(c, current_bw_hz, mean_ms):
    limit = c.margin_speed_bw_hz(current_bw_hz, mean_ms)
    assert speed_margin(limit, current_bw_hz, mean_ms) > 44.97 and speed_margin(limit + 1, current_bw_hz, mean_ms) < 45.03
    p = {**shipped(), "encoder_counts": 40000, "current_bw_hz": current_bw_hz, "torque_mean_ms": mean_ms}
    assert compute(c, {**p, "speed_bw_hz": limit})[0] == "ERROR_NONE"
    assert compute(c, {**p, "speed_bw_hz": limit + 1})[:2] == ("ERROR_SPEED_MARGIN", limit)
    assert compute(c, {**p, "speed_bw_hz": 200})[:2] == ("ERROR_SPEED_MARGIN", limit)


def count_asks_a(c, p, speed_bw_hz):
    """What a count within a slow period makes the speed loop ask for."""
    inertia, kt = p["inertia_gmm2"] * 1e-9, 1.5 * p["pole_pairs"] * c.mtpa_flux_nwb(struct(c, p)) * 1e-9
    return inertia / kt * 2 * math.pi * speed_bw_hz * (2 * math.pi / p["encoder_counts"] / SLOW_S)


def test_the_encoders_limit(c):
    """A tenth of a count may ask for i_max; and an electrical turn takes 16 of them."""
    draw, refused = random.Random(5), 0
    for _ in range(300):
        motor = draw.choice(available(MOTORS))
        p = {**shipped(motor), "encoder_counts": draw.choice([64, 100, 400, 1000, 4000])}
        p["inertia_gmm2"] = round(p["inertia_gmm2"] * draw.uniform(0.2, 20))
        error, works, tuning = compute(c, p)
        if p["encoder_counts"] < 16 * p["pole_pairs"]:
            assert (error, works) == ("ERROR_ENCODER_COARSE", 16 * p["pole_pairs"])
        elif error == "ERROR_SPEED_RESOLUTION":
            refused += 1
            assert count_asks_a(c, p, p["speed_bw_hz"]) > 9.99 * p["i_max_ma"] / 1000
            assert works == c.margin_resolution_bw_hz(struct(c, p), tuning)
            assert count_asks_a(c, p, works) <= 10.01 * p["i_max_ma"] / 1000 <= count_asks_a(c, p, works + 1.05)
            assert compute(c, {**p, "speed_bw_hz": works})[0] == "ERROR_NONE"
        else:
            assert error in ("ERROR_NONE", "ERROR_SPEED_UNRESOLVED")
            assert count_asks_a(c, p, 1 if error != "ERROR_NONE" else p["speed_bw_hz"]) > 9.99 * p["i_max_ma"] / 1000 \
                or error == "ERROR_NONE" and count_asks_a(c, p, p["speed_bw_hz"]) <= 10.01 * p["i_max_ma"] / 1000
    assert refused > 30


def test_every_shipped_motor_has_its_margin_and_no_less_than_could_be(c):
    for motor in available(MOTORS):
        p = shipped(motor)
        assert speed_margin(p["speed_bw_hz"], p["current_bw_hz"], p["torque_mean_ms"]) >= 45
        assert compute(c, {**p, "inertia_gmm2": 5 * p["inertia_gmm2"]})[0] == "ERROR_NONE", "room for a wrong inertia"


def test_a_rotor_that_hardly_weighs_is_resolved_at_any_bandwidth(c):
    """margin_resolution_bw_hz() by its formula, up to where that has more than 31 bits: there it ends, and refuses nothing."""
    params, tuning = struct(c, shipped()), c.tuning()
    for kp, counts, i_max, hz in ((10**6, 4000, 14800, 60), (10**6, 4000, 14800, 120), (50000, 64, 14800, 60),
                                  (1, 65536, 14800, 1), (112, 65536, 26000, 200), (1, 65536, 26000, 200)):
        params.encoder_counts, params.speed_bw_hz, tuning.i_max_q15, tuning.speed_kp_q16 = counts, hz, i_max, kp
        exact = 10 * i_max * 65536 * counts * hz // (kp * 60 * 16 * 1000)
        assert c.margin_resolution_bw_hz(params, tuning) == min(exact, 2**31 - 1), (kp, counts)
    error, _, tuning = compute(c, {**shipped(), "encoder_counts": 65536, "inertia_gmm2": 1})
    assert error == "ERROR_NONE" and tuning.speed_kp_q16 == 6
