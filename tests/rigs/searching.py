# SPDX-License-Identifier: MIT
"""A drive without an encoder that is about to look whether its rotor turns."""
import math

from rigs.drive import World
from rigs.motor_numbers import compute, shipped


class Searching(World):
    """A drive without an encoder that is about to look whether its rotor turns."""

    def __init__(self, c):
        super().__init__(c)
        self.axis.params.angle_source = 1
        self.axis.tuning = compute(c, {**shipped(), "angle_source": 1})[2]
        self.fabric.pwm.PERIOD, self.fabric.pwm.DEAD = 2500, 100
        c.flying_begin(self.axis)
        self.put("READY")

    def show(self, current):
        """A millisecond begins, in which each pulse shows this current, Q15."""
        i_a = current.real
        i_b = -current.real / 2 + current.imag * math.sqrt(3) / 2
        self.fabric.adc.IA, self.fabric.adc.IB = round(i_a), round(i_b)
        self.fabric.adc.SEQUENCE += 20

    def look(self, current=0j):
        self.show(current)
        return self.c.name("flying_result", self.c.flying_step(self.axis))


def enough(w):
    return max(w.axis.tuning.i_max_q15 * 7 >> 8, 128)


def regulating(searching, v_d, v_q):
    searching.axis.flying.regulates, searching.axis.flying.ms = True, 0
    searching.axis.loop.v_d_steps, searching.axis.loop.v_q_steps = v_d, v_q
