# SPDX-License-Identifier: MIT
"""A drive between on and operation: its wiring, and a start by Hall switches."""
import math

from rigs.drive import World

CALIBRATION_MS, CALIBRATE, WIRING, ALIGN, FOLLOW, CATCH, CONFIRM = 128, 0, 1, 2, 3, 6, 12


RIGHT = ((0, 1), (1, 1), (2, 1))


def show_wiring(wiring, i_q15, sensors=RIGHT, saliency=0.0, angle_deg=0.0):
    """What flows with the voltage along a phase, by the winding's admittances in its two axes: mean 1, half their difference
    `saliency`. Each of the `sensors` shows a phase's current, times a gain; the largest at most i_q15."""
    at = [2 * math.pi * k / 3 for k in range(3)]
    for along in range(3):
        for sensor, (phase, gain) in enumerate(sensors):
            flows = (math.cos(at[along] - at[phase]) +
                     saliency * math.cos(2 * math.radians(angle_deg) - at[along] - at[phase])) / (1 + saliency)
            wiring.rise_q15[along][sensor] = round(gain * flows * i_q15)


def sample(w, state):
    """A millisecond or two after the one before."""
    encoder = w.fabric.encoder
    encoder.LATCH_TIME += 150000
    if state != encoder.HALL:
        encoder.HALL_TIME = encoder.LATCH_TIME - 1000
    encoder.HALL = state
    w.c.host_hall_observe(w.axis.loop, w.axis.hall, encoder)


def switched_on(c, states=(1,), wired=True, learns=False, starts=1):
    """In its calibration; while that lasts the switches show these, one after another."""
    w = World(c, angle_source=2)
    w.fabric.encoder.HALL = states[0] if starts == 1 or states[0] in range(1, 7) else 1
    w.switch_on("drive_learn_hall" if learns else "switch_on_at_once", starts)
    w.axis.start.wired = wired
    for state in states:
        sample(w, state)
    w.step(CALIBRATION_MS)
    return w
