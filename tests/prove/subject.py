# SPDX-License-Identifier: MIT
"""The interrupt in the image: where its state is, what it may call, the samples and spans of all that the chain names."""
from abstraction import Products
from dataclasses import dataclass
from types import SimpleNamespace

import chain
import lemmas
import numpy as np
import z3
from arrays import Arrays, Intervals, Span, Words
from cuts import Cuts
from evaluate import States
from invariant import ANY, CONSTANT, INPUTS, INTEGRAL, state
from interrupt import Interrupt, Place
from proof import Refuted

SAMPLES = 20000
FAULT = "drive_sample_fault"
REGISTERS = ("COMPARE_A", "COMPARE_B", "COMPARE_C", "ADC_STATUS", "IA", "IB", "LATCHED", "GATE_STATUS")


@dataclass(frozen=True)
class Table:
    span: Span
    values: np.ndarray

    @staticmethod
    def of(words):
        return Table(Span(min(words), max(words)), np.array(words, dtype=np.int64))


class Concrete:
    """In place of cut points: everything is a constant."""

    def __init__(self, tables):
        self.products, self.tables = Products(), tables

    def settle(self, term):
        return term

    def may_be(self, claim):
        return z3.is_true(z3.simplify(claim))

    always = may_be

    def table_word(self, name, index):
        return z3.BitVecVal(int(self.tables[name].values[z3.simplify(index).as_long()]), 32)


class Subject:
    def __init__(self, image, admitted):
        self.image, self.k = image, admitted.k
        self.inside = state(admitted.k) | INPUTS
        self.words = {"chords": image.words("trig_chords"), "circle": admitted.circle}
        self.tables = {name: Table.of(words) for name, words in self.words.items()}
        self.axis = image.address("axes")
        members = image.members("current_loop")
        registers = {getattr(self.k, name): name for name in REGISTERS}
        places = {"chords": (image.address("trig_chords"), len(self.words["chords"]), 4),
                  "circle": (self.axis + self.k.circle_offset, len(self.words["circle"]), 2)}
        self.place = Place(self.axis, members, self.k.fabric_base, registers, places)
        self.all = dict.fromkeys(sorted(members.values()), ANY) | self.inside
        self.before = {name: z3.BitVec(f"before {name}", 32) for name in self.all}

    # ---- what is known without the code --------------------------------------------------------------------------
    def measure(self):
        """The lengths of the vectors, squared: (cos, sin), currents, voltages."""
        trigonometry = lemmas.Trigonometry(self.words["chords"])
        squares = trigonometry.square, lemmas.current_square(), lemmas.voltage_square(self.k, self.words["circle"])
        self.known = lemmas.sums_of_products(trigonometry, *squares[1:]) | trigonometry.ranges
        return squares

    def find_spans(self):
        """Of every value of the chain, whatever the state; an OverflowError where 32 bits do not hold it."""
        o = Intervals({name: table.span for name, table in self.tables.items()}, self.known)
        chain.sample(o, self.k, SimpleNamespace(**self.inside))
        self.spans = o.found
        for name, indices in o.indices.items():
            if min(i.low for i in indices) < 0 or max(i.high for i in indices) >= len(self.words[name]):
                raise Refuted(f"table {name} is read outside")

    def hold_integrals(self):
        lemmas.never_fuller(self.k, self.inside, self.words["circle"], self.spans)
        step = max(-self.spans[f"held_{axis}"].low for axis in "dq") >> 6
        if lemmas.FULL + step + 1 > INTEGRAL:
            raise Refuted("one step may fill an integral")
        for axis in "dq":
            self.spans[f"integral_{axis}_q9"] = Span(-INTEGRAL, INTEGRAL)
        return lemmas.FULL + step + 1

    # ---- samples -------------------------------------------------------------------------------------------------
    def draw(self):
        """States within the invariant, ends and all magnitudes among them, and what the chain makes of them."""
        generator = np.random.default_rng(1)
        self.drawn = {name: _draw(generator, span) for name, span in self.all.items()}
        o = Arrays(self.words)
        chain.sample(o, self.k, SimpleNamespace(**self.drawn))
        self.computed, spans = o.found, self.known | self.spans
        for name, values in (*o.found.items(), *o.sums.items()):
            if not spans[name].low <= values.min() <= values.max() <= spans[name].high:
                raise Refuted(f"{name} is {values.min()}...{values.max()} in samples")

    def drawn_state(self, number):
        return {name: int(values[number]) for name, values in self.drawn.items()}

    def cuts(self):
        states = States(SAMPLES, {f"before {name}": values for name, values in self.drawn.items()} | self.computed)
        spans = {f"before {name}": span for name, span in self.inside.items()} | self.known | self.spans | {None: ANY}
        inputs = {f"before {name}": self.before[name] for name in self.inside}
        cuts = Cuts(inputs, spans, states, self.tables)
        chain.sample(cuts, self.k, SimpleNamespace(**{name: cuts.value(self.before[name]) for name in self.inside}))
        for what, condition in cuts.obligations:
            if not cuts.always(condition):
                raise Refuted(f"not for all states: {what}")
        return cuts

    # ---- running -------------------------------------------------------------------------------------------------
    def run(self, code, cuts, values=None):
        """All ways through the code; from a state of constants, if `values` are given."""
        start = {name: z3.BitVecVal(int(values[name]), 32) for name in values} if values else self.before
        start = self.before | start
        state = {name: start[name] for name in self.place.members.values()}
        for name, what in CONSTANT.items():
            state[name] = z3.BitVecVal(self.image.address(what) if isinstance(what, str) else what, 32)
        ends = {self.image.address(FAULT): "fault"}
        return Interrupt(code, self.place, cuts, state, lambda name, _: start[name], ends).run()

    def wanted(self, values):
        """What the chain says for one state, in Python's integers."""
        o = Words(self.words)
        chain.sample(o, self.k, SimpleNamespace(**values))
        return o.found


def _draw(generator, span):
    even = generator.integers(span.low, span.high + 1, SAMPLES)
    small = generator.integers(-(2**31), 2**31, SAMPLES) >> generator.integers(0, 32, SAMPLES)
    ends = np.array([span.low, span.high, max(0, span.low), min(max(-1, span.low), span.high)])
    choice = generator.random(SAMPLES)
    values = np.where(choice < 0.4, np.clip(small, span.low, span.high), even)
    return np.where(choice > 0.8, ends[generator.integers(0, 4, SAMPLES)], values)
