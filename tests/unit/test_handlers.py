# SPDX-License-Identifier: MIT
"""The current loop's handlers in C, sample by sample on random states: those of other sources come to what the encoder's comes
to at the same angle; those that weaken the field obey the law that stands here once more."""
import ctypes
import random
from math import isqrt

import pytest

STEPS = 2000
ALL = 2**32 - 1
HALF_COUNTS, EDGE, WHOLE_EDGE = 2500, 52, 101  # half or whole of a dead time, and of a shortest pulse, on either side
RADIUS, DEAD_STEPS, SIX_STEPS = 21210, 21210 // 16, 25464
SOURCES = ("forced", "observer", "injection", "hall")


class Handlers:
    """The loop of the first axis and its fabric, in any state."""

    def __init__(self, system, device, seed):
        self.c, self.axis, self.fabric, self.draw = system, system.axes[0], device.fabric, random.Random(seed)
        system.drive_init(self.axis, device.fabric)
        self.axis.fabric_untrusted, self.loop = 0, self.axis.loop
        system.current_loop_init(self.loop)
        self.loop.status_max = self.fabric.gate.STATUS = 1

    def any(self, limit, low=None):
        """Up to the limit; often an end, 0 or next to it."""
        low = -limit if low is None else low
        return self.draw.choice((low, limit, 0, max(-1, low))) if self.draw.random() < 0.25 else self.draw.randint(low, limit)

    def fill(self):
        loop, word = self.loop, lambda: self.draw.getrandbits(32)
        loop.pll.angle_q32, loop.pll.speed_q32, loop.angle_offset_q32 = word(), self.any(2**28), word()
        loop.i_d_ref_q15, loop.i_q_ref_q15 = self.any(32767), self.any(32767)
        loop.kp_d_q9, loop.kp_q_q9, loop.ki_q15 = self.any(16384, 0), self.any(16384, 0), self.any(21845, 0)
        loop.integral_d_q9, loop.integral_q_q9 = self.any(2**29), self.any(2**29)
        loop.turn_q15, loop.dead_shift, loop.encoder_scale_q32 = self.any(19660), self.draw.randrange(6), word()
        loop.field_angle_q32, loop.field_speed_q32 = word(), self.any(2**28)
        for name in ("IA", "IB", "IC"):
            setattr(self.fabric.adc, name, self.any(32767))
        self.fabric.encoder.LATCHED = self.draw.randrange(65536)

    def sample(self, handler, state=None):
        """(state, compares) behind a sample."""
        if state is not None:
            ctypes.memmove(ctypes.addressof(self.loop), state, len(state))
        pwm = self.fabric.pwm
        pwm.COMPARE_A = pwm.COMPARE_B = pwm.COMPARE_C = ALL
        self.fabric.adc.STATUS = 98
        getattr(self.c, f"handlers_{handler}_ab")()
        assert self.fabric.adc.STATUS & 0x103 == 1 and self.axis.faults.cause == 0, "acknowledged, and nothing else"
        return bytes(self.loop), (pwm.COMPARE_A, pwm.COMPARE_B, pwm.COMPARE_C)

    def state_of(self, state):
        return type(self.loop).from_buffer_copy(state)


@pytest.fixture
def handlers(system, device):
    return lambda seed: Handlers(system, device, seed)


@pytest.mark.parametrize("source", SOURCES)
def test_another_source_does_what_the_encoder_s_handler_does_at_its_angle(handlers, source):
    """Afterwards the field has turned by its speed; what finds the angle is judged elsewhere."""
    h = handlers(source)
    for _ in range(STEPS):
        h.fill()
        loop = h.loop
        loop.field_follows = ALL * h.draw.randrange(2) if source != "forced" else 0
        if source == "injection":  # no voltage is added, and the current stands: then the mean of two samples is the sample
            total = h.fabric.adc.IA + 2 * h.fabric.adc.IB
            beta = (total + (total * 20277 >> 17) + 1) >> 1
            loop.inject = h.c.injection(first=-h.draw.randrange(2), signs=h.draw.getrandbits(32), silent=h.draw.randrange(2),
                                        i_alpha_q15=h.fabric.adc.IA, i_beta_q15=beta)
        before = bytes(loop)
        tested, compares = h.sample(source)
        expected = h.state_of(before)
        angle = expected.field_angle_q32 + (expected.pll.angle_q32 & expected.field_follows)
        expected.angle_offset_q32 = angle - expected.pll.angle_q32 & ALL
        state, wanted = h.sample("encoder", bytes(expected))
        expected, got = h.state_of(state), h.state_of(tested)
        expected.angle_offset_q32 = got.angle_offset_q32
        expected.field_angle_q32 = expected.field_angle_q32 + expected.field_speed_q32 & ALL
        for own in ("pll", "flux", "inject") if source != "forced" else ():
            setattr(expected, own, getattr(got, own))
        assert (bytes(expected), wanted) == (tested, compares)
        assert all(EDGE <= one <= HALF_COUNTS - EDGE for one in compares)


