# SPDX-License-Identifier: MIT
"""
The table of kernels: what each shall compute, written from the contracts in the headers, in whole numbers (arithmetic.py).
To add one: a function in kernels.c if it is inline, a specification and an entry here.
"""
from fractions import Fraction
from itertools import permutations

from kernel import Kernel, Pointer, Table, Value

TRIG_FRACS = (1, 15, 16, 30, 31)
FACTORS = (-(2**31), -(2**31) + 1, -65536, -32768, -3, -1, 0, 1, 2, 32767, 32768, 2**30, 2**31 - 1)
Q15_TRIG = (-32768, -32767, -1, 0, 1, 3, 16384, 32767, 32768)


# ---- 32-bit library -----------------------------------------------------------------------------------------------------
def park(o, v, x, y):
    """Seen from a frame turned by the angle; the exact sums, rounded to nearest, ties up, saturated."""
    along = o.product(x, v.cos) + o.product(y, v.sin)
    across = o.product(y, v.cos) - o.product(x, v.sin)
    return o.sat32(o.round(along, v.frac)), o.sat32(o.round(across, v.frac))


def park_lib(o, v):
    return dict(zip(("id", "iq"), park(o, v, v.ialpha, v.ibeta)))


def invpark_lib(o, v):
    # the same with the angle turned round, which is to swap the two axes
    return dict(zip(("vbeta", "valpha"), park(o, v, v.vq, v.vd)))


# 2/sqrt(3) - 1 and sqrt(3)/2 - 1, 32 fraction bits
CLARKE_Q32 = 664433753
INVCLARKE_Q32 = -575416509


def times_q32(o, x, constant, down):
    """x constant / 2^32 to nearest, or rounded down."""
    exact = o.product(x, constant)
    return o.select(down, o.floor(exact, 32), o.round(exact, 32))


def clarke_lib(o, v):
    """(ia + 2 ib) / sqrt(3) = h 2/sqrt(3) + 0.577 (ia odd) with h = ib + ia/2 rounded down; 0.577 is made up by rounding up."""
    half = o.sat32(v.ib + o.floor(v.ia, 1))
    exact = o.product(half, CLARKE_Q32)
    up = o.select(o.odd(v.ia), o.floor(exact, 32) + 1, o.round(exact, 32))
    return {"ialpha": v.ia, "ibeta": o.sat32(half + up)}


def invclarke_lib(o, v):
    beta = v.vbeta + times_q32(o, v.vbeta, INVCLARKE_Q32, o.odd(v.valpha))
    return {"va": v.valpha, "vb": o.sat32(beta - o.floor(v.valpha, 1)), "vc": o.sat32(-beta - o.ceil(v.valpha, 1))}


# ---- Q15 ----------------------------------------------------------------------------------------------------------------
# With |(x, y)| |(cos, sin)| < 2^31 - 16384, no sum of the products reaches it (Cauchy, Schwarz).
Q15_SUM = 2**31 - 16384 - 1
Q15_SUM_TEXT = "|sums of products| < 2^31 - 16384"


def q15_sums(o, v, x, y):
    return o.product(x, v.cos) + o.product(y, v.sin), o.product(y, v.cos) - o.product(x, v.sin)


def q15_in_range(o, v, x, y):
    along, across = q15_sums(o, v, x, y)
    return o.both(o.within(along, -Q15_SUM, Q15_SUM), o.within(across, -Q15_SUM, Q15_SUM))


def park_q15(o, v):
    along, across = q15_sums(o, v, v.alpha, v.beta)
    return {"d": o.round(along, 15), "q": o.round(across, 15)}


def beta_q15(o, total, sign=1):
    """
    total / sqrt(3) = (total + total 20277 / 2^17) / 2, the parts rounded down and to nearest. `sign` of both factors of the
    product: the compiler's choice, so that the solver need not find out.
    """
    return o.round(total + o.floor(o.product(sign * total, sign * 20277), 17), 1)


