# SPDX-License-Identifier: MIT
"""Holds what a handler did, on all its ways, against the chain: members, registers in their order, and where it went."""
import numpy as np
import z3
from invariant import WRITTEN
from proof import Refuted
from subject import Concrete

# drivers/fabric: the conversion is acknowledged behind its last value and before GATE.STATUS is read
EVENTS = (("read", "IA"), ("read", "IB"), ("write", "COMPARE_A"), ("write", "COMPARE_B"), ("write", "COMPARE_C"),
          ("read", "LATCHED"), ("write", "ADC_STATUS"), ("read", "GATE_STATUS"))


def _in_order(machine):
    return tuple(event[:2] for event in machine.events) == EVENTS


class Comparison:
    def __init__(self, subject):
        self.subject = subject
        self.cleared, self.taken = subject.k.adc_status_cleared, subject.k.adc_status_taken

    @staticmethod
    def _values(machine):
        """(name of the chain's value, term) of all that is to be written."""
        yield from ((event[1], event[2]) for event in machine.events if len(event) == 3 and event[1] != "ADC_STATUS")
        yield from ((name, machine.state[name]) for name in WRITTEN)

    def _claims(self, machine):
        """(what, condition) beside those values."""
        status = next(event[2] for event in machine.events if event[:2] == ("write", "ADC_STATUS"))
        yield "ADC_STATUS", (status & self.cleared) == self.taken
        fault = z3.UGT(self.subject.before["GATE_STATUS"], self.subject.before["status_max"])
        yield "fault", z3.Implies(z3.And(*machine.path), fault if machine.end == "fault" else z3.Not(fault))
        if machine.end == "fault":
            yield "axis", machine.r[0] == self.subject.axis

    def prove(self, ways, cuts):
        covered = z3.Or(*[z3.And(*machine.path) for machine in ways])
        if not cuts.always(covered):
            raise Refuted("its ways do not cover all states")
        for machine in ways:
            if not _in_order(machine):
                raise Refuted(f"registers are accessed otherwise: {[event[:2] for event in machine.events]}")
            for name, term in self._values(machine):
                if not term.eq(z3.BitVec(name, 32)):
                    raise Refuted(f"{name} is not what the chain says")
            for what, condition in self._claims(machine):
                if not cuts.always(condition):
                    raise Refuted(f"{what} is not what it should be")
            self._rest_is_unchanged(machine)

    @staticmethod
    def _rest_is_unchanged(machine):
        for name, term in machine.state.items():
            if name not in WRITTEN and not term.eq(machine.state_before[name]):
                raise Refuted(f"{name} is written")

    def refutation(self, ways, states):
        """The number of a sample for which something is not what it should be, or None."""
        wrong = np.zeros(states.count, dtype=bool)
        if not all(map(_in_order, ways)):
            return 0
        for machine in ways:
            here = states.of(z3.And(z3.BoolVal(True), *machine.path))
            for name, term in self._values(machine):
                wrong |= here & (states.of(term) != states.values[name] & np.uint64(0xFFFFFFFF))
            for _, condition in self._claims(machine):
                wrong |= ~states.of(condition)
        return int(wrong.argmax()) if wrong.any() else None

    def concrete(self, code, values):
        """What the code makes of a state of constants."""
        return self._numbers(self.subject.run(code, Concrete(self.subject.tables), values)[0])

    def _numbers(self, machine):
        """After a run from constants: {what: number}; accesses in another order are all there is to say."""
        if not _in_order(machine):
            return {"accesses": [" ".join(event[:2]) for event in machine.events]}
        found = {name: z3.simplify(term) for name, term in self._values(machine)}
        numbers = {name: term.as_signed_long() if z3.is_bv_value(term) else None for name, term in found.items()}
        status = z3.simplify(next(event[2] for event in machine.events if event[:2] == ("write", "ADC_STATUS")))
        acknowledged = status.as_long() & self.cleared if z3.is_bv_value(status) else None
        return numbers | {"ADC_STATUS": acknowledged, "end": machine.end}

    def expected(self, values):
        found = self.subject.wanted(values)
        names = [name for kind, name in EVENTS if kind == "write" and name != "ADC_STATUS"] + list(WRITTEN)
        fault = int(values["GATE_STATUS"]) & 0xFFFFFFFF > int(values["status_max"]) & 0xFFFFFFFF
        return {name: int(found[name]) for name in names} | {"ADC_STATUS": self.taken, "end": "fault" if fault else "return"}


def differences(got, wanted):
    if "accesses" in got:
        return f"accesses {', '.join(got['accesses'])}"
    return ", ".join(f"{name} {got[name]} not {wanted[name]}" for name in wanted if got[name] != wanted[name])
