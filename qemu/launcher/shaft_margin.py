# SPDX-License-Identifier: MIT
"""What a coupling leaves of a speed loop's margin: a proportional gain for the whole inertia, once a millisecond, on a rotor
whose load hangs on a spring. Above the frequency at which the load stays where it is, the rotor alone answers, faster by the
ratio of inertias. Exact between the samples, so that a resonance above half the rate is folded as the loop sees it."""
import math

import numpy as np

SLOW_S = 1e-3  # the loop's period; its speed is the way of one
LATE_S = 0.25e-3  # from the encoder's sample to the torque: 60 us of the slow loop (make run), and 1 / (2 pi 1 kHz)
MARGIN = 2.0   # of gain, as the drive leaves itself where it lowers its own: 6 dB
FILTERED_HZ = 100.0  # from which on it can filter a coupling: NOTCH_C_MOST_Q13 of firmware/control/notch.h
OCTAVES, HALVINGS = 10, 14  # in which a bandwidth is looked for, to a thousandth


def swings_up(speed_bw_hz, rotor_kgm2, load_kgm2, stiffness_nm_rad, damping_nms):
    """Whether the loop of `speed_bw_hz` and MARGIN times its gain is not stable."""
    shaft = np.array([  # angle, speed and load's speed, twist; torque
        [0, 1, 0, 0, 0],
        [0, -damping_nms / rotor_kgm2, damping_nms / rotor_kgm2, -stiffness_nm_rad / rotor_kgm2, 1 / rotor_kgm2],
        [0, damping_nms / load_kgm2, -damping_nms / load_kgm2, stiffness_nm_rad / load_kgm2, 0],
        [0, 1, -1, 0, 0],
        [0, 0, 0, 0, 0]])
    gain_nm_rad = MARGIN * 2 * math.pi * speed_bw_hz * (rotor_kgm2 + load_kgm2) / SLOW_S
    late, rest = _after(shaft, LATE_S), _after(shaft, SLOW_S - LATE_S)
    asked = np.array([-gain_nm_rad, 0, 0, 0, gain_nm_rad, 0])  # of the state, the angle a period ago, the torque until now
    loop = np.zeros((6, 6))
    loop[:4, :4] = rest[:4, :4] @ late[:4, :4]
    loop[:4, 5] = rest[:4, :4] @ late[:4, 4]
    loop[:4] += np.outer(rest[:4, 4], asked)
    loop[4, 0] = 1
    loop[5] = asked
    return bool(np.abs(np.linalg.eigvals(loop)).max() > 1 + 1e-6)  # one is 1: the angle, which nothing holds


def left_hz(speed_bw_hz, rotor_kgm2, load_kgm2, stiffness_nm_rad, damping_nms):
    """What a coupling too soft to be filtered leaves of a speed loop's bandwidth, with MARGIN: no gain that sees the
    rotor alone has more. Other couplings leave all of it."""
    reduced_kgm2 = rotor_kgm2 * load_kgm2 / (rotor_kgm2 + load_kgm2)
    shaft = (rotor_kgm2, load_kgm2, stiffness_nm_rad, damping_nms)
    if math.sqrt(stiffness_nm_rad / reduced_kgm2) > 2 * math.pi * FILTERED_HZ or not swings_up(speed_bw_hz, *shaft):
        return speed_bw_hz
    low_hz, high_hz = speed_bw_hz / 2 ** OCTAVES, speed_bw_hz
    for _ in range(HALVINGS):
        middle_hz = math.sqrt(low_hz * high_hz)
        low_hz, high_hz = (low_hz, middle_hz) if swings_up(middle_hz, *shaft) else (middle_hz, high_hz)
    return low_hz


def _after(shaft, time_s):
    """exp(shaft t), by halving the time until a series of few terms is enough."""
    halvings = max(0, math.ceil(math.log2(np.abs(shaft).max() * time_s)) + 6)
    part, term, total = shaft * (time_s / 2 ** halvings), np.eye(5), np.eye(5)
    for n in range(1, 12):
        term = term @ part / n
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total
