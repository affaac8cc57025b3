# SPDX-License-Identifier: MIT
"""Evaluates a solver's term for many states at once: arrays of unsigned numbers, 64 bits at most; a Boolean as booleans."""
import hashlib

import numpy as np
import z3


def as_signed(values, width):
    """Two's complement of `width` bits as 64-bit integers."""
    shift = np.uint64(64 - width)
    return (values << shift).view(np.int64) >> np.int64(64 - width)


def _masked(values, width):
    return values & np.uint64((1 << width) - 1)


def _shift(kind, values, amount, width):
    amount = np.minimum(amount, np.uint64(63))
    if kind == z3.Z3_OP_BASHR:
        return (as_signed(values, width) >> amount.view(np.int64)).view(np.uint64)
    return values << amount if kind == z3.Z3_OP_BSHL else values >> amount


def _concat(terms, arrays):
    result = arrays[0]
    for term, array in zip(terms[1:], arrays[1:]):
        result = (result << np.uint64(term.size())) | array
    return result


SUMS = {z3.Z3_OP_BADD: np.add, z3.Z3_OP_BSUB: np.subtract, z3.Z3_OP_BMUL: np.multiply, z3.Z3_OP_BAND: np.bitwise_and,
        z3.Z3_OP_BOR: np.bitwise_or, z3.Z3_OP_BXOR: np.bitwise_xor, z3.Z3_OP_AND: np.logical_and, z3.Z3_OP_OR: np.logical_or,
        z3.Z3_OP_XOR: np.logical_xor}
ORDERS = {z3.Z3_OP_SLEQ: np.less_equal, z3.Z3_OP_SLT: np.less, z3.Z3_OP_SGEQ: np.greater_equal, z3.Z3_OP_SGT: np.greater}
UNSIGNED = {z3.Z3_OP_ULEQ: np.less_equal, z3.Z3_OP_ULT: np.less, z3.Z3_OP_UGEQ: np.greater_equal, z3.Z3_OP_UGT: np.greater}
SHIFTS = (z3.Z3_OP_BSHL, z3.Z3_OP_BASHR, z3.Z3_OP_BLSHR)


class States:
    """`values`: {name of a variable: array of its low bits}. A variable that is not there gets arbitrary values of its own."""

    def __init__(self, count, values):
        self.count = count
        self.values = {name: array.astype(np.int64).view(np.uint64) for name, array in values.items()}

    def define(self, variable, array):
        self.values[variable.decl().name()] = array

    def of(self, term):
        return self._of(term, {})

    def _of(self, term, known):
        found = known.get(term.get_id())
        if found is None:
            found = self._compute(term, known)
            if z3.is_bv(term):
                found = _masked(found, term.size())
            known[term.get_id()] = found
        return found

    def _variable(self, term):
        name = term.decl().name()
        if name not in self.values:
            seed = int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "little")
            self.values[name] = np.random.default_rng(seed).integers(0, 2**63, self.count).astype(np.uint64)
        values = self.values[name]
        return values & np.uint64(1) != 0 if z3.is_bool(term) else values

    def _compute(self, term, known):
        kind, children = term.decl().kind(), term.children()
        if z3.is_bv_value(term):
            return np.full(self.count, term.as_long(), dtype=np.uint64)
        if kind in (z3.Z3_OP_TRUE, z3.Z3_OP_FALSE):
            return np.full(self.count, kind == z3.Z3_OP_TRUE)
        if kind == z3.Z3_OP_UNINTERPRETED:
            return self._variable(term)
        arrays = [self._of(child, known) for child in children]
        return self._apply(term, kind, children, arrays)

    @staticmethod
    def _apply(term, kind, children, arrays):
        if kind in SUMS:
            result = arrays[0]
            for array in arrays[1:]:
                result = SUMS[kind](result, array)
            return result
        if kind in ORDERS:
            return ORDERS[kind](*(as_signed(array, child.size()) for array, child in zip(arrays, children)))
        if kind in UNSIGNED:
            return UNSIGNED[kind](*arrays)
        if kind in SHIFTS:
            return _shift(kind, *arrays, term.size())
        single = {
            z3.Z3_OP_NOT: lambda: ~arrays[0], z3.Z3_OP_BNOT: lambda: ~arrays[0],
            z3.Z3_OP_BNEG: lambda: np.uint64(0) - arrays[0],
            z3.Z3_OP_ITE: lambda: np.where(*arrays), z3.Z3_OP_EQ: lambda: arrays[0] == arrays[1],
            z3.Z3_OP_IFF: lambda: arrays[0] == arrays[1], z3.Z3_OP_IMPLIES: lambda: ~arrays[0] | arrays[1],
            z3.Z3_OP_DISTINCT: lambda: arrays[0] != arrays[1], z3.Z3_OP_CONCAT: lambda: _concat(children, arrays),
            z3.Z3_OP_EXTRACT: lambda: arrays[0] >> np.uint64(term.params()[1]), z3.Z3_OP_ZERO_EXT: lambda: arrays[0],
            z3.Z3_OP_SIGN_EXT: lambda: as_signed(arrays[0], children[0].size()).view(np.uint64),
        }
        return single[kind]()
