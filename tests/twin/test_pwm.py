# SPDX-License-Identifier: MIT
"""The PWM, which the twin computes from event to event, against one that goes from clock to clock: registers as the RTL has
them (drivers/fabric/rtl/pwm*.v), all of which take their next value at once, with none of the twin's shortcuts. Small periods,
so that compares at an end and beyond it, pulses too short, and writes just before and after each of them come up all the time.
Then what the page promises, in numbers."""
import random
from dataclasses import dataclass, field, replace

import pytest

from twin.bench import CLOCK_PS, NEVER, c

CLOCKS = 2000
SETTINGS = {0x08: ("period", 0xFFFF), 0x0C: ("dead", 0xFF), 0x10: ("min_pulse", 0xFF), 0x14: ("mode", 3),
            0x18: ("phase", 0x1FFFF)}


@dataclass
class Reference:
    control: int = 0
    period: int = 2500
    dead: int = 255
    min_pulse: int = 255
    mode: int = 0
    phase: int = 2500
    count: int = 2500
    last: int = 0
    trigger: list = field(default_factory=lambda: [0, 0])
    compare: list = field(default_factory=lambda: [0, 0, 0])
    active: list = field(default_factory=lambda: [0, 0, 0])
    fresh: bool = False
    waiting: list = field(default_factory=lambda: [False] * 3)
    fell_back: list = field(default_factory=lambda: [False] * 3)
    running: bool = False
    rising: bool = False
    live: bool = False
    triggered: bool = False
    leg: list = field(default_factory=lambda: [(False, False, 255)] * 3)  # side, on, clocks left

    def wished(self, compare):
        return self.count < compare if self.rising else self.count <= compare

    def enabled(self):
        return self.live and (self.running or self.control & 2 != 0)

    def outputs(self):
        return sum((1 if side else 2) << 2 * k for k, (side, on, _) in enumerate(self.leg) if on) if self.enabled() else 0

    def next_leg(self, k):
        side, on, left = self.leg[k]
        wish = self.running and not self.control & 2 and self.wished(self.active[k])
        if not self.enabled():
            return wish, False, self.dead
        if left // 2 != 0:
            return side, on, left - 1
        if not on:
            return side, True, self.min_pulse
        return (wish, False, self.dead) if wish != side else (side, on, left)

    def clock(self, live, write):
        """The registers' next values; `write` is (offset, value) or None."""
        n, offset, value = replace(self), *(write or (None, 0))
        n.trigger, n.compare = list(self.trigger), list(self.compare)
        to_valley = self.running and self.rising and self.count >= self.last
        to_peak = self.running and not self.rising and self.count <= 1
        way = 0x20000 if self.rising else 0x10000
        n.triggered = self.running and any(t & way and self.count == t & 0xFFFF for t in self.trigger)
        load, once = to_valley or (to_peak and self.mode != 0), self.mode & 2 != 0
        n.leg = [self.next_leg(k) for k in range(3)]
        n.fresh = commits = offset == 0x30
        withdraws = offset in (0x28, 0x2C)
        takes = [waits and (not self.running or load or (once and self.fresh and all(
            self.wished(one[k]) == self.rising for one in (self.active, self.compare))))
            for k, waits in enumerate(self.waiting)]
        n.active = [self.compare[k] if takes[k] else self.active[k] for k in range(3)]
        n.waiting = [commits or (self.waiting[k] and not takes[k] and not withdraws) for k in range(3)]
        n.fell_back = [once and not takes[k] for k in range(3)] if self.fresh else self.fell_back
        n.last = max(self.period - 1, 0)
        if not self.control & 1 or not self.running:
            n.running, n.count, n.rising = self.control & 1 != 0, self.phase & 0xFFFF, self.phase >> 16 != 0
        elif to_valley or to_peak:
            n.count, n.rising = self.period if to_valley else 0, to_peak
        else:
            n.count = (self.count + (1 if self.rising else 0xFFFF)) & 0xFFFF
        n.live = live
        if offset == 0x00:
            n.control = value & 7
        elif offset in SETTINGS and not (self.control & 3 or self.running):
            setattr(n, SETTINGS[offset][0], value & SETTINGS[offset][1])
        elif offset in (0x1C, 0x20):
            n.trigger[offset == 0x20] = value & 0x3FFFF
        elif offset in (0x28, 0x2C, 0x30):
            n.compare[(offset - 0x28) // 4] = value & 0xFFFF
        return n

    def registers(self):
        fell_back = sum(back << 4 + k for k, back in enumerate(self.fell_back))
        status = self.running | self.rising << 1 | any(self.waiting) << 2 | fell_back
        return [self.control, status, self.period, self.dead, self.min_pulse, self.mode, self.phase, *self.trigger, self.count,
                *self.compare, 0, 0]


def any_write(draw):
    """All settings small, and seldom off for long."""
    offset, value = 4 * draw.randrange(15), draw.randrange(45)
    if draw.randrange(2):
        return 0x28 + 4 * draw.randrange(3), value
    if offset == 0x00:
        return offset, draw.getrandbits(32) if draw.randrange(6) == 0 else 1
    if offset in (0x0C, 0x10):
        return offset, draw.randrange(9)
    return offset, value | draw.getrandbits(16) << 16 if offset in (0x18, 0x1C, 0x20) else value


def reach(p, now):
    triggered = False
    while c.pwm_next_event(p) <= now:
        triggered = c.pwm_take_event(p) or triggered
    c.pwm_catch_up(p, now)
    return triggered


@pytest.mark.parametrize("seed", range(20))
def test_random_writes(seed):
    draw, p, r, live = random.Random(seed), c.pwm(), Reference(), False
    seen = {"changes": 0, "triggers": 0, "fell_back": 0}
    c.pwm_reset(p, 0)
    assert c.pwm_next_event(p) == c.pwm_next_trigger(p) == NEVER, "nothing comes by itself"
    assert [c.pwm_read(p, at) for at in range(0, 0x3C, 4)] == r.registers()
    first = [(0x08, 3 + draw.randrange(38)), (0x18, draw.randrange(40)), (0x0C, draw.randrange(9)), (0x10, draw.randrange(9)),
             (0x14, seed % 4), (0x00, 1)]  # a period within sight from the start
    for clock in range(1, CLOCKS + 1):
        write = first[clock - 1] if clock <= 6 else any_write(draw) if draw.randrange(12) == 0 else None
        live = clock == 6 if clock <= 6 else live ^ (draw.randrange(300) == 0)
        promise, before = c.pwm_next_trigger(p), r.outputs()
        r = r.clock(live, write)
        triggered = reach(p, clock * CLOCK_PS)
        c.pwm_set_live(p, live)
        if write:
            c.pwm_write(p, *write)
        assert (p.outputs, triggered) == (r.outputs(), r.triggered), clock
        assert not r.triggered or clock * CLOCK_PS >= promise, "promised later"
        if write or clock % 3 == 0:
            assert [c.pwm_read(p, at) for at in range(0, 0x3C, 4)] == r.registers(), clock
        for name, one in (("changes", before != r.outputs()), ("triggers", r.triggered), ("fell_back", r.fell_back[0])):
            seen[name] += one
    assert seen["changes"] > 20


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
