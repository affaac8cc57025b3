# SPDX-License-Identifier: MIT
"""Out of step: what the voltages of a prescribed field say of the rotor that should hang on it."""
import math

import pytest

from rigs.drive import World
from rigs.motor_numbers import compute, shipped

LEAST_MS, MOST_MS = 40, 200


@pytest.fixture
def watched(c):
    """Steps of the watch with a rotor `lag(ms)` degrees behind a field at a share of the largest speed; EMF by a factor."""
    def run(share, lag, ms=400, emf=1.0, resistance=1.0, backwards=False):
        p = {**shipped(), "angle_source": 1}
        w = World(c).put("OPERATION_ENABLED")
        a, loop = w.axis, w.axis.loop
        _, _, a.tuning = compute(c, p)
        c.current_loop_tune(loop, a.tuning)
        loop.source, loop.vbus_q15 = c.LOOP_OBSERVER, w.fabric.adc.VBUS
        per_volt = 32768 / p["v_range_mv"] * 1000
        rad_s = share * p["speed_max_rpm"] / 60 * 2 * math.pi * p["pole_pairs"] * (-1 if backwards else 1)
        loop.field_speed_q32 = round(rad_s / 2 / math.pi / 20000 * 2**32)
        i_a = p["i_max_ma"] / 1000
        loop.i_d_q15 = round(i_a / p["i_range_ma"] * 1000 * 32768)
        for n in range(ms):
            angle = math.radians(lag(n)) * (-1 if backwards else 1)
            e = emf * rad_s * p["flux_uwb"] * 1e-6
            loop.v_d_q15 = round(per_volt * (p["resistance_mohm"] / 1000 * i_a * resistance + e * math.sin(angle)))
            loop.v_q_q15 = round(per_volt * (rad_s * p["lq_uh"] * 1e-6 * i_a + e * math.cos(angle)))
            c.field_watch_step(a)
            c.reaction_step(a)
            if a.faults.cause:
                assert a.faults.cause == c.FAULT_OUT_OF_STEP and not w.fabric.gate.CONTROL
                return n
        return None
    return run


@pytest.mark.parametrize("backwards", (False, True))
@pytest.mark.parametrize("share", (0.05, 0.3, 1.0))
@pytest.mark.parametrize("lag", (0, 40, 70, -70))
def test_a_rotor_that_follows_is_left_alone(watched, share, lag, backwards):
    """Also with a winding 15 % warmer than told, and swinging by 60 degrees."""
    for resistance in (0.85, 1.0, 1.15):
        assert watched(share, lambda n: lag, backwards=backwards, resistance=resistance) is None
        assert watched(share, lambda n: 60 * math.sin(n / 10), backwards=backwards, resistance=resistance) is None


@pytest.mark.parametrize("share", (0.1, 0.3))
def test_a_rotor_that_stands_is_found(watched, share):
    assert LEAST_MS < watched(share, lambda n: 0, emf=0) < 80


@pytest.mark.parametrize("slip_hz", (7, 30, 90, -30))
def test_a_rotor_that_turns_otherwise_is_found(watched, slip_hz):
    assert LEAST_MS < watched(0.3, lambda n: 360 * slip_hz * n / 1000, ms=600) < MOST_MS


def test_a_load_that_runs_away_with_it_is_found_where_the_field_stands(watched):
    """The field at a hundredth of the speed, the EMF of a third of it."""
    assert watched(0.01, lambda n: 360 * 60 * n / 1000, emf=30) < MOST_MS
    assert watched(0.01, lambda n: 0, emf=1) is None
