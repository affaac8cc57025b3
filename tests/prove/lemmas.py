# SPDX-License-Identifier: MIT
"""
What intervals cannot tell, each from all of its cases in exact whole numbers: the lengths of the vectors, and so of all sums
of products that turn them (Cauchy, Schwarz), and that a full integral takes no further step.
"""
from math import isqrt
from types import SimpleNamespace

import chain
import numpy as np
import z3
from arithmetic import Integers
from arrays import Arrays, Intervals, Span
from invariant import FULL, INPUTS, INTEGRAL
from proof import TIME_LIMIT_MS, Refuted
from specs import svm_half

BLOCK = 1 << 18


class Known(Integers):
    """Unbounded integers; of named values the span is a fact."""

    def __init__(self, known):
        super().__init__()
        self.known, self.found = known, {}

    def value(self, name):
        return self.bounded(name, z3.Int(name))

    def cut(self, name, value):
        self.found[name] = value
        return value

    def bounded(self, name, value):
        if name in self.known:
            self.facts += [value >= self.known[name].low, value <= self.known[name].high]
        return value


class Trigonometry:
    """All 2^22 angles that differ in what the table and the chords look at."""

    def __init__(self, words):
        self.square, self.ranges = 0, {}
        for first in range(-(1 << 21), 1 << 21, BLOCK):
            o = Arrays({"chords": words})
            sin, cos = chain.trigonometry(o, np.arange(first, first + BLOCK, dtype=np.int64) << 10)
            self.square = max(self.square, int((sin * sin + cos * cos).max()))
            for name, values in o.found.items():
                seen = Span(int(values.min()), int(values.max()))
                self.ranges[name] = seen.joined(self.ranges.get(name, seen))


def current_square():
    """The largest alpha^2 + beta^2; where beta is largest, with i_a + 2 i_b, alpha can be, too."""
    most = INPUTS["IA"].high
    beta = chain.beta_q15(Arrays({}), np.arange(-3 * most, 3 * most + 1))
    return int(most * most + (beta * beta).max())


def voltage_square(k, circle):
    """The largest v_d^2 + v_q^2: of each place of the circle's table the farthest v_d beside the largest v_q."""
    ends = [(n - (1 << k.circle_bits - 1)) << k.circle_shift for n in range(1 << k.circle_bits)]
    farthest = [max(abs(low), abs(low + (1 << k.circle_shift) - 1)) for low in ends]
    return max(d * d + q * q for d, q in zip(farthest, circle))


def _within(square):
    return Span(-isqrt(square), isqrt(square))


def sums_of_products(trigonometry, currents, voltages):
    """|x cos + y sin| <= |(x, y)| |(cos, sin)|."""
    length = isqrt(voltages * trigonometry.square) + 1
    turned = dict.fromkeys(("along", "across"), _within(currents * trigonometry.square))
    return turned | dict.fromkeys(("a", "b_beta"), Span(-length, length)) | phase_sums(length)


def phase_sums(length):
    """
    With x = 28378 / 32768: b = x beta - a/2 + r, where beta, rounded down to 2^15, and a/2 leave -28378 < r <= 1/2. Of a vector
    (a, beta) within `length`, p a + q beta is within sqrt(p^2 + q^2) length.
    """
    x, halves = chain.SIN60_Q15, {"b": (1, 1), "minus_c": (1, 1), "a_less_b": (3, 1), "a_less_c": (3, 1), "b_less_c": (0, 2)}
    found = {}
    for name, (p, q) in halves.items():
        square = (p << 14) ** 2 + (q * x) ** 2
        end = (isqrt(square * length * length) >> 15) + 1 + q * (x + 1)
        found[name] = Span(-end, end)
    return found


def half_times(k, known):
    """
    The halves of the on-times: with their middle at k.half, none is farther from it than half of the largest difference
    between two. And that middle is half of the sum of the largest and the smallest. By the solver, over all whole numbers.
    """
    o = Known(known)
    a, beta_steps = (o.bounded(name, z3.Int(name)) for name in ("a", "beta_steps"))
    end = max(known[name].high for name in known if "_less_" in name) // 2 + 2
    chain.modulated(o, k, a, beta_steps)
    wanted = k.half - svm_half(o, SimpleNamespace(a=a, b=o.found["b"]))[0]
    _holds("the middle is that of largest and smallest", o, o.found["base"] == wanted)
    halves = "half_a", "half_b", "half_c"
    for half in halves:
        _holds(f"{half} is near the middle", o, o.within(o.found[half], k.half - end, k.half + end))
    return dict.fromkeys(halves, Span(k.half - end, k.half + end))


def _holds(what, o, claim):
    solver = z3.Solver()
    solver.set("timeout", TIME_LIMIT_MS)
    solver.add(*o.facts, z3.Not(claim))
    if solver.check() != z3.unsat:
        raise Refuted(f"not so for all values: {what}")


def never_fuller(k, state, circle, spans):
    """
    A full integral takes no step further: the wish is at the end of 16 bits, and even turned it lies beyond the limit. For d
    by intervals; for q with every turned d, and what the circle leaves beside it.
    """
    most = max(-spans["error_d"].low, spans["error_d"].high)
    for full, sign in ((Span(FULL, INTEGRAL), 1), (Span(-INTEGRAL, -FULL), -1)):
        for errors in (Span(0, most), Span(-most, 0)):
            o = Intervals({"circle": Span(min(circle), max(circle))}, {})
            v = state | {name: errors for name in ("i_d_ref_q15", "i_q_ref_q15")}
            v |= {name: full for name in ("integral_d_q9", "integral_q_q9")}
            chain.regulate(o, k, SimpleNamespace(**v), Span(0, 0), Span(0, 0))
            further = errors.high * sign > 0 or errors.low * sign > 0
            _takes_no_step("d", o.found["held_d"], sign)
            if not further:
                _takes_no_step("q", o.found["held_q"], sign)
            elif o.found["wanted_q"] != Span(32767, 32767) and o.found["wanted_q"] != Span(-32768, -32768):
                raise Refuted("a full integral of q is not at the end of 16 bits")
    turned = spans["voltage_x"]
    _q_is_limited(k, circle, state["turn_q15"].high, np.arange(turned.low, turned.high + 1))


def _takes_no_step(axis, held, sign):
    if (held.high if sign > 0 else -held.low) > 0:
        raise Refuted(f"a full integral of {axis} takes a step further")


def _q_is_limited(k, circle, turn, turned_d):
    """A wish of 32767, turned by whatever is allowed, is beyond what the circle leaves; so is -32768, all the more."""
    half = 1 << k.v_d_bits - 1
    place = (np.clip(turned_d, -half, half - 1) >> k.circle_shift) + (1 << k.circle_bits - 1)
    turned_back = (turn * np.abs(turned_d) >> 15) + 1
    if (32767 - turned_back <= np.array(circle)[place]).any():
        raise Refuted("a full integral of q takes a step further")
