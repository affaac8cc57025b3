# SPDX-License-Identifier: MIT
"""The current loop by swept sine: what a run shows, and what a D(z) / (z - 1) would; z is the time between two samples."""
import cmath
import math

import numpy as np


def seen(result):
    """{axis: (phase margin in degrees, Hz at which the closed loop lags by 90)} of a run of current_sweep without a fault."""
    assert result.figures["faults"].value == "NONE"
    value = {name: figure.value for name, figure in result.figures.items()}
    return {axis: (value[f"phase margin of i_{axis}"], value[f"bandwidth of i_{axis}, -90 degrees"]) for axis in "qd"}


def derived(delay, current_bw_hz, sample_hz):
    """The same of the loop whose D is delay(1 / z)."""
    a = 2 * math.pi * current_bw_hz / sample_hz
    hz = np.linspace(1, sample_hz / 2, 200000)
    z = np.exp(2j * math.pi * hz / sample_hz)
    loop = a * delay(1 / z) / (z - 1)
    crossover = np.flatnonzero(np.abs(loop) < 1)[0]
    closed = np.unwrap(np.angle(loop / (1 + loop)))
    return 180 + math.degrees(cmath.phase(loop[crossover])), hz[np.flatnonzero(closed < -math.pi / 2)[0]]
