# SPDX-License-Identifier: MIT
"""Parameters of a motor that must fit each other: refused by name, with a value that works."""
import pytest

from rigs.motor_numbers import compute, shipped, struct

CASES = {  # told besides -> (refusal, the parameter whose value it says)
    "ld_apparent": ({"ld_apparent_uh": 1601}, "ERROR_LD_APPARENT", "ld_apparent_uh"),
    "lq_apparent": ({"lq_apparent_uh": 100000}, "ERROR_LQ_APPARENT", "lq_apparent_uh"),
    "lq_rest": ({"lq_rest_uh": 3201}, "ERROR_LQ_REST", "lq_rest_uh"),
    "resistance": ({"resistance_mohm": 100000}, "ERROR_CURRENT_INTEGRAL_GAIN", "resistance_mohm"),
    "no resistance": ({"resistance_mohm": 1, "current_bw_hz": 10, "v_range_mv": 2000000, "v_max_mv": 1900000,
                       "v_min_mv": 600000, "i_range_ma": 20000}, "ERROR_CURRENT_INTEGRAL_GAIN", "resistance_mohm"),
    "flux": ({"flux_uwb": 10000000}, "ERROR_DECOUPLING", "flux_uwb"),
    "inertia": ({"inertia_gmm2": 2100000000, "flux_uwb": 10, "i_range_ma": 20000, "speed_bw_hz": 200}, "ERROR_SPEED_GAIN",
                "inertia_gmm2"),
    "no inertia": ({"inertia_gmm2": 1, "speed_bw_hz": 1}, "ERROR_SPEED_GAIN", "inertia_gmm2"),
}


@pytest.mark.parametrize("case", CASES)
def test_what_the_refusal_says_works(c, case):
    told, refusal, name = CASES[case]
    p = {**shipped(), **told}
    error, value, _ = compute(c, p)
    assert error == refusal
    assert compute(c, {**p, name: value})[0] != refusal
    if "APPARENT" in refusal or "REST" in refusal:
        assert value == (3200 if "REST" in refusal else 1600) and compute(c, {**p, name: 0})[0] == "ERROR_NONE"


def test_both_inductances_go_together(c):
    p = {**shipped(), "ld_uh": 500000, "lq_uh": 600000}
    error, value, _ = compute(c, p)
    assert error == "ERROR_CURRENT_GAIN" and value < 500000
    assert compute(c, {**p, "ld_uh": value, "lq_uh": value})[0] != "ERROR_CURRENT_GAIN"


def test_reluctance_beyond_the_format_is_refused(c):
    """Both inductances fit, and each apparent one its own; the torque of both does not."""
    p = {**shipped(), "lq_uh": 4000, "lq_apparent_uh": 32000}
    error, value, _ = compute(c, p)
    assert error == "ERROR_CURRENT_GAIN" and 4000 < value < 32000
    assert compute(c, {**p, "lq_apparent_uh": value})[2].torque_emf_q11 <= 65535


@pytest.mark.parametrize("inertia_gmm2, refused", [(56493, False), (56493 * 100, False), (56493 * 10000, True)])
def test_an_inertia_in_kg_cm2_is_asked_about(c, inertia_gmm2, refused):
    """The torque of i_max, 1.5 * 4 * 6.395 mWb * 10.65 A, takes 87 ms, or 580 s, to 4000 rpm."""
    outcome = c.tuning_check_motor(struct(c, {**shipped(), "inertia_gmm2": inertia_gmm2}))
    assert outcome.error == (c.ERROR_INERTIA if refused else c.ERROR_NONE)
    if refused:
        assert outcome.value == pytest.approx(1.5 * 4 * 6.395e-3 * 10.65 * 300 / (4000 * 3.14159265 / 30) * 1e9, rel=1e-3)
        assert c.tuning_check_motor(struct(c, {**shipped(), "inertia_gmm2": outcome.value})).error == c.ERROR_NONE
