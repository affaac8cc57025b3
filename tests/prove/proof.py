# SPDX-License-Identifier: MIT
"""Holds the instructions of a kernel against its specification, for all inputs."""
import random
from terms import Misbehaviour, always_equal
from types import SimpleNamespace

import z3
from arithmetic import Bits, Integers, Numbers, INT32_MAX, INT32_MIN
from execution import Execution, overlaps

TIME_LIMIT_MS = 120_000
MISTAKE_LIMIT_MS = 15_000
CORNERS = (0, 1, -1, 2, -2, 3, 5, 32767, 32768, -32768, 65535, 2**30, -(2**30), INT32_MAX, INT32_MAX - 1, INT32_MIN,
           INT32_MIN + 1)


class Refuted(Exception):
    """The instructions do not compute the specification."""


class Undecided(Exception):
    """The solver gave no answer in time."""


class Comparison:
    """Code and specification side by side on the same inputs."""

    def __init__(self, kernel, code, frac, constants=None, exact=True, limit_ms=TIME_LIMIT_MS):
        self.exact, self.limit_ms = exact, limit_ms
        self.run = Execution(kernel, code, constants)
        self.kernel, self.o = kernel, Bits(self.run.products, self.run.table)
        self.values = {name: self.o.value(term, kernel.signed(name)) for name, term in self.run.inputs.items()}
        self.wanted = kernel.specified(self.o, self.values, frac)
        self.assumed = [kernel.assumed(self.o, self.values)]
        cases = kernel.cases(self.o, SimpleNamespace(**self.values)) if kernel.cases else [z3.BoolVal(True)]
        self.cases = [*cases, z3.Not(z3.Or(*cases))]

    def _ask(self, condition):
        """A model in which the condition holds, or None. What follows without the exact products is found much sooner."""
        definitions = self.run.products.definitions if self.exact else []
        model = self._solve(condition)
        return self._solve(condition, *definitions) if model is not None and definitions else model

    def _solve(self, *conditions):
        solver = z3.Then("simplify", "bit-blast", "sat").solver()
        solver.set("timeout", self.limit_ms)
        solver.add(*self.assumed, *self.run.facts, *conditions)
        answer = solver.check()
        if answer == z3.unknown:
            raise Undecided(solver.reason_unknown())
        return solver.model() if answer == z3.sat else None

    def _claims(self):
        for what, condition in self.run.obligations + self.o.obligations:
            yield what, condition
        for name, term in self.run.outputs.items():
            yield f"output {name}", z3.BoolVal(False) if term is None else self.o.value(term) == self.wanted[name]

    def difference(self):
        """(what differs, a model), or None if code and specification are equal for all inputs."""
        for what, condition in self._claims():
            if z3.is_true(z3.simplify(condition)):
                continue
            for case in self.cases:
                model = self._ask(z3.And(case, z3.Not(condition)))
                if model is not None:
                    return what, model
        return None

    def inputs_of(self, model):
        """The values of the inputs in a model, as integers."""
        found = {}
        for name, term in self.run.inputs.items():
            number = model.eval(term, model_completion=True)
            found[name] = number.as_signed_long() if self.kernel.signed(name) else number.as_long()
        if self.kernel.table:
            known = [[model.eval(term, model_completion=True) for term in pair] for pair in self.run.table.known]
            found["table"] = {index.as_long(): word.as_signed_long() for index, word in known}
        return found


def prove_equal(kernel, code, frac):
    found = Comparison(kernel, code, frac).difference()
    if found:
        what, model = found
        raise Refuted(f"{what} is wrong for {_show(model)}")


def _show(model):
    return ", ".join(sorted(f"{d.name()} = {model[d]}" for d in model.decls()))


def prove_overlaps(kernel, code):
    """With objects that overlap, each result is the very term that it is without. Returns how many ways of overlapping."""
    apart = Execution(kernel, code)  # kept: terms are the same only while they live
    for distance in overlaps(kernel):
        together = Execution(kernel, code, overlap=distance).outputs
        for name, term in together.items():
            if not always_equal(term, apart.outputs[name]):
                raise Refuted(f"{name} differs when the output lies {distance} words behind the input")
    return len(overlaps(kernel))