def clarke_q15(o, v):
    return {"alpha": v.a, "beta": beta_q15(o, v.a + 2 * v.b)}


def clarke3_q15(o, v):
    total = v.a + v.b + v.c
    third = o.product(total, 10923) - o.floor(total, 2) - o.floor(total, 4)
    return {"alpha": v.a - o.round(third, 15), "beta": beta_q15(o, v.b - v.c)}


def clarke_bc_q15(o, v):
    return {"alpha": -v.b - v.c, "beta": beta_q15(o, v.b - v.c)}


def clarke_ca_q15(o, v):
    return {"alpha": v.a, "beta": beta_q15(o, -v.a - 2 * v.c, -1)}


def invclarke_q15(o, v):
    """sqrt(3)/2 = (28378 - 1/16) / 2^15."""
    b = o.round(o.product(v.beta, 28378) - o.floor(v.beta, 4) - 16384 * v.alpha, 15)
    return {"a": v.alpha, "b": b, "c": -v.alpha - b}


def cossin_q15(o, v):
    """The chord of the first 10 bits at the 12 bits after them; a word is start * 4096 + slope, its slope a signed 12 bits."""
    index, part = o.floor(v.angle, 22), o.floor(v.angle, 10) - 4096 * o.floor(v.angle, 22)

    def chord(word):
        start = 4096 * o.round(word, 12)
        slope = word - start
        return o.floor(start + slope + o.product(slope, part - 1), 15)  # start + slope * part
    return {"cos": chord(o.table(index + 256)), "sin": chord(o.table(index))}


def invpark_q15(o, v):
    along, across = q15_sums(o, v, v.q, v.d)
    return {"beta": o.round(along, 15), "alpha": o.round(across, 15)}


# ---- control ------------------------------------------------------------------------------------------------------------
PI_KP, PI_KI, PI_ERROR, PI_LIMIT, PI_INTEGRAL = 16384, 21845, 98303, 32766, 2**29


def within_product(o, x, y, largest):
    """A fact about every product of factors in range, of which the solver knows the range alone."""
    return o.within(o.product(x, y), -largest, largest)


def held(o, step, wanted, output):
    """The step, but for the part that leads further than the limit."""
    return o.select(wanted > output, o.min(step, 0), o.select(wanted < output, o.max(step, 0), step))


def limited(o, wanted, step, limit):
    output = o.clamp(wanted, -limit, limit)
    return output, held(o, step, wanted, output)


def pi_hold(o, v):
    return {"held": held(o, v.step, v.wanted, v.output)}


def pi_saturate(o, v):
    return dict(zip(("output", "step"), limited(o, v.output, v.step, v.limit)))


def pi_step(o, v):
    """Not saturated to 16 bits: no limit reaches these."""
    wanted = o.floor(o.product(v.kp, v.error) + v.integral, 9)
    output, step = limited(o, wanted, o.product(v.ki, v.error), v.limit)
    return {"output": output, "integral": v.integral + o.floor(step, 6)}


def pi_in_range(o, v):
    return o.both(within_product(o, v.kp, v.error, PI_KP * PI_ERROR), within_product(o, v.ki, v.error, PI_KI * PI_ERROR))


def extremes(o, a, b, c):
    return o.max(o.max(a, b), c), o.min(o.min(a, b), c)


def svm_half(o, v):
    """(max + min) / 2 of a, b and c = -a - b, rounded down; up where c is larger than both others."""
    c = -v.a - v.b
    largest, smallest = extremes(o, v.a, v.b, c)
    total = largest + smallest
    return o.select(c > o.max(v.a, v.b), o.ceil(total, 1), o.floor(total, 1)), c


def svm_middle(o, v):
    return {"middle": svm_half(o, v)[0]}


def orders(o, x, y, z):
    """The six orders that three values can have."""
    return [o.both(a >= b, b >= c) for a, b, c in permutations((x, y, z))]


