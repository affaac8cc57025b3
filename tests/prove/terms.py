# SPDX-License-Identifier: MIT
"""Terms over z3 bit-vectors, as everything here that computes with registers needs them."""
import hashlib

import z3

SP, LR, PC = 13, 14, 15


class Misbehaviour(Exception):
    """The code does what no kernel may do: a branch, a store outside its output, a register not restored."""


def word(value):
    return z3.BitVecVal(value, 32)


def bit(term, position):
    return z3.Extract(position, position, term) == 1


def as_bit(condition, width):
    return z3.If(condition, z3.BitVecVal(1, width), z3.BitVecVal(0, width))


def always_equal(a, b):
    """Are two terms equal for all values? "No" may mean that it was not quickly seen."""
    if a.eq(b):
        return True
    solver = z3.SolverFor("QF_BV")
    solver.set("timeout", 2000)
    return solver.check(a != b) == z3.unsat


def short_name(term):
    """A name of its own for each term: the same variable in two runs must mean the same."""
    return hashlib.sha256(term.sexpr().encode()).hexdigest()[:16]
