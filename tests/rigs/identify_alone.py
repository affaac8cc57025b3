# SPDX-License-Identifier: MIT
"""Identify by itself, on the 24 V inverter: begun, made to think, and asked what it knows."""
import ctypes
import math

I_RANGE_MA, V_RANGE_MV, RATED_MA, ONE = 23571, 57528, 3800, 32768


def begin(c):
    p, d = c.params(), c.identify()
    c.params_init(p)
    p.i_rated_ma = RATED_MA
    assert c.identify_begin(d, p).error == c.ERROR_NONE
    return d


def thought(c, d, step):
    """What the thread makes of what has been measured in a step."""
    d.step, d.evaluating = getattr(c, f"IDENTIFY_STEP_{step}"), True
    c.identify_evaluate(d)
    assert not d.evaluating
    return d


def measuring(c, d, step):
    """What a step measures with: a loop, an axis at rest and nothing of the fabric, from its first millisecond on."""
    io, parts = c.measure_io(), {"loop": c.current_loop(), "fabric": c.fabric(), "speed": c.speed_loop(), "tuning": d.tuning}
    for name, what in parts.items():
        setattr(io, name, ctypes.pointer(what))
    c.current_loop_init(io.loop)
    d.step, d.ms = getattr(c, f"IDENTIFY_STEP_{step}"), 0
    return io


def result_of(c, d, name):
    return d.results[getattr(c, f"IDENTIFY_{name}")]


def known(c, d, name):
    """(value, half width of its interval) of what must be known."""
    result = result_of(c, d, name)
    assert result.state == c.IDENTIFY_KNOWN, (name, result.state, result.reason)
    return result.value, result.interval


def reason(c, d, name):
    """Why it is refused, or None."""
    result = result_of(c, d, name)
    return result.reason if result.state == c.IDENTIFY_REFUSED else None


def amps(value):
    return round(value / (I_RANGE_MA / 1000) * ONE)


def volts(value):
    return round(value / (V_RANGE_MV / 1000) * ONE)


def rpm_q9(rad_s):
    return round(rad_s * 60 / (2 * math.pi) * 512)


def fill(run, samples):
    """The sums of (current, voltage, speed) in the firmware's units, exactly."""
    for t, (i, v, x) in enumerate(samples):
        run.count += 1
        run.i, run.v, run.x = run.i + i, run.v + v, run.x + x
        run.tx, run.xx, run.xv = run.tx + t * x, run.xx + x * x, run.xv + x * v
    return run
