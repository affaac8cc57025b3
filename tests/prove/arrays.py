# SPDX-License-Identifier: MIT
"""
Two more ways to evaluate a specification: as arrays of whole numbers, one element a state (samples, and every value of an
input in turn), and as intervals that hold whatever the inputs are.
"""
from dataclasses import dataclass

import numpy as np
from arithmetic import Arithmetic, INT32_MAX, INT32_MIN, Numbers


class Words(Numbers):
    """Python's integers, with tables by name."""

    def __init__(self, tables):
        super().__init__()
        self.tables, self.found = tables, {}

    def cut(self, name, value):
        self.found[name] = value
        return value

    def bounded(self, _, value):
        return value

    def word(self, table, index):
        return self.tables[table][index]


class Arrays(Arithmetic):
    """64-bit integers, which hold the sum of two products of 32-bit ones."""

    def __init__(self, tables):
        self.tables = {name: np.array(words, dtype=np.int64) for name, words in tables.items()}
        self.found, self.sums = {}, {}

    def cut(self, name, value):
        self.found[name] = value
        return value

    def bounded(self, name, value):
        self.sums[name] = value
        return value

    def word(self, table, index):
        return self.tables[table][index]

    def select(self, condition, x, y):
        return np.where(condition, x, y)

    def both(self, *conditions):
        return np.logical_and.reduce(conditions)

    def floor(self, x, bits):
        return x >> bits

    def product(self, x, y):
        return x * y


@dataclass(frozen=True)
class Span:
    """All whole numbers from low to high. A comparison is True, False, or None: it depends."""
    low: int
    high: int

    def __add__(self, other):
        other = span(other)
        return Span(self.low + other.low, self.high + other.high)

    __radd__ = __add__

    def __neg__(self):
        return Span(-self.high, -self.low)

    def __sub__(self, other):
        return self + -span(other)

    def __rsub__(self, other):
        return span(other) - self

    def __mul__(self, other):
        other = span(other)
        corners = [x * y for x in (self.low, self.high) for y in (other.low, other.high)]
        return Span(min(corners), max(corners))

    __rmul__ = __mul__

    def __gt__(self, other):
        other = span(other)
        return True if self.low > other.high else False if self.high <= other.low else None

    def __lt__(self, other):
        return span(other) > self

    def joined(self, other):
        return Span(min(self.low, other.low), max(self.high, other.high))

    def met(self, other):
        return Span(max(self.low, other.low), min(self.high, other.high))

    @property
    def fits_32_bits(self):
        return INT32_MIN <= self.low and self.high <= INT32_MAX


def span(x):
    return Span(x, x) if isinstance(x, int) else x


class Intervals(Arithmetic):
    """`tables`: the span of each table's words. `known`: spans of cuts and bounded sums that follow otherwise."""

    def __init__(self, tables, known):
        self.tables, self.known, self.found, self.indices = tables, known, {}, {}

    def cut(self, name, value):
        value = self.bounded(name, value)
        if not value.fits_32_bits:
            raise OverflowError(f"{name} may be {value.low} or {value.high}: 32 bits do not hold it")
        self.found[name] = value
        return value

    def bounded(self, name, value):
        return span(value).met(self.known[name]) if name in self.known else span(value)

    def word(self, table, index):
        self.indices.setdefault(table, []).append(index)
        return self.tables[table]

    def select(self, condition, x, y):
        if condition is None:
            return span(x).joined(span(y))
        return span(x) if condition else span(y)

    def max(self, x, y):
        x, y = span(x), span(y)
        return Span(max(x.low, y.low), max(x.high, y.high))

    def min(self, x, y):
        return -self.max(-span(x), -span(y))

    def floor(self, x, bits):
        return Span(span(x).low >> bits, span(x).high >> bits)

    def wrap32(self, x):
        return span(x) if span(x).fits_32_bits else Span(INT32_MIN, INT32_MAX)

    def product(self, x, y):
        return span(x) * span(y)
