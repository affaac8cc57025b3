# SPDX-License-Identifier: MIT
"""The look at an offset that was remembered, on a rotor on a perfect current source: every error, friction, load, inertia."""
import math
from types import SimpleNamespace

import pytest

TURN, RANGE_Q15 = 2**32, 20000
STEPS = 20  # of integration in a millisecond


class Rotor:
    """A rotor whose swing about the full current takes `period_ms`; torques in shares of that current's.

    error_deg   how far the magnets are ahead of where the encoder's offset says
    mirror      two phases, or the encoder's tracks, are exchanged
    load        pulls, but less than friction holds; salient: reluctance torque against the magnets', at the full current
    hoist       pulls as well; at rest a ratchet holds it, which a quarter of its pull lets go
    cogging     six times a turn; more than friction holds, so that it creeps where no current flows
    """

    def __init__(self, c, error_deg, counts=1000, period_ms=45.0, told_ms=None, friction=0.02, load=0.0, mirror=False,
                 salient=0.0, at_deg=13.0, hoist=0.0, cogging=0.0):
        self.c, self.error, self.mirror, self.salient = c, math.radians(error_deg), mirror, salient
        self.hoist, self.cogging = hoist, cogging
        self.friction, self.load, self.counts = friction, load, counts
        self.w0_squared = (2 * math.pi / period_ms * 1e3) ** 2
        self.angle, self.speed, self.ms = math.radians(at_deg), 0.0, 0
        self.first, self.way, self.fastest = self.angle, 0.0, 0.0
        self.loop, self.tuning = c.current_loop(), c.tuning()
        t = self.tuning
        t.encoder_counts, t.pole_pairs, t.encoder_scale_q32 = 4 * counts, 4, TURN // counts
        t.align_levels = 1
        t.align[0].i_q15, t.align[0].period_ms = RANGE_Q15, round(told_ms or period_ms)
        self.check = c.offset_check()

    def latched(self):
        return math.floor(self.angle / (2 * math.pi) * self.counts) % (4 * self.counts)

    def seen(self):
        """Where the encoder says that the rotor is: the middle of its count."""
        return (math.floor(self.angle / (2 * math.pi) * self.counts) + 0.5) / self.counts * 2 * math.pi

    def torque(self):
        d, q = self.loop.i_d_ref_q15 / RANGE_Q15, self.loop.i_q_ref_q15 / RANGE_Q15
        field = self.seen() - self.error + math.atan2(q, d)
        ahead = (-field if self.mirror else field) - self.angle
        size = math.hypot(d, q)
        return size * math.sin(ahead) * (1 - self.salient * size * math.cos(ahead))

    def holds(self, torque):
        along = torque if self.hoist > 0 else -torque
        return -self.friction - abs(self.hoist) <= along <= self.friction + abs(self.hoist) / 4

    def move(self):
        dt = 1e-3 / STEPS
        for _ in range(STEPS):
            torque = self.torque() + self.load + self.cogging * math.sin(6 * self.angle)
            if self.speed == 0 and self.holds(torque):
                continue
            torque += self.hoist
            drag = math.copysign(self.friction, self.speed if self.speed else torque)
            before = self.speed
            self.speed += (torque - drag) * self.w0_squared * dt
            if before * self.speed < 0:
                self.speed = 0.0
            self.angle += self.speed * dt
            self.way = max(self.way, abs(self.angle - self.first))
            self.fastest = max(self.fastest, abs(self.speed))

    def look(self):
        self.c.offset_check_start(self.check, self.tuning, self.latched(), False)
        result = self.c.OFFSET_RUNNING
        while result == self.c.OFFSET_RUNNING and self.ms < 20000:
            result = self.c.offset_check_step(self.check, self.loop, self.tuning, self.latched())
            self.move()
            self.ms += 1
        names = {value: name for name, value in self.c.enums["offset_result"].items()}
        return SimpleNamespace(result=names[result], off_deg=self.check.off_deg, ms=self.ms, way_deg=math.degrees(self.way),
                               fastest=self.fastest)


def away(x, y):
    return abs((x - y + 180) % 360 - 180)


CALM = {"as told": {}, "rubs": {"friction": 0.1}, "does not rub": {"friction": 0.0}, "light": {"period_ms": 30},
        "heavy": {"period_ms": 900, "friction": 0.05}, "five times as heavy as told": {"period_ms": 500, "told_ms": 224},
        "a fifth of what was told": {"period_ms": 100, "told_ms": 224}, "fine": {"counts": 16384}, "coarse": {"counts": 128},
        "hoist": {"hoist": 0.3},
        "hoist back": {"hoist": -0.3}, "pulled": {"friction": 0.08, "load": 0.06},
        "pulled back": {"friction": 0.08, "load": -0.06},
        "salient": {"salient": 0.8}}
FALLS = ("hoist", "hoist back")  # half a turn off, a load is not caught at once
MOST_DEG = 20  # electrical
SIZE_DEG = {"rubs": 12, "pulled": 12, "pulled back": 12, "hoist": 180, "hoist back": 180,
            "five times as heavy as told": 90}  # otherwise 7


@pytest.mark.parametrize("case", CALM)
def test_one_that_is_right_is_believed_soon_and_hardly_moved(c, case):
    count_deg = 360 / CALM[case].get("counts", 1000)
    told_ms = CALM[case].get("told_ms", CALM[case].get("period_ms", 45))
    for at_deg, error_deg in ((13, 0), (100, 0), (211, 2), (287, -2)):
        seen = Rotor(c, error_deg, at_deg=at_deg, **CALM[case]).look()
        assert seen.result == "OFFSET_RIGHT", (at_deg, error_deg, seen)
        assert seen.way_deg <= MOST_DEG + 4 * count_deg and seen.ms <= 300 + 2 * told_ms, (at_deg, error_deg, seen)


@pytest.mark.parametrize("case", CALM)
def test_one_that_is_wrong_is_found_with_its_size(c, case):
    count_deg = 360 / CALM[case].get("counts", 1000)
    for error_deg in (-180, -150, -120, -90, -48, -20, 16, 30, 48, 90, 133, 177):
        seen = Rotor(c, error_deg, **CALM[case]).look()
        assert seen.result == "OFFSET_WRONG" and away(seen.off_deg, error_deg) <= SIZE_DEG.get(case, 7), (error_deg, seen)
        assert seen.way_deg <= (MOST_DEG if case not in FALLS else 75) + 6 * count_deg, (error_deg, seen)


@pytest.mark.parametrize("case", ("as told", "rubs", "heavy", "coarse"))
def test_exchanged_phases_are_wrong_wherever_the_rotor_stands(c, case):
    for error_deg in range(-180, 180, 9 if case != "heavy" else 36):
        seen = Rotor(c, error_deg, mirror=True, **CALM[case]).look()
        assert seen.result == "OFFSET_WRONG", (error_deg, seen)


@pytest.mark.parametrize("cogging", (0.013, 0.015, 0.02))
def test_a_rotor_that_creeps_by_its_cogging_is_not_wrong(c, cogging):
    for at_deg in range(0, 60, 2):
        for error_deg in (-4, 0, 4):
            seen = Rotor(c, error_deg, at_deg=at_deg, counts=1000, friction=0.012, cogging=cogging).look()
            assert seen.result == "OFFSET_RIGHT", (at_deg, error_deg, seen)


def test_a_rotor_that_nothing_moves_is_not_seen(c):
    seen = Rotor(c, 48, friction=1.1).look()
    assert seen.result == "OFFSET_UNKNOWN" and seen.way_deg == 0
