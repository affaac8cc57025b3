# SPDX-License-Identifier: MIT
"""What there is to say of a kernel: where its code is, how it is called, what it shall compute. The table is specs.py."""
from dataclasses import dataclass, field
from types import SimpleNamespace

from arithmetic import INT32_MAX, INT32_MIN


@dataclass(frozen=True)
class Value:
    """An argument in a register, or the fifth and later on the stack. Signed unless its range lies within 0...2^32 - 1."""
    name: str


@dataclass(frozen=True)
class Pointer:
    """A pointer to a struct of words. `out`: the fields that are written; the others, and those in `inout`, are inputs."""
    name: str
    fields: tuple
    out: tuple = ()
    inout: tuple = ()

    @property
    def inputs(self):
        return tuple(f for f in self.fields if f not in self.out or f in self.inout)


@dataclass(frozen=True)
class Table:
    """A constant table: its words are any in lowest...highest, which the real ones are checked to be."""
    symbol: str
    words: int
    lowest: int
    highest: int


@dataclass(frozen=True)
class Kernel:
    symbol: str
    arguments: tuple
    spec: object  # (o, v) -> {output: value}; o is an Arithmetic, v holds the inputs
    fracs: tuple = (15,)  # of LIB_TRIG_FRAC; v.frac
    ranges: dict = field(default_factory=dict)  # input: (lowest, highest); otherwise int32_t
    assume: object = None  # (o, v) -> condition under which the specification is meant
    assumption: str = ""  # the same in words
    result: str = ""  # the output in r0, if any
    overlap: bool = False  # the two pointers may point into the same object
    table: Table = None  # that the code reads
    pins: dict = field(default_factory=dict)  # input: constants that make products exact in a counter-example
    cases: object = None  # (o, v) -> conditions that are tried one by one, and what none of them covers: saves the solver time
    bounds: tuple = ()  # (output, (o, v) -> exact real value, largest error in LSB): proved over the integers

    @property
    def inputs(self):
        names = []
        for argument in self.arguments:
            names += [argument.name] if isinstance(argument, Value) else argument.inputs
        return names

    @property
    def outputs(self):
        written = [name for a in self.arguments if isinstance(a, Pointer) for name in a.out]
        return written + ([self.result] if self.result else [])

    def range(self, name):
        return self.ranges.get(name, (INT32_MIN, INT32_MAX))

    def signed(self, name):
        return self.range(name)[0] < 0 or self.range(name)[1] <= INT32_MAX

    def assumed(self, o, values):
        conditions = [o.within(values[name], *self.range(name)) for name in self.inputs]
        if self.assume:
            conditions.append(self.assume(o, SimpleNamespace(**values)))
        return o.both(*conditions)

    def specified(self, o, values, frac):
        return self.spec(o, SimpleNamespace(frac=frac, **values))
