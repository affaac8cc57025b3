# SPDX-License-Identifier: MIT
"""
The states in which the interrupt is proved: {member of struct current_loop: its range}, and what the fabric gives. Members that
are not named may hold anything; those of CONSTANT are what current_loop_init() and the choice of the handler make them.
"""
from arrays import Span

ANY = Span(-(2**31), 2**31 - 1)
INTEGRAL = 2**29  # lib/pi.h
FULL = 32768 << 9  # an integral that alone brings the wish to the end of its 16 bits

STATE = {
    "angle_q32": ANY, "speed_q32": ANY, "angle_offset_q32": ANY, "encoder_scale_q32": ANY, "status_max": ANY,
    "i_d_ref_q15": Span(-32767, 32767), "i_q_ref_q15": Span(-32767, 32767),
    "kp_d_q9": Span(0, 16384), "kp_q_q9": Span(0, 16384), "ki_q15": Span(0, 21845),
    "integral_d_q9": Span(-INTEGRAL, INTEGRAL), "integral_q_q9": Span(-INTEGRAL, INTEGRAL),
}
INPUTS = {"IA": Span(-32767, 32767), "IB": Span(-32767, 32767), "LATCHED": ANY, "GATE_STATUS": ANY}
CONSTANT = {"sine": "trig_chords", "dead_shift": 0}  # a symbol's address, or a number
WRITTEN = ("angle_q32", "speed_q32", "integral_d_q9", "integral_q_q9", "i_d_q15", "i_q_q15", "v_d_steps", "v_q_steps")


def state(k):
    """With what the build's constants decide."""
    return STATE | {"turn_q15": Span(-k.turn_max, k.turn_max)}
