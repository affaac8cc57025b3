# SPDX-License-Identifier: MIT
"""
One sample of the current loop for the encoder and two sensors, in whole numbers that nothing wraps but where it says so:
what docs and headers say, stage by stage. Each value with a name (o.cut) is one that either code is expected to hold in a
register; o.bounded names a sum of which more is known than its terms tell (lemmas.py).
"""
from specs import beta_q15, held, limited

SIN60_Q15, SIN60_Q13 = 28378, 7094


def sense(o, v):
    total = o.cut("total", v.IA + 2 * v.IB)
    return v.IA, o.cut("beta", beta_q15(o, total))


def chord(o, name, word, place):
    """A word is start * 4096 + slope, its slope a signed 12 bits; `place` is one less than the part of 4096."""
    slope = o.cut(f"{name}_slope", word - 4096 * o.round(word, 12))
    along = o.cut(f"{name}_q30", word + o.product(slope, place))
    return o.cut(name, o.floor(along, 15))


def trigonometry(o, angle):
    """Sine and cosine of an angle of 32 bits, signed."""
    number = o.floor(angle, 22)
    index = o.cut("chord", o.select(number < 0, number + 1024, number))
    place = o.cut("place", o.floor(angle, 10) - 4096 * number - 1)
    sine, cosine = o.cut("sine_word", o.word("chords", index)), o.cut("cosine_word", o.word("chords", index + 256))
    return chord(o, "sin", sine, place), chord(o, "cos", cosine, place)


def park(o, alpha, beta, sin, cos):
    along = o.bounded("along", o.product(alpha, cos) + o.product(beta, sin))
    across = o.bounded("across", o.product(beta, cos) - o.product(alpha, sin))
    return o.cut("i_d_q15", o.round(along, 15)), o.cut("i_q_q15", o.round(across, 15))


def wanted(o, axis, kp, error, integral):
    total = o.cut(f"pi_{axis}", o.product(kp, error) + integral)
    return o.cut(f"wanted_{axis}", o.clamp(o.floor(total, 9), -32768, 32767))


def advance(o, name, x, y, turn):
    x = o.cut(f"{name}_x", x - o.floor(o.product(turn, y), 15))
    return x, o.cut(f"{name}_y", y + o.floor(o.product(turn, x), 15))


def integrated(o, axis, integral, step):
    return o.cut(f"integral_{axis}_q9", integral + o.floor(step, 6))


def regulate(o, k, v, i_d, i_q):
    error_d, error_q = o.cut("error_d", v.i_d_ref_q15 - i_d), o.cut("error_q", v.i_q_ref_q15 - i_q)
    d = wanted(o, "d", v.kp_d_q9, error_d, v.integral_d_q9)
    q = wanted(o, "q", v.kp_q_q9, error_q, v.integral_q_q9)
    d, q = advance(o, "voltage", d, q, v.turn_q15)
    v_d = o.cut("v_d_steps", o.clamp(d, -(1 << k.v_d_bits - 1), (1 << k.v_d_bits - 1) - 1))
    step_d, step_q = o.cut("step_d", o.product(v.ki_q15, error_d)), o.cut("step_q", o.product(v.ki_q15, error_q))
    integrated(o, "d", v.integral_d_q9, o.cut("held_d", held(o, step_d, d, v_d)))
    place = o.cut("circle_place", o.floor(v_d, k.circle_shift) + (1 << k.circle_bits - 1))
    rest = o.cut("circle_rest", o.word("circle", place))
    v_q, step_q = limited(o, q, step_q, rest)
    integrated(o, "q", v.integral_q_q9, o.cut("held_q", step_q))
    return v_d, o.cut("v_q_steps", v_q)


def phases(o, k, v_d, v_q, sin, cos):
    """Half of the on-times, and the compare at zero voltage, with k.compare_shift fraction bits."""
    a = o.cut("a", o.bounded("a", o.product(v_d, cos) - o.product(v_q, sin)))
    beta = o.cut("b_beta", o.bounded("b_beta", o.product(v_q, cos) + o.product(v_d, sin)))
    return modulated(o, k, a, o.cut("beta_steps", o.floor(beta, 15)))


def modulated(o, k, a, beta_steps):
    b = o.cut("b", o.product(beta_steps, SIN60_Q15) - o.floor(a, 1))
    minus_c = o.cut("minus_c", o.bounded("minus_c", a + b))
    for name, difference in (("a_less_b", a - b), ("a_less_c", a + minus_c), ("b_less_c", b + minus_c)):
        o.bounded(name, difference)
    base = o.cut("base", k.half - middle(o, a, b, minus_c))
    return o.cut("half_a", base + a), o.cut("half_b", base + b), o.cut("half_c", base - minus_c)


def middle(o, a, b, minus_c):
    """Half of the sum of largest and smallest, which is minus half of the one between (lemmas.py proves that it is)."""
    upper = o.cut("upper", o.max(a, b))
    minus_lower = o.cut("minus_lower", upper - minus_c)
    above = o.select(minus_c > minus_lower, o.floor(minus_lower, 1), o.floor(minus_c, 1))
    return o.select(minus_c < -upper, -o.floor(upper, 1), above)


def shares(o, alpha, beta, turn):
    """Of the dead time, for the currents when the voltages act; that of c for the current turned round."""
    alpha, beta = advance(o, "current", alpha, beta, turn)
    i_b = o.cut("i_b", o.product(beta, SIN60_Q13) - 4096 * alpha)
    minus_i_c = o.cut("minus_i_c", i_b + 8192 * alpha)
    return [o.cut(f"share_{name}", o.clamp(o.floor(current, bits), -128, 127))
            for name, current, bits in (("a", alpha, 2), ("b", i_b, 15), ("c", minus_i_c, 15))]


def compares(o, k, halves, parts):
    for name, half, part in zip("ABC", halves, parts):
        dead = o.product(part, -k.dead if name == "C" else k.dead)
        on = o.cut(f"on_{name.lower()}", half + dead)
        o.cut(f"COMPARE_{name}", o.floor(on, k.compare_shift))


def observe(o, k, v):
    """Angles and speeds are fractions of turns in 32 bits: they wrap by intent."""
    measured = o.cut("measured", o.wrap32(o.product(v.LATCHED, v.encoder_scale_q32)))
    error = o.cut("angle_error", o.wrap32(measured - v.angle_q32))
    speed = o.cut("speed_q32", o.wrap32(v.speed_q32 + o.floor(error, k.ki_shift)))
    nearer = o.cut("angle_nearer", o.wrap32(v.angle_q32 + o.floor(error, k.kp_shift)))
    o.cut("angle_q32", o.wrap32(nearer + speed))


def sample(o, k, v):
    alpha, beta = sense(o, v)
    angle = o.cut("field_angle", o.wrap32(v.angle_q32 + v.angle_offset_q32))
    sin, cos = trigonometry(o, angle)
    v_d, v_q = regulate(o, k, v, *park(o, alpha, beta, sin, cos))
    compares(o, k, phases(o, k, v_d, v_q, sin, cos), shares(o, alpha, beta, v.turn_q15))
    observe(o, k, v)
