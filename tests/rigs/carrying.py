# SPDX-License-Identifier: MIT
"""A motor in formulas whose drive is to carry on from each fault of the encoder."""
from rigs.motor import CLOCKS, LOOPS, Motor

CAUSES = ("ENCODER", "ENCODER_SLIP", "ENCODER_DEAD", "ENCODER_COUNTS")
ENCODER_BIT, LIVE, ADC_CURRENT = 1 << 5, 1, 1 << 4
ALL_ONES = 2**32 - 1


def frame_deg(c, loop):
    """The frame of the currents at the next sample."""
    follows = loop.pll.angle_q32 & loop.field_follows
    angle_q32 = loop.pll.angle_q32 + loop.angle_offset_q32 if loop.source == c.LOOP_ENCODER else loop.field_angle_q32 + follows
    return angle_q32 % 2**32 * 360 / 2**32


class Carrying(Motor):
    """A motor of which each fault of the encoder is to be carried on from; the gates do as they are told."""

    def __init__(self, c, rpm=3000, i_a=4.0, **params):
        super().__init__(c, rpm, i_a, **params)
        for cause in CAUSES:
            self.axis.reactions.choice[c.enums["fault"]["FAULT_" + cause]] = c.REACTION_CARRY
        c.current_loop_tune(self.axis.loop, self.axis.tuning)
        c.torque_build(self.axis.torque, self.axis.params, self.axis.tuning, self.fabric.adc.VBUS)
        c.torque_measure(self.axis.torque, self.axis.loop, self.axis.tuning, self.fabric.adc.VBUS)
        c.modes_limit_torque(self.axis)
        self.axis.loop.status_max, self.axis.start.aligned = LIVE, True
        self.axis.speed.target_rpm_q16 = self.axis.speed.ref_rpm_q16 = rpm << 16
        self.fabric.gate.CONTROL = 1
        self.step(600)

    def see(self):
        """As the interrupt leaves it: the angle is that of the next sample."""
        super().see()
        loop = self.axis.loop
        loop.pll.angle_q32 = (loop.pll.angle_q32 + loop.pll.speed_q32) % 2**32

    def slow_step(self):
        """All of the slow loop."""
        self.fabric.adc.SEQUENCE += LOOPS
        self.fabric.encoder.LATCH_TIME = (self.fabric.encoder.LATCH_TIME + CLOCKS) % 2**32
        self.fabric.gate.STATUS = self.fabric.gate.CONTROL & 1
        self.c.drive_step(self.axis)

    def sample_fault(self, gate=0, adc=0):
        self.fabric.gate.STATUS, self.fabric.adc.STATUS = gate | self.fabric.gate.CONTROL & 1, adc
        self.c.drive_sample_fault(self.axis)
        self.fabric.gate.STATUS, self.fabric.adc.STATUS = self.fabric.gate.CONTROL & 1, 0

    @property
    def degrees_off(self):
        """The frame at the next sample, from where the rotor will be."""
        sample = self.rpm / 60 * self.p.pole_pairs * 360 / 20000
        rotor = self.counts * self.p.pole_pairs / self.p.encoder_counts * 360 + sample
        return (frame_deg(self.c, self.axis.loop) - rotor + 180) % 360 - 180

def observer_leads(m):
    loop, c = m.axis.loop, m.c
    return (loop.source == c.LOOP_OBSERVER and loop.field_follows == ALL_ONES and
            m.axis.tuning.angle_source == c.PARAM_ANGLE_SENSORLESS)