def limited(wanted, most, step):
    """(voltage, what of the step is integrated)"""
    voltage = max(-most, min(wanted, most))
    return voltage, 0 if (wanted - voltage) * step > 0 else step


def weakened(loop, i_d, i_q):
    """The law of firmware/control/stage_weaken.h: changes what the handler changes, and returns nothing."""
    w = loop.weaken
    errors = [(ref - i) * w.gain_share_q8 >> 8 for ref, i in (
        (loop.i_d_ref_q15 - (w.retreat_q22 >> 7), i_d), (loop.i_q_ref_q15, i_q))]
    wanted = [max(-32768, min((kp * error + integral) >> 9, 32767)) for kp, error, integral in zip(
        (loop.kp_d_q9, loop.kp_q_q9), errors, (loop.integral_d_q9, loop.integral_q_q9))]
    voltage, step = [0, 0], [loop.ki_q15 * error for error in errors]
    first = 1 if w.q_first else 0
    voltage[first], step[first] = limited(wanted[first], w.first_max_steps, step[first])
    rest = isqrt(w.radius_steps**2 - voltage[first]**2)
    voltage[1 - first], step[1 - first] = limited(wanted[1 - first], rest, step[1 - first])
    sign = (lambda x: ~x) if w.gain_q15 < 0 else (lambda x: x)
    over = max(min(sign(wanted[1] - voltage[1]), sign(wanted[1]) - w.room_q_steps) - DEAD_STEPS, 0)
    lack = over * abs(w.gain_q15) >> 8
    loop.weaken.retreat_q22 = min(w.retreat_q22 + (lack - w.retreat_q22 >> 2), w.max_q15 << 7)
    loop.i_d_q15, loop.i_q_q15, loop.v_d_steps, loop.v_q_steps = i_d, i_q, *voltage
    loop.integral_d_q9 += step[0] >> 6
    loop.integral_q_q9 += step[1] >> 6


def without_regulation(h, state, voltage, turn_q32):
    """The same state, of which the encoder's handler modulates this voltage: through integrals, its turn taken back before;
    seen from a quarter turn on where that handler has no room for so much in d."""
    loop = h.state_of(state)
    if abs(voltage[0]) >= 2**14:
        voltage, turn_q32 = (voltage[1], -voltage[0]), turn_q32 + 2**30
    q = voltage[1] - (loop.turn_q15 * voltage[0] >> 15)
    d = voltage[0] + (loop.turn_q15 * q >> 15)
    loop.kp_d_q9 = loop.kp_q_q9 = loop.ki_q15 = 0
    loop.integral_d_q9, loop.integral_q_q9 = d << 9, q << 9
    loop.angle_offset_q32 = loop.angle_offset_q32 + turn_q32 & ALL
    for n in range(len(loop.circle_steps)):
        loop.circle_steps[n] = 65535
    return bytes(loop)


@pytest.mark.parametrize("handler", ("weakening", "overmodulating"))
def test_a_handler_that_weakens_the_field(handlers, handler):
    """To the bit; and no voltage leaves its circle, no compare its place: beyond the modulator's circle that may be an end."""
    h, beyond = handlers(handler), handler == "overmodulating"
    for _ in range(STEPS):
        h.fill()
        loop, draw = h.loop, h.draw
        radius = RADIUS + (SIX_STEPS - RADIUS) * draw.randrange(101) // 100 if beyond else RADIUS
        loop.kp_d_q9, loop.kp_q_q9, loop.ki_q15 = draw.randrange(1024), draw.randrange(1024), draw.randrange(4096)
        loop.turn_q15 = h.any(11900)  # so that the voltage before its turn is a number of 16 bits
        loop.integral_d_q9, loop.integral_q_q9 = h.any(2**24), h.any(2**24)
        loop.weaken = h.c.loop_weakening(
            turn_q32=draw.getrandbits(32), radius_steps=radius, q_first=-draw.randrange(2),
            first_max_steps=radius - draw.randint(0, radius // 2), gain_share_q8=draw.randrange(257), gain_q15=h.any(16383),
            max_q15=draw.randrange(32768), room_q_steps=draw.randrange(32768), retreat_q22=draw.randrange(32768) << 7)
        before = bytes(loop)
        tested, compares = h.sample(handler)
        got, expected = h.state_of(tested), h.state_of(before)
        weakened(expected, got.i_d_q15, got.i_q_q15)
        voltage = expected.v_d_steps, expected.v_q_steps
        encoder, wanted = h.sample("encoder", without_regulation(h, before, voltage, expected.weaken.turn_q32))
        expected.pll = h.state_of(encoder).pll
        assert bytes(expected) == tested and voltage[0]**2 + voltage[1]**2 <= radius**2
        assert beyond or compares == wanted
        edge = WHOLE_EDGE if beyond else EDGE
        assert all(edge <= one <= HALF_COUNTS - edge or (beyond and one in (0, HALF_COUNTS)) for one in compares)
        state, _ = h.sample("encoder", before)
        measured = h.state_of(state)
        assert (got.i_d_q15, got.i_q_q15) == (measured.i_d_q15, measured.i_q_q15), "as the encoder's"
