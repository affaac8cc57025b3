# SPDX-License-Identifier: MIT
"""
Cut points: values with a name that the chain (chain.py) computes. What code holds in a register and equals one of them, for all
states, is replaced by a variable of that name: so each question to the solver is about a few instructions. Which one it may be,
samples tell; that it is, the solver.
"""
import z3
from abstraction import Products
from arithmetic import WIDTH, Bits
from terms import short_name

LIMIT_MS = 60_000


class SampledProducts(Products):
    """Of two variables: any number within the product of their ranges; the same factors give the same product."""

    def __init__(self, cuts):
        super().__init__()
        self.cuts = cuts

    def __call__(self, a, b):
        a, b = z3.simplify(a), z3.simplify(b)
        if z3.is_bv_value(a) or z3.is_bv_value(b):
            return z3.simplify(z3.SignExt(32, a) * z3.SignExt(32, b))
        a, b = sorted((a, b), key=lambda term: term.sexpr())
        variable = z3.BitVec(f"product {short_name(a)} {short_name(b)}", 64)
        name = variable.decl().name()
        if name not in self.cuts.facts:
            states = self.cuts.states
            x, y = (self.cuts.signed(states.of(term)) for term in (a, b))
            states.define(variable, (x * y).view("uint64"))
            corners = self.cuts.range_of(a) * self.cuts.range_of(b)
            self.cuts.facts[name] = [variable >= corners.low, variable <= corners.high]
        return variable


class Cuts(Bits):
    """
    `inputs`: {name: variable}; `spans`: of inputs, cuts and bounded sums; `states`: samples of inputs and cuts.
    """

    def __init__(self, inputs, spans, states, table_spans):
        super().__init__(SampledProducts(self))
        self.spans, self.states, self.table_spans = spans, states, table_spans
        self.facts = {}  # name of a variable: what is known of it
        self.sums = []  # bounded ones
        self.meaning = {}  # name of a cut: (its variable, its value from those before)
        self.looks = {}  # samples: names of cuts
        self.words = {}  # table: [(index, word)]
        self.settled = {}  # term: what stands for it
        self.asked = 0
        for name, variable in inputs.items():
            self._range(variable, spans[name])

    # ---- what the chain tells ------------------------------------------------------------------------------------
    def cut(self, name, value):
        variable = z3.BitVec(name, 32)
        self.meaning[name] = variable, value
        self._range(variable, self.spans[name])
        self.looks.setdefault(self._look(variable), []).append(name)
        return self.value(variable)

    def bounded(self, name, value):
        ends = self.spans.get(name)
        if ends is not None:
            self.sums.append(z3.And(value >= ends.low, value <= ends.high))
        return value

    def word(self, table, index):
        index = z3.simplify(z3.Extract(31, 0, index))
        return self.value(self.table_word(table, index))

    def _range(self, variable, ends):
        self.facts[variable.decl().name()] = [variable >= ends.low, variable <= ends.high]

    def _look(self, term):
        return self.states.of(term).tobytes()

    # ---- what machines ask ---------------------------------------------------------------------------------------
    @staticmethod
    def signed(array):
        """Of 32 bits."""
        return (array << 32).view("int64") >> 32

    def range_of(self, term):
        return self.spans[term.decl().name()] if term.num_args() == 0 and term.decl().name() in self.spans else self.spans[None]

    def table_word(self, table, index):
        """The word there: the same for equal indices."""
        known = self.words.setdefault(table, [])
        look = self._look(index)
        for other, word in known:
            if index.eq(other) or look == self._look(other) and self.always(index == other):
                return word
        word = z3.BitVec(f"{table} {short_name(index)}", 32)
        values = self.table_spans[table].values[self.states.of(index).astype(int)]
        self.states.define(word, values.astype("int64").view("uint64") & 0xFFFFFFFF)
        self._range(word, self.table_spans[table].span)
        known.append((index, word))
        return word

    def settle(self, term):
        """The cut that the term equals, or the term."""
        if term.num_args() == 0:
            return term
        if term not in self.settled:
            names = self.looks.get(self._look(term), [])
            self.settled[term] = next((self.meaning[n][0] for n in names if self._is(term, n)), term)
        return self.settled[term]

    def _is(self, term, name):
        variable, value = self.meaning[name]
        claim = self.value(term) == value
        return self.always(claim) or self.always(self.value(term) == self.value(variable))

    def may_be(self, claim):
        """Does it hold in all samples?"""
        return bool(self.states.of(claim).all())

    def always(self, claim):
        """Does the claim hold for all states? First with ranges alone, then with what the cuts in it mean."""
        claim = z3.simplify(claim)
        if z3.is_true(claim):
            return True
        return self._holds(claim, []) or self._holds(claim, self._meanings(claim))

    def _meanings(self, claim):
        names = {name for name in _variables(claim) if name in self.meaning}
        return [self.value(variable) == value for variable, value in (self.meaning[name] for name in sorted(names))]

    def _holds(self, claim, conditions):
        self.asked += 1
        names = set().union(_variables(claim), *map(_variables, conditions))
        facts = [fact for name in sorted(names) for fact in self.facts.get(name, [])]
        facts += [fact for fact in self.sums if _variables(fact) <= names]
        solver = z3.Then("simplify", "solve-eqs", "simplify", "bit-blast", "sat").solver()
        solver.set("timeout", LIMIT_MS)
        solver.add(*facts, *conditions, z3.Not(claim))
        return solver.check() == z3.unsat


def _variables(term):
    found, todo, seen = set(), [term], set()
    while todo:
        current = todo.pop()
        if current.get_id() in seen:
            continue
        seen.add(current.get_id())
        if current.num_args() == 0 and current.decl().kind() == z3.Z3_OP_UNINTERPRETED:
            found.add(current.decl().name())
        todo += current.children()
    return found


assert WIDTH > 64
