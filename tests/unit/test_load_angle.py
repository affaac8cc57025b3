# SPDX-License-Identifier: MIT
"""Where the search for the offset begins, and that much friction does not take the offset out of its reach."""
import math

import pytest

TURN = 2**32


def started(c, forth_deg, back_deg, ratio=0.6):
    solver = c.load_angle()
    solver.ratio_q15, solver.saliency_q15, solver.steps = round(ratio * 32768), 0, 77
    for less in (0, 1):
        solver.forward_q32[less] = round(forth_deg[less] / 360 * TURN) % TURN
        solver.back_q32[less] = round(back_deg[less] / 360 * TURN) % TURN
    c.load_angle_start(solver)
    return solver


@pytest.mark.parametrize("forth, back, centre", ((10, 0, 5), (0, 10, 5), (-170, 170, 180), (170, -170, 180), (80, -90, -5),
                                                 (350, 340, 345)))
def test_load_angle_is_searched_midway_between_both_ways(c, forth, back, centre):
    """At the larger current, the shorter way round; and 60 degrees to either side."""
    solver = started(c, (forth, 33), (back, 44))
    off = (solver.centre_q32 - round(centre / 360 * TURN) + TURN // 2) % TURN - TURN // 2
    assert abs(off) < 4 and solver.steps == 0
    assert (solver.low_q32, solver.high_q32) == (-((2**32 - 1) // 6), (2**32 - 1) // 6)


@pytest.mark.parametrize("friction, load", ((0.52, -0.05), (0.52, 0.05), (0.57, 0.0), (0.3, 0.27)))
def test_load_angle_is_within_reach_at_much_friction(c, friction, load):
    """Nearly all that the smaller current holds."""
    def lead(torque, current):
        return math.degrees(math.asin(torque / current))
    for offset_deg in (-170, 3, 91):
        solver = started(c, [offset_deg + lead(load + friction, current) for current in (1, 0.6)],
                         [offset_deg + lead(load - friction, current) for current in (1, 0.6)])
        while not c.load_angle_step(solver):
            pass
        off = (solver.centre_q32 + solver.low_q32 - round(offset_deg / 360 * TURN) + TURN // 2) % TURN - TURN // 2
        assert abs(off) / TURN * 360 < 0.2
        assert abs(c.load_angle_spread_q15(solver)) < 100, "a load and friction are all there is"


@pytest.mark.parametrize("load, saliency, least, most", ((0, 0.33, 0, 0.1), (0.3, 0, 0, 0.01), (0.1, 0.33, 0.7, 2.5),
                                                          (0.3, 0.33, 2.6, 12), (0.1, 0.1, 0, 0.7)))
def test_load_angle_tells_how_far_a_wrong_saliency_moves_the_offset(c, load, saliency, least, most):
    """Nothing without load or saliency; more than is allowed where a third of the pull is lost and much hangs on it."""
    def lead(torque, current):
        low, high = -math.pi / 3, math.pi / 3
        for _ in range(50):
            middle = (low + high) / 2
            more = current * math.sin(middle) * (1 - saliency * current * math.cos(middle)) < torque
            low, high = (middle, high) if more else (low, middle)
        return math.degrees(low)
    solver = started(c, [lead(load + 0.04, current) for current in (1, 0.6)],
                     [lead(load - 0.04, current) for current in (1, 0.6)])
    solver.saliency_q15 = round(saliency * 32768)
    while not c.load_angle_step(solver):
        pass
    assert least <= c.load_angle_uncertainty_q32(solver) * 360 / TURN <= most