def sum_within(end):
    return lambda o, v: o.within(v.a + v.b, -end, end)


def struct(name, *fields):
    return Pointer(name, fields)


def state(name, fields, written):
    """A struct that is read and of which some fields are written."""
    return Pointer(name, fields, written, written)


def output(*fields):
    return Pointer("out", fields, fields)


LIB = [
    Kernel("Clarke_Lib_Do", (struct("in", "ia", "ib", "ic"), output("ialpha", "ibeta")), clarke_lib, overlap=True,
           bounds=(("ibeta", lambda o, v: o.over_sqrt3(v.ia + 2 * v.ib), Fraction(583, 1000)),)),
    Kernel("InvClarke_Lib_Do", (struct("in", "valpha", "vbeta"), output("va", "vb", "vc")), invclarke_lib, overlap=True,
           pins={"vbeta": FACTORS},
           bounds=(("vb", lambda o, v: o.half_sqrt3(v.vbeta) - o.ratio(v.valpha, 2), Fraction(621, 1000)),
                   ("vc", lambda o, v: -o.half_sqrt3(v.vbeta) - o.ratio(v.valpha, 2), Fraction(621, 1000)))),
    Kernel("Park_Lib_Do", (struct("in", "ialpha", "ibeta", "cos", "sin"), output("id", "iq")), park_lib, TRIG_FRACS,
           overlap=True, pins={"cos": FACTORS, "sin": FACTORS}),
    Kernel("InvPark_Lib_Do", (struct("in", "vd", "vq", "cos", "sin"), output("valpha", "vbeta")), invpark_lib, TRIG_FRACS,
           overlap=True, pins={"cos": FACTORS, "sin": FACTORS}),
]

VECTOR = (-65534, 65534)
COSSIN = (-32768, 32768)
# |28378 beta - 16384 alpha| <= 32768.07 |(alpha, beta)|
INVCLARKE_SUM = 2147422700
INVCLARKE_TEXT = "|28378 beta - 16384 alpha| <= 2147422700, as |(alpha, beta)| <= 65534 makes it"
PHASE = (-32768, 32768)
TRIG_TABLE = Table("trig_chords", 1280, -(2**30) - 2**16, 2**30 + 2**16)
ANGLES = (0, 1 << 10, 1 << 22, 2**30 - 1, 2**30 + (3 << 10), 2**31 - 1024, 2**32 - 1, 0x12345678, 0xC00FFC00)
Q15 = [
    Kernel("prove_clarke", (output("alpha", "beta"), Value("a"), Value("b")), clarke_q15, ranges={"a": PHASE, "b": PHASE},
           bounds=(("beta", lambda o, v: o.over_sqrt3(v.a + 2 * v.b), Fraction(535, 1000)),)),
    Kernel("prove_clarke3", (output("alpha", "beta"), Value("a"), Value("b"), Value("c")), clarke3_q15,
           ranges={"a": PHASE, "b": PHASE, "c": PHASE}, pins={"b": Q15_TRIG, "c": Q15_TRIG[1:] + Q15_TRIG[:1]},
           bounds=(("alpha", lambda o, v: o.ratio(2 * v.a - v.b - v.c, 3), Fraction(564, 1000)),
                   ("beta", lambda o, v: o.over_sqrt3(v.b - v.c), Fraction(535, 1000)))),
    Kernel("prove_clarke_bc", (output("alpha", "beta"), Value("b"), Value("c")), clarke_bc_q15,
           ranges={"b": PHASE, "c": PHASE}, bounds=(("beta", lambda o, v: o.over_sqrt3(v.b - v.c), Fraction(535, 1000)),)),
    Kernel("prove_clarke_ca", (output("alpha", "beta"), Value("c"), Value("a")), clarke_ca_q15,
           ranges={"a": PHASE, "c": PHASE}, bounds=(("beta", lambda o, v: o.over_sqrt3(-v.a - 2 * v.c), Fraction(535, 1000)),)),
    Kernel("prove_invclarke", (output("a", "b", "c"), Value("alpha"), Value("beta")), invclarke_q15,
           ranges={"alpha": VECTOR, "beta": VECTOR}, assumption=INVCLARKE_TEXT,
           assume=lambda o, v: o.within(o.product(v.beta, 28378) - 16384 * v.alpha, -INVCLARKE_SUM, INVCLARKE_SUM),
           bounds=(("b", lambda o, v: o.half_sqrt3(v.beta) - o.ratio(v.alpha, 2), Fraction(535, 1000)),
                   ("c", lambda o, v: -o.half_sqrt3(v.beta) - o.ratio(v.alpha, 2), Fraction(535, 1000)))),
    Kernel("prove_cossin", (output("cos", "sin"), Value("angle")), cossin_q15, ranges={"angle": (0, 2**32 - 1)},
           table=TRIG_TABLE, assumption="words of the table within +-(2^30 + 2^16), checked", pins={"angle": ANGLES}),
    Kernel("prove_park", (output("d", "q"), Value("alpha"), Value("beta"), Value("cos"), Value("sin")), park_q15,
           ranges={"alpha": VECTOR, "beta": VECTOR, "cos": COSSIN, "sin": COSSIN}, assumption=Q15_SUM_TEXT,
           assume=lambda o, v: q15_in_range(o, v, v.alpha, v.beta), pins={"cos": Q15_TRIG, "sin": Q15_TRIG}),
    Kernel("prove_invpark", (output("alpha", "beta"), Value("d"), Value("q"), Value("cos"), Value("sin")), invpark_q15,
           ranges={"d": VECTOR, "q": VECTOR, "cos": COSSIN, "sin": COSSIN}, assumption=Q15_SUM_TEXT,
           assume=lambda o, v: q15_in_range(o, v, v.q, v.d), pins={"cos": Q15_TRIG, "sin": Q15_TRIG}),
]

