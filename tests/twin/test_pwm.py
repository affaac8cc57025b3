# SPDX-License-Identifier: MIT
"""The PWM, which the twin computes from event to event: what the page promises, in numbers. That it is the RTL's to the bit,
clock by clock, whatever is written: tests/fabric/lockstep."""
import random

import pytest

from twin.bench import CLOCK_PS, NEVER, c


def reach(p, now):
    triggered = False
    while c.pwm_next_event(p) <= now:
        triggered = c.pwm_take_event(p) or triggered
    c.pwm_catch_up(p, now)
    return triggered


@pytest.mark.parametrize("seed", range(4))
def test_no_trigger_comes_before_it_is_promised(seed):
    draw, p, triggers = random.Random(seed), c.pwm(), 0
    c.pwm_reset(p, 0)
    assert c.pwm_next_event(p) == c.pwm_next_trigger(p) == NEVER, "nothing comes by itself"
    for offset, value in ((0x08, 3 + draw.randrange(38)), (0x18, draw.randrange(40)), (0x00, 1)):
        c.pwm_write(p, offset, value)
    for clock in range(1, 2000):
        promise = c.pwm_next_trigger(p)
        triggered = reach(p, clock * CLOCK_PS)
        assert not triggered or clock * CLOCK_PS >= promise, "promised later"
        triggers += triggered
        if draw.randrange(12) == 0:
            c.pwm_write(p, draw.choice((0x1C, 0x20, 0x28, 0x30)), draw.randrange(45) | draw.getrandbits(2) << 16)
    assert triggers > 5


# ---- what the page says ----

def running(half=100, dead=10, min_pulse=4, compare=40):
    p = c.pwm()
    c.pwm_reset(p, 0)
    for offset, value in ((0x08, half), (0x0C, dead), (0x10, min_pulse), (0x18, half),
                          *((0x28 + 4 * k, compare) for k in range(3))):
        c.pwm_write(p, offset, value)
    c.pwm_set_live(p, True)
    c.pwm_write(p, 0x00, 1)
    return p


@pytest.mark.parametrize("compare, high, low", [
    (40, 70, 110), (0, 0, 200), (100, 200, 0), (65535, 200, 0), (5, 4, 176), (95, 176, 4), (7, 4, 176)],
    ids=["less the dead time", "never on", "always on", "beyond PERIOD", "stretched to the shortest", "of the low side",
         "exactly the shortest"])
def test_on_times(compare, high, low):
    """Clocks of a period of 200 for which an output is on, in the steady state; dead time 10, shortest pulse 4."""
    p, on = running(compare=compare), []
    for n in range(400, 600):
        reach(p, n * CLOCK_PS)
        on.append(p.outputs)
    assert (sum(one & 1 for one in on), sum(one >> 1 & 1 for one in on)) == (high, low)


def test_brake():
    p = running(compare=100)
    c.pwm_write(p, 0x00, 0)
    reach(p, 50 * CLOCK_PS)
    assert p.outputs == 0
    c.pwm_write(p, 0x00, 2)
    for clock, outputs in ((59, 0), (62, 0x2A)):  # a dead time, then the low sides, whatever the compares say
        reach(p, clock * CLOCK_PS)
        assert p.outputs == outputs
    c.pwm_set_live(p, False)
    assert p.outputs == 0


def test_settings_are_locked_until_the_carrier_rests_and_in_that_clock_too():
    p = running(dead=10)
    reach(p, 10 * CLOCK_PS)
    c.pwm_write(p, 0x00, 0)
    for clock, dead in ((11, 10), (12, 7)):
        reach(p, clock * CLOCK_PS)
        c.pwm_write(p, 0x0C, 7)
        assert c.pwm_read(p, 0x0C) == dead
