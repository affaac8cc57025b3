# SPDX-License-Identifier: MIT
"""What admitted.c tells: the build's numbers, the circle's table, and what tuning and slow loop make of the state."""
import subprocess
from types import SimpleNamespace

from arrays import Span
from invariant import FULL, INTEGRAL, state
from proof import Refuted

V_MIN_LEAST = 8186  # v_min is 1000 mV, or at least a quarter of v_range in whole mV (tuning.c): the least is 1000 of 4003


class Admitted:
    def __init__(self, program, steps):
        command = [str(program), str(steps)]
        lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
        rows = [(name, int(low), int(high)) for name, low, high in map(str.split, lines)]
        self.circle = [low for name, low, _ in rows if name == "circle"]
        self.spans = {name: Span(low, high) for name, low, high in rows if name != "circle"}
        self.k = SimpleNamespace(**{name: span.low for name, span in self.spans.items()})

    def check(self):
        """Is what the slow loop writes within the invariant? Returns how many sets of parameters were admitted."""
        seen, wanted = self.spans, state(self.k)
        for name in ("kp_d_q9", "kp_q_q9", "ki_q15", "turn_q15"):
            _within(name, seen[name], wanted[name])
        for name in ("i_d_ref_q15", "i_q_ref_q15"):
            _within(name, seen["i_ref"], wanted[name])
        for name in ("feedforward_d_steps", "feedforward_q_steps"):
            _within(name, seen[name], Span(-self.feedforward_most, self.feedforward_most))
        _within("dead_shift", seen["dead_shift"], Span(0, 0))
        if self.integral_most > INTEGRAL:
            raise Refuted(f"integrals may reach {self.integral_most}")
        return seen["admitted"].low

    @property
    def feedforward_most(self):
        """current_loop.c clamps voltages to 1.0, and no bus counts as less than v_min."""
        return self.k.bus_steps * 32768 // V_MIN_LEAST + 1

    @property
    def integral_most(self):
        """
        The interrupt changes what an integral has beyond its feed-forward, and takes no step up where the integral is full;
        the slow loop changes the feed-forward. So the first stays within full, a step and the feed-forward; the integral
        within that and the feed-forward again.
        """
        step = (self.k.ki_max * 98302 >> 6) + 1
        return FULL + step + 2 * (self.feedforward_most << 9)


def _within(name, span, limits):
    if span.low < limits.low or span.high > limits.high:
        raise Refuted(f"{name} may be {span.low}...{span.high}, beyond {limits.low}...{limits.high}")
