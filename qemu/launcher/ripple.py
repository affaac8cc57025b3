# SPDX-License-Identifier: MIT
"""What a PWM period adds to a phase current: three half bridges, centred pulses, the largest and the smallest of the phase
voltages equally far from the middle of the bus; the same inductance at all angles."""
import numpy as np

ANGLES = np.radians(np.linspace(0, 120, 25))  # the others repeat these, in other phases
INSTANTS = (np.arange(400) + 0.5) / 400       # of a period


def largest_ripple_a(bus_v, inductance_h, period_s, volts):
    """The most by which a phase current leaves its mean over the period, at phase voltages of an amplitude of `volts`."""
    unit_a = max(_ripple_a(bus_v, volts * np.cos(angle - np.radians([0, 120, 240]))) for angle in ANGLES)
    return unit_a * period_s / inductance_h


def _ripple_a(bus_v, mean_v):
    """For a second and a henry."""
    duties = 0.5 + (mean_v - (mean_v.max() + mean_v.min()) / 2) / bus_v
    on = np.abs(INSTANTS - 0.5) < duties[:, None] / 2
    phases_v = bus_v * (on - on.mean(axis=0))
    ripple = np.cumsum(phases_v - phases_v.mean(axis=1)[:, None], axis=1) / len(INSTANTS)
    return np.abs(ripple - ripple.mean(axis=1)[:, None]).max()
