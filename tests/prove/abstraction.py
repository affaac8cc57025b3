# SPDX-License-Identifier: MIT
"""What is known of products and of tables without computing them: enough to prove with, and much quicker."""
import z3
from terms import always_equal, short_name


class Products:
    """
    Signed 32 x 32 -> 64 bit products, each a fresh 64-bit variable. Of two variables only the range of such a product is
    known, and that equal factors give equal products: what is proved with that holds for all values in range, so in
    particular for the true ones. With a constant factor, `definitions` say the value, and `facts` that it lies between the
    products with the next powers of two, which is often enough and much quicker.
    """
    LOWEST, HIGHEST = -(2**62) + 2**31, 2**62
    SMALL = 12, 17  # factors within +-2^n have a product within +-2^(2n)

    def __init__(self):
        self.known = []  # (a, b, product)
        self.facts, self.definitions = [], []

    def __call__(self, a, b):
        a, b = z3.simplify(a), z3.simplify(b)
        if z3.is_bv_value(a):
            a, b = b, a
        for x, y, product in self.known:
            if (always_equal(a, x) and always_equal(b, y)) or (always_equal(a, y) and always_equal(b, x)):
                return product
        exact = z3.SignExt(32, a) * z3.SignExt(32, b)
        if z3.is_bv_value(a):
            return z3.simplify(exact)
        product = z3.BitVec(f"product {short_name(a)} {short_name(b)}", 64)
        if z3.is_bv_value(b):
            self.definitions.append(product == exact)
            self.facts.append(self._between(z3.SignExt(32, a), b.as_signed_long(), product))
        else:
            self._abstract(a, b, product)
        self.known.append((a, b, product))
        return product

    @staticmethod
    def _between(x, constant, product):
        """x 2^n <= x |constant| <= x 2^(n+1), or reversed."""
        power = max(abs(constant).bit_length() - 1, 0)
        small, large = x * (1 << power), x * (1 << (power + 1))
        product = product if constant >= 0 else -product
        if constant == 0:
            return product == 0
        return z3.If(x >= 0, z3.And(small <= product, product <= large), z3.And(large <= product, product <= small))

    def _abstract(self, a, b, product):
        self.facts += [product >= self.LOWEST, product <= self.HIGHEST]
        for bits in self.SMALL:
            small = [z3.And(x >= -(1 << bits), x <= 1 << bits) for x in (a, b)]
            self.facts.append(z3.Implies(z3.And(*small), z3.And(product >= -(1 << 2 * bits), product <= 1 << 2 * bits)))
        for x, y, other in self.known:
            same = z3.Or(z3.And(a == x, b == y), z3.And(a == y, b == x))
            self.facts.append(z3.Implies(same, product == other))


class Lookups:
    """Words of a constant table: for each index a fresh variable, of which a range is known; equal ones for equal indices."""

    def __init__(self, lowest, highest):
        self.range = lowest, highest
        self.known = []  # (index, word)
        self.facts = []

    def __call__(self, index):
        index = z3.simplify(index)
        for other, found in self.known:
            if index.eq(other):
                return found
        found = z3.BitVec(f"word {short_name(index)}", 32)
        self.facts += [found >= self.range[0], found <= self.range[1]]
        self.facts += [z3.Implies(index == other, found == word_there) for other, word_there in self.known]
        self.known.append((index, found))
        return found