def prove_bounds(kernel, frac, wanted):
    """The specification of one output against exact real numbers: |result - saturated exact value| <= bound."""
    for name, exact, bound in kernel.bounds:
        if name != wanted:
            continue
        o = Integers()
        values = {n: z3.Int(n) for n in kernel.inputs}
        result = z3.ToReal(kernel.specified(o, values, frac)[name])
        real = exact(o, type("Inputs", (), values))
        low, high = z3.RealVal(INT32_MIN), z3.RealVal(INT32_MAX)
        real = z3.If(real < low, low, z3.If(real > high, high, real))
        limit = z3.RealVal(str(bound))
        solver = z3.Solver()
        solver.set("timeout", TIME_LIMIT_MS)
        solver.add(kernel.assumed(o, values), *o.facts, z3.Or(result - real > limit, real - result > limit))
        answer = solver.check()
        if answer != z3.unsat:
            raise Refuted(f"error bound {bound} of {name}: {answer} {solver.model() if answer == z3.sat else ''}")


# ---- concrete vectors -----------------------------------------------------------------------------------------------------
def vectors(kernel, seed, count):
    """`count` inputs within the kernel's assumptions: corners, values of all magnitudes."""
    generator, numbers, found = random.Random(f"{kernel.symbol} {seed}"), Numbers(), []
    while len(found) < count:
        values = {name: _value(generator, kernel, name) for name in kernel.inputs}
        if kernel.assumed(numbers, values):
            found.append(values | ({"table": any_table(kernel)} if kernel.table else {}))
    return found


def _value(generator, kernel, name):
    low, high = kernel.range(name)
    choice = generator.random()
    if choice < 0.3:
        near = [c for c in CORNERS if low <= c <= high]
        return generator.choice([low, high, low + 1, high - 1, *near])
    if choice < 0.6:
        return generator.randint(low, high)
    return max(low, min(high, generator.randint(-(1 << generator.randrange(33)), 1 << generator.randrange(33))))


def any_table(kernel):
    """Words of a table for concrete runs: {index: word}."""
    generator, table = random.Random(kernel.symbol), kernel.table
    return {index: generator.randint(table.lowest, table.highest) for index in range(table.words)}


def concrete(kernel, code, frac, values):
    """(what the machine computes, what the specification says) for constants; values["table"] holds the words of a table."""
    words = values.get("table", {})
    lookup = (lambda index: z3.BitVecVal(words.get(z3.simplify(index).as_long(), 0), 32)) if kernel.table else None
    inputs = {name: values[name] for name in kernel.inputs}
    run = Execution(kernel, code, constants=inputs, table_words=lookup)
    broken = {what: False for what, condition in run.obligations if z3.is_false(z3.simplify(condition))}
    wanted = kernel.specified(Numbers(lambda index: words.get(index, 0)), inputs, frac)
    return run.numbers() | broken, wanted | {what: True for what in broken}


def check_vectors(kernel, code, frac, count):
    for values in vectors(kernel, "vectors", count):
        got, wanted = concrete(kernel, code, frac, values)
        if got != wanted:
            raise Refuted(f"{values}: {got}, not {wanted}")


# ---- counter-examples -----------------------------------------------------------------------------------------------------
def is_equivalent(kernel, code, frac):
    """Does this code compute the specification as well? With all products abstract, so "no" may be wrong."""
    return Comparison(kernel, code, frac, exact=False, limit_ms=MISTAKE_LIMIT_MS).difference() is None


def counter_example(kernel, code, frac):
    """
    Inputs for which the code's result is wrong, whatever the products' abstraction says: the solver works with exact products,
    one factor of each pinned to a constant. None if there is none with these constants.
    """
    for pinned in _combinations(kernel):
        constants = dict(zip(kernel.pins, pinned))
        comparison = Comparison(kernel, code, frac, constants, limit_ms=MISTAKE_LIMIT_MS)
        found = comparison.difference()
        if found:
            return constants | comparison.inputs_of(found[1])
    return None


def _combinations(kernel):
    """Choices of constants for the pinned inputs: some mixed, then each constant for all of them, then more."""
    choices = list(kernel.pins.values())
    if not choices:
        return [()]
    generator = random.Random(kernel.symbol)
    mixed = [tuple(generator.choice(values) for values in choices) for _ in range(12)]
    return mixed[:4] + list(zip(*choices)) + mixed[4:]


def is_wrong(kernel, code, frac, values):
    """Does the machine, given these constants, differ from the specification in Python's integers?"""
    try:
        got, wanted = concrete(kernel, code, frac, values)
    except Misbehaviour:
        return None
    return (got, wanted) if got != wanted else None
