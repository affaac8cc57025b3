# SPDX-License-Identifier: MIT
"""
Three ways to evaluate a specification, which is written once in whole numbers: as Python integers (a counter-example is
re-checked with these), as z3 bit-vectors too wide to overflow (compared with the instructions), and as z3 integers (for
bounds of error). A specification uses + - and constant factors, and the functions here for everything else.
"""
import operator
from fractions import Fraction
from functools import reduce
from math import isqrt

import z3

INT32_MIN, INT32_MAX = -(2**31), 2**31 - 1
WIDTH = 72  # sums of two 64-bit products and more
ENCLOSURE = 200  # fraction bits


class Arithmetic:
    def max(self, x, y):
        return self.select(x > y, x, y)

    def min(self, x, y):
        return self.select(x < y, x, y)

    def clamp(self, x, low, high):
        return self.min(self.max(x, low), high)

    def sat32(self, x):
        return self.clamp(x, INT32_MIN, INT32_MAX)

    def ceil(self, x, bits):
        return -self.floor(-x, bits)

    def round(self, x, bits):
        """x / 2^bits to nearest, a tie up."""
        return self.floor(x + (1 << (bits - 1)), bits)

    def within(self, x, low, high):
        return self.both(x >= low, x <= high)

    def wrap32(self, x):
        """x plus a multiple of 2^32, in INT32_MIN...INT32_MAX."""
        return x - 2**32 * self.floor(x + 2**31, 32)

    def odd(self, x):
        return x - 2 * self.floor(x, 1) == 1


class Numbers(Arithmetic):
    def __init__(self, table=None):
        self.table = table  # index -> signed word of the kernel's table

    def select(self, condition, x, y):
        return x if condition else y

    def both(self, *conditions):
        return all(conditions)

    def floor(self, x, bits):
        return x >> bits

    def product(self, x, y):
        return x * y


def _low_word(x):
    """The low 32 bits of a term, sums and products taken apart: so that equal sums become equal terms."""
    if x.decl().kind() in (z3.Z3_OP_BADD, z3.Z3_OP_BSUB, z3.Z3_OP_BMUL, z3.Z3_OP_BNEG):
        first, *others = [_low_word(child) for child in x.children()]
        operation = {z3.Z3_OP_BADD: operator.add, z3.Z3_OP_BSUB: operator.sub, z3.Z3_OP_BMUL: operator.mul}
        return reduce(operation[x.decl().kind()], others, first) if others else -first
    return z3.Extract(31, 0, x)


class Bits(Arithmetic):
    """Values are WIDTH bits wide, signed. `products` is the one the machine uses, so that equal factors mean equal results."""

    def __init__(self, products, table=None):
        self.products, self.table_words = products, table
        self.obligations = []

    @staticmethod
    def value(term, signed=True):
        return (z3.SignExt if signed else z3.ZeroExt)(WIDTH - term.size(), term)

    def table(self, index):
        return self.value(self.table_words(z3.Extract(31, 0, index)))

    def select(self, condition, x, y):
        def wide(v):
            return z3.BitVecVal(v, WIDTH) if isinstance(v, int) else v
        return z3.If(condition, wide(x), wide(y))

    def both(self, *conditions):
        return z3.And(*conditions)

    def floor(self, x, bits):
        return x >> bits

    def wrap32(self, x):
        return self.value(z3.simplify(_low_word(x)))

    def _low(self, x):
        if isinstance(x, int):
            return z3.BitVecVal(x, 32)
        low = z3.simplify(z3.Extract(31, 0, x))
        self.obligations.append(("a factor of the specification fits 32 bits", self.value(low) == x))
        return low

    def product(self, x, y):
        return self.value(self.products(self._low(x), self._low(y)))


class Integers(Arithmetic):
    """Unbounded: no product of two variables, no table."""

    def __init__(self):
        self.facts = []

    def select(self, condition, x, y):
        return z3.If(condition, x, y)

    def both(self, *conditions):
        return z3.And(*conditions)

    def floor(self, x, bits):
        quotient = z3.FreshInt("q")
        self.facts += [quotient * 2**bits <= x, x < quotient * 2**bits + 2**bits]
        return quotient

    def product(self, x, y):
        return x * y

    def times(self, x, low, high):
        """A real number that is x times a constant known to lie in low...high."""
        result, x = z3.FreshReal("t"), z3.ToReal(x)
        small, large = (z3.RealVal(str(Fraction(v))) for v in (low, high))
        self.facts.append(z3.If(x >= 0, z3.And(small * x <= result, result <= large * x),
                                z3.And(large * x <= result, result <= small * x)))
        return result

    def over_sqrt3(self, x):
        root = isqrt((1 << 2 * ENCLOSURE) // 3)
        return self.times(x, Fraction(root, 1 << ENCLOSURE), Fraction(root + 1, 1 << ENCLOSURE))

    def half_sqrt3(self, x):
        root = isqrt(3 << 2 * ENCLOSURE)
        return self.times(x, Fraction(root, 2 << ENCLOSURE), Fraction(root + 1, 2 << ENCLOSURE))

    def ratio(self, x, divisor):
        return z3.ToReal(x) / divisor
