# SPDX-License-Identifier: MIT
"""A winding on the inverter that identify plays its currents into."""
import math
import random

from rigs.identify_alone import I_RANGE_MA, ONE, V_RANGE_MV, known, thought

BUS_STEPS, RATE_HZ = 40000, 20000  # of the build at 20 kHz
VBUS_Q15 = 13670
LAG, LENGTH = 2, 12


def play(c, d, sums, l_h, r_ohm, v_steps, hold=1, noise=0.0, stands_a=0.0, drift_v=0.0, seed=1):
    """A burst into a winding, exactly: its samples in codes of 12 bits."""
    b, rng = d.burst, random.Random(seed)
    b.hold, b.v_steps = hold, v_steps
    volts = v_steps / BUS_STEPS * VBUS_Q15 / ONE * V_RANGE_MV / 1000
    decay, amps = math.exp(-r_ohm / l_h / RATE_HZ), 0.0
    seen = []
    for k in range(-LAG, LENGTH + 1):
        codes = (amps + stands_a) / (I_RANGE_MA / 1000) * 2048 + rng.gauss(0, noise)
        seen.append(16 * math.floor(codes + 0.5))
        u = (c.burst_sign(b, k) * volts if 0 <= k < LENGTH else 0.0) + drift_v
        amps = decay * amps + (1 - decay) / r_ohm * u
    for k, code in enumerate(seen):
        b.i_d_q15[k] = code
    c.burst_add(sums, b, VBUS_Q15)


def inductances(c, d, l_h, r_ohm, **wave):
    for axis in (0, 1):
        for half in (0, 1):
            for n in range(32):
                play(c, d, d.work.inductance.sums[axis][half], l_h * (1 + axis), r_ohm, seed=n + 100 * half, **wave)
    d.results[c.IDENTIFY_RESISTANCE].state, d.results[c.IDENTIFY_RESISTANCE].value = c.IDENTIFY_KNOWN, round(r_ohm * 1e6)
    thought(c, d, "INDUCTANCE")
    return [known(c, d, name) for name in ("LD", "LQ")]
