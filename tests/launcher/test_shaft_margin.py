# SPDX-License-Identifier: MIT
"""Whether a coupling lets a speed loop swing up, against the two masses played in small steps of time."""
import math
import re

import pytest

from launcher.paths import REPO
from launcher.shaft_margin import FILTERED_HZ, LATE_S, MARGIN, SLOW_S, left_hz, swings_up

ROTOR, STEPS = 1e-4, 200  # of a millisecond


def shaft(ratio, hz, damping=0.03):
    load = ROTOR * ratio
    reduced = ROTOR * load / (ROTOR + load)
    stiffness = reduced * (2 * math.pi * hz) ** 2
    return ROTOR, load, stiffness, 2 * damping * math.sqrt(stiffness * reduced)


def grows(speed_bw_hz, rotor, load, stiffness, damping):
    """Whether a kick is larger after a second than after half of it."""
    gain, dt = MARGIN * 2 * math.pi * speed_bw_hz * (rotor + load), SLOW_S / STEPS
    angle, before, speed, load_speed, twist, torque, asked = 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0
    largest = [0.0, 0.0]
    for ms in range(1000):
        asked, before = -gain * (angle - before) / SLOW_S, angle
        for n in range(STEPS):
            torque = asked if n >= STEPS * LATE_S / SLOW_S else torque
            joint = stiffness * twist + damping * (speed - load_speed)
            speed += (torque - joint) / rotor * dt
            load_speed += joint / load * dt
            twist += (speed - load_speed) * dt
            angle += speed * dt
        largest[ms // 500] = max(largest[ms // 500], abs(speed) if ms % 500 > 250 else 0.0)
        if abs(speed) > 1e6:
            return True
    return largest[1] > largest[0] > 1e-12


@pytest.mark.parametrize("speed_bw_hz", (3, 12, 30, 60))
@pytest.mark.parametrize("ratio, hz", ((0.3, 410), (1.0, 60), (1.0, 790), (9.0, 160), (60.0, 30)))
def test_it_says_so_where_the_shaft_swings_up(speed_bw_hz, ratio, hz):
    """But for what lies within a tenth of the edge, which the steps shift a little."""
    said = {swings_up(speed_bw_hz * share, *shaft(ratio, hz)) for share in (0.9, 1, 1.1)}
    if len(said) == 1:
        assert said == {grows(speed_bw_hz, *shaft(ratio, hz))}


def test_the_cases_say_both():
    assert swings_up(60, *shaft(9.0, 160)) and not swings_up(60, *shaft(0.3, 410)), "as lot 7, and a stiff one"
    assert not swings_up(60, *shaft(7.0, 1012)), "at a multiple of the loop's rate nothing is seen, nor done"


@pytest.mark.parametrize("ratio, hz", ((9.0, 30), (82.0, 31.7), (26.0, 23), (5.0, 80)))
def test_what_a_soft_coupling_leaves_is_the_most_that_does_not_swing_up(ratio, hz):
    left = left_hz(60, *shaft(ratio, hz))
    assert left < 30 and not swings_up(0.99 * left, *shaft(ratio, hz)) and swings_up(1.01 * left, *shaft(ratio, hz))
    assert left_hz(left / 2, *shaft(ratio, hz)) == left / 2, "not more than was told"


def test_what_a_notch_takes_leaves_all_of_it():
    assert swings_up(60, *shaft(9.0, 160)) and left_hz(60, *shaft(9.0, 160)) == 60
    c_q13 = int(re.search(r"#define NOTCH_C_MOST_Q13 (\d+)", (REPO / "firmware/control/notch.h").read_text())[1])
    assert FILTERED_HZ == pytest.approx(math.acos(c_q13 / 2**14) / (2 * math.pi * SLOW_S), rel=1e-3)
