# SPDX-License-Identifier: MIT
"""Parameters and what the firmware computes from them: struct params, struct tuning, the shipped motors'."""
import functools
from fractions import Fraction

from launcher.drive import console_params, load_drive

PI = Fraction(314159265358979323846264338328, 10**29)
PWM_HZ, SLOW_HZ, BASE_HZ = 20000, 1000, 1250


def struct(c, values):
    """What is not told keeps its initial value."""
    params = c.params()
    c.params_init(params)
    for name, value in values.items():
        setattr(params, name, value)
    return params


def compute(c, values):
    """(error's name, value, struct tuning)."""
    tuning = c.tuning()
    outcome = c.tuning_compute(struct(c, values), tuning)
    return "ERROR_" + c.name("error", outcome.error), outcome.value, tuning


@functools.cache
def _told(motor):
    return console_params(load_drive(motor))


def shipped(motor="teknic_m2310p"):
    return dict(_told(motor))


PWM_COUNTS, V_SHIFT = 5000, 4
FULL = PWM_COUNTS * 2 ** (V_SHIFT - 1)  # steps of half a period: the bus voltage