PI_STATE = state("pi", ("kp", "ki", "integral"), ("integral",))
PI_RANGES = {"kp": (0, PI_KP), "ki": (0, PI_KI), "integral": (-PI_INTEGRAL, PI_INTEGRAL), "error": (-PI_ERROR, PI_ERROR),
             "limit": (0, PI_LIMIT)}
PI_TEXT = f"|kp error| <= {PI_KP} {PI_ERROR} and |ki error| <= {PI_KI} {PI_ERROR}, as their ranges make it"
PI_ERRORS = (-PI_ERROR, PI_ERROR, -1, 1, 0, 32767, -20000)
CONTROL = [
    Kernel("prove_pi_step", (PI_STATE, Value("error"), Value("limit")), pi_step, ranges=PI_RANGES, result="output",
           assume=pi_in_range, assumption=PI_TEXT,
           pins={"error": PI_ERRORS, "kp": (PI_KP, 1, 512, 0, 300, PI_KP - 1, 3), "ki": (1, PI_KI, 64, 5000, PI_KI, 0, 777)}),
    Kernel("prove_pi_hold", (Value("step"), Value("wanted"), Value("output")), pi_hold, result="held"),
    Kernel("prove_pi_saturate", (state("limited", ("output", "step"), ("output", "step")), Value("limit")), pi_saturate,
           ranges={"limit": (0, 2**31 - 1)}),
    Kernel("prove_svm_middle", (Value("a"), Value("b")), svm_middle, result="middle", assume=sum_within(2**30 - 1),
           ranges={"a": (1 - 2**30, 2**30 - 1), "b": (1 - 2**30, 2**30 - 1)}, assumption="|a + b| < 2^30",
           cases=lambda o, v: orders(o, v.a, v.b, -v.a - v.b)),
]

KERNELS = LIB + Q15 + CONTROL
