# SPDX-License-Identifier: MIT
"""The motor in formulas of test_unit_supervision.py, with three Hall switches whose wires may break."""
import ctypes

from rigs.carrying import Carrying
from rigs.hall_rotor import IDEAL, TURN
from rigs.motor import CLOCKS, LOOPS

SAMPLE = CLOCKS // LOOPS
SETTLES_MS = 300


def intact(state):
    return state


def open_wire(wire):
    """A pull-up holds it."""
    return lambda state: state | 1 << "ABC".index(wire)


class HallMotor(Carrying):
    """It turns by its Hall switches, and each fault of theirs is to be carried on from."""

    def __init__(self, c, rpm=3000, i_a=4.0, source=2, **params):
        self.wires, self.turns, self.edge_clock, self.shown = intact, 0.0, 0, IDEAL[0]
        super().__init__(c, rpm, i_a, **params)
        axis = self.axis
        axis.params.angle_source = source
        assert c.tuning_compute(axis.params, axis.tuning).error == c.ERROR_NONE
        for name in ("INVALID", "SEQUENCE"):
            axis.reactions.choice[c.enums["fault"]["FAULT_HALL_" + name]] = c.REACTION_CARRY
        table = c.hall_table()
        assert c.hall_table_of(axis.params, table) == c.ERROR_NONE
        c.hall_take_table(axis.hall, table, axis.tuning)
        axis.loop.source, axis.loop.field_follows, axis.loop.angle_offset_q32 = c.LOOP_HALL, TURN - 1, 0
        axis.loop.field_angle_q32 = axis.loop.field_speed_q32 = 0
        c.hall_begin(axis.hall, axis.loop, self.fabric.encoder)
        c.hall_watch_begin(axis)
        axis.speed.target_rpm_q16 = axis.speed.ref_rpm_q16 = rpm << 16
        self.step(SETTLES_MS)

    @property
    def degrees_off(self):
        """The frame at the next sample, from where the rotor will be."""
        loop = self.axis.loop
        frame = (loop.field_angle_q32 + (loop.pll.angle_q32 & loop.field_follows)) / TURN
        return ((frame - self.turns - self.hz / 20000 + 0.5) % 1 - 0.5) * 360

    def samples(self, count=LOOPS):
        """What the interrupt makes of so many, as the wires show the rotor."""
        states, times, clock = [], [], self.fabric.encoder.LATCH_TIME
        for n in range(1, count + 1):
            self.turns += self.hz / 20000
            sixths = self.turns * 6
            state = self.wires(IDEAL[int(sixths // 1) % 6])
            if state != self.shown:
                beyond = (sixths % 1 if self.hz > 0 else 1 - sixths % 1) / 6 / abs(self.hz / 20000)
                self.edge_clock = clock + n * SAMPLE - round(min(beyond, 1) * SAMPLE)
            self.shown = state
            states.append(state)
            times.append(self.edge_clock % TURN)
        array, unused = ctypes.c_uint32 * count, (ctypes.c_uint32 * count)()
        self.c.host_hall_samples(self.axis.loop, self.axis.hall, self.fabric.encoder, array(*states), array(*times), SAMPLE,
                                 count, unused)

    def step(self, count=1, before=None):
        if self.axis.loop.source != self.c.LOOP_HALL:
            return super().step(count, before)
        for _ in range(count):
            self.axis.time_ms += 1
            if before:
                before(self)
            self.samples()
            kept = self.axis.loop.pll.angle_q32, self.axis.loop.pll.speed_q32
            self.counts = self.turns / self.p.pole_pairs * self.p.encoder_counts
            self.see()
            self.axis.loop.pll.angle_q32, self.axis.loop.pll.speed_q32 = kept
            self.c.rotor_take_speed(self.axis)
            self.c.supervision_step(self.axis)
            self.c.reaction_step(self.axis)
        return self

    def until_carried(self, most_ms):
        for _ in range(most_ms):
            if self.axis.failover.pending or self.axis.faults.cause:
                break
            self.step()
        return self
