# SPDX-License-Identifier: MIT
"""A motor in formulas behind the registers, in steady state, with one thing wrong where a test wants it."""
import math

from rigs.drive import Rig

LOOPS, CLOCKS = 20, 100_000  # of a millisecond
BASE_HZ = 1250


class Motor(Rig):
    """A motor in steady state behind the registers: i_d = 0, current as asked, an encoder, voltages by its equations."""

    def __init__(self, c, rpm=3000, i_a=4.0, **params):
        super().__init__(c, **params)
        c.tuning_compute(self.axis.params, self.axis.tuning)
        c.thermal_tune(self.axis.thermal, self.axis.params)
        self.p = self.axis.params
        self.range_a, self.range_v = self.p.i_range_ma / 1e3, self.p.v_range_mv / 1e3
        self.counts, self.slip, self.frozen, self.open_phase, self.shown_rpm = 0.0, 0, False, None, None
        self.carried = 1.0  # of the current that is asked
        self.r, self.lq, self.psi = 0.36, 200e-6, 6.395e-3
        self.rpm, self.i_a, self.at_limit, self.extra_v = rpm, i_a, False, 0.0
        self.fabric.adc.VBUS = 13670
        self.axis.loop.vbus_q15, self.axis.loop.radius_q15 = 13670, 7300
        self.axis.state, self.axis.mode = c.AXIS_OPERATION_ENABLED, c.AXIS_MODE_SPEED
        self.fabric.gate.STATUS = 1
        self.axis.speed.speed_ref_rpm_q4 = rpm * 16
        self.look()
        c.supervision_begin(self.axis)

    @property
    def hz(self):
        return self.rpm / 60 * self.p.pole_pairs

    def look(self):
        """The slow loop's measurement of the speed; the speed itself is as told."""
        self.see()
        self.c.speed_estimate_step(self.axis.speed.estimate, self.fabric.encoder, self.axis.tuning)

    def see(self):
        """What the registers and the current loop hold now."""
        loop, turn = self.axis.loop, self.p.encoder_counts
        believed_rpm = self.rpm if self.shown_rpm is None else self.shown_rpm
        hz = believed_rpm / 60 * self.p.pole_pairs
        if not self.frozen:
            self.counts_shown = self.counts
            latched = round(self.counts + self.slip) % turn
            if latched != self.fabric.encoder.LATCHED:
                self.fabric.encoder.EDGE_TIME = self.fabric.encoder.LATCH_TIME
            self.fabric.encoder.LATCHED = latched
        loop.pll.speed_q32 = round(hz / 20000 * 2**32)
        loop.pll.angle_q32 = round((self.counts + self.slip) * self.p.pole_pairs / turn * 2**32) % 2**32
        w = 2 * math.pi * self.hz
        off = -2 * math.pi * self.slip * self.p.pole_pairs / turn  # where the rotor is, from where the encoder has it
        if self.frozen:  # and the frame with it
            off += 2 * math.pi * (self.counts - self.counts_shown) * self.p.pole_pairs / turn
        v_d = -2 * math.pi * hz * self.lq * self.i_a - w * self.psi * math.sin(off)
        v_q = self.r * self.i_a + w * self.psi * math.cos(off) + self.extra_v
        lag = 2 * math.pi * hz * 75e-6
        loop.v_turn_q15 = round(lag * 32768)
        loop.v_d_q15 = self.volt(v_d * math.cos(lag) - v_q * math.sin(lag))
        loop.v_q_q15 = self.volt(v_q * math.cos(lag) + v_d * math.sin(lag))
        loop.i_d_q15, loop.i_q_q15 = 0, self.ampere(self.i_a)
        loop.i_q_ref_q15 = self.ampere(self.i_a)
        theta = (self.counts + self.slip) * self.p.pole_pairs / turn * 2 * math.pi
        phases = [-self.carried * self.i_a * math.sin(theta - n * 2 * math.pi / 3) for n in range(3)]
        if self.open_phase is not None:  # of a star: what flows into one of the others flows out of the last
            one, other = (self.open_phase + 1) % 3, (self.open_phase + 2) % 3
            between = (phases[one] - phases[other]) / 2
            phases[self.open_phase], phases[one], phases[other] = 0.0, between, -between
        self.fabric.adc.IA, self.fabric.adc.IB, self.fabric.adc.IC = map(self.ampere, phases)
        self.fabric.adc.VALID = 7
        self.axis.speed.speed_rpm_q4 = round(believed_rpm * 16)
        self.axis.speed.at_limit = self.at_limit

    def volt(self, value):
        return round(value / self.range_v * 32768)

    def ampere(self, value):
        return round(value / self.range_a * 32768)

    def step(self, count=1, before=None):
        for _ in range(count):
            self.axis.time_ms += 1
            self.counts += self.rpm / 60000 * self.p.encoder_counts
            self.fabric.encoder.LATCH_TIME = (self.fabric.encoder.LATCH_TIME + CLOCKS) % 2**32
            if before:
                before(self)
            self.look()
            self.c.supervision_step(self.axis)
            self.c.reaction_step(self.axis)
        return self

    def until_fault(self, most_ms, before=None):
        """Steps until something is found: after how many milliseconds, or None."""
        for n in range(1, most_ms + 1):
            self.step(1, before)
            if self.axis.faults.cause:
                return n
        return None


def slip(degrees):
    def happens(m):
        m.slip = round(degrees / 360 / m.p.pole_pairs * m.p.encoder_counts)
    return happens
