# SPDX-License-Identifier: MIT
"""
The machine inside of a linked image: branches by taking both ways, the members of struct current_loop, the fabric's registers,
of which every access is an event, and tables. The result of each instruction is shown to `settle` (cuts.py), which may name it.
"""
import copy

import z3
from disassembly import Imm, Reg, Unknown
from machine import Machine
from memory import Stack
from terms import LR, SP, Misbehaviour, word

KEPT = (4, 5, 6, 7, 8, 9, 10, 11, SP, LR)


class Place:
    """What stands where: {offset: name} of the state and of the registers, with their bases; tables by name."""

    def __init__(self, state, members, fabric, registers, tables):
        self.state, self.members, self.fabric, self.registers, self.tables = state, members, fabric, registers, tables


class Interrupt(Machine):
    """
    place.tables: {name: (address, count of words, bytes of a word)}. `state`: {member: term}; reads(register, n): the n-th
    value that a register gives. `ends`: addresses of functions that the last branch may go to.
    """

    def __init__(self, code, place, cuts, state, reads, ends):
        super().__init__(code, {}, [Stack({})], cuts.products)
        self.place, self.cuts, self.reads, self.ends = place, cuts, reads, ends
        self.state, self.state_before = dict(state), state
        self.at = {i.address: n for n, i in enumerate(code.instructions)}
        self.events, self.path, self.taken, self.end = [], [], None, None
        self.order = None  # the exact number of whose sign the flags tell

    # ---- running -------------------------------------------------------------------------------------------------
    def run(self):
        """All ways through the code, each a machine that has come to its end."""
        ended, under_way = [], [self._from(self.code.instructions[0].address)]
        while under_way:
            machine = under_way.pop()
            while machine.end is None:
                other = machine._next()
                under_way += [other] if other else []
            machine._check_end()
            ended.append(machine)
        return ended

    def _from(self, address):
        self.pc = address
        return self

    def _fork(self):
        other = copy.copy(self)
        other.r, other.flags, other.state = list(self.r), dict(self.flags), dict(self.state)
        other.events, other.path = list(self.events), list(self.path)
        other.stack = copy.copy(self.stack)
        other.stack.words, other.regions = dict(self.stack.words), [other.stack]
        return other

    def _next(self):
        """One instruction; another machine where it is not known whether a branch is taken."""
        if self.pc not in self.at:
            raise Misbehaviour(f"no instruction at {self.pc:#x}")
        number = self.at[self.pc]
        instruction, self.taken = self.code.instructions[number], None
        self.step(instruction)
        if self.returned:
            self.end = "return"
            return None
        rest = self.code.instructions[number + 1:number + 2]
        following = rest[0].address if rest else None
        if self.taken is None or z3.is_false(self.condition):
            self.pc = following
            return None
        return self._branch(following)

    def _branch(self, following):
        other = None
        if not z3.is_true(self.condition):
            other = self._fork()
            other.pc = following
            other.path.append(z3.Not(self.condition))
            self.path.append(self.condition)
        if self.taken in self.at:
            self.pc = self.taken
        elif self.taken in self.ends:
            self.end = self.ends[self.taken]
        else:
            raise Misbehaviour(f"a branch elsewhere: {self.instruction.text}")
        return other

    def _check_end(self):
        for number in KEPT:
            if not (number == LR and self.end == "return") and not self.same(self.r[number], self.entry[number]):
                raise Misbehaviour(f"r{number} is not restored")

    def do_b(self, target):
        self.taken = target.address

    # ---- registers -----------------------------------------------------------------------------------------------
    def put(self, register, value):
        super().put(register, value)
        if register.number != SP:
            self.r[register.number] = self.cuts.settle(self.r[register.number])

    def set_flags(self, *arguments, **named):
        super().set_flags(*arguments, **named)
        if self.instruction.sets_flags:
            self.order = None

    def do_cmp(self, *ops):
        super().do_cmp(*ops)
        self._ordered(ops, lambda y: -y)

    def do_cmn(self, *ops):
        super().do_cmn(*ops)
        self._ordered(ops, lambda y: y)

    def _ordered(self, ops, summand):
        """After a comparison N, V and Z tell the sign of the exact difference or sum, said so it is a smaller term."""
        if z3.is_true(self.condition):
            x, y = (z3.SignExt(2, self.get(operand)) for operand in ops[:2])
            self.order = z3.simplify(x + summand(y))

    def holds(self, cond):
        if self.order is None or cond not in ("ge", "lt", "gt", "le"):
            return super().holds(cond)
        return z3.simplify({"ge": self.order >= 0, "lt": self.order < 0, "gt": self.order > 0, "le": self.order <= 0}[cond])

    def add_with_carry(self, x, y, carry_in):
        _, carry, overflow = super().add_with_carry(x, y, carry_in)
        added = z3.If(carry_in, word(1), word(0))
        return z3.simplify(x + y + added), carry, overflow

    def low_product(self, a, b):
        return z3.simplify(super().low_product(a, b))

    def _shift(self, kind, ops):
        if isinstance(ops[-1], Reg):  # by a register whose value is known
            amount = z3.simplify(self.get(ops[-1]))
            if not z3.is_bv_value(amount) or amount.as_long() > 31:
                raise Unknown(f"a shift by a variable: '{self.instruction.text}'")
            ops = (*ops[:-1], Imm(amount.as_long()))
        super()._shift(kind, ops)

    # ---- memory --------------------------------------------------------------------------------------------------
    def load(self, address):
        offset = self._on_stack(address)
        if offset is not None:
            return self._stacked(offset)
        address = z3.simplify(address)
        if not z3.is_bv_value(address):
            return self._table(address, 4)
        number = address.as_long()
        if number - self.place.state in self.place.members:
            return self.state[self.place.members[number - self.place.state]]
        if number - self.place.fabric in self.place.registers:
            return self._read(self.place.registers[number - self.place.fabric])
        return self._table(address, 4)

    def store(self, address, value):
        if not z3.is_true(self.condition):
            raise Unknown(f"a conditional store: '{self.instruction.text}'")
        if self._on_stack(address) is not None:
            self.stack_store(address, value)
            return
        address = z3.simplify(address)
        number = address.as_long() if z3.is_bv_value(address) else -1
        if number - self.place.state in self.place.members:
            self.state[self.place.members[number - self.place.state]] = value
        elif number - self.place.fabric in self.place.registers:
            self.events.append(("write", self.place.registers[number - self.place.fabric], value))
        else:
            raise Misbehaviour(f"a store outside the state and the registers: {self.instruction.text}")

    def stack_store(self, address, value):
        super().store(address, value)

    def _on_stack(self, address):
        offset = z3.simplify(address - self.stack.base)
        return offset.as_signed_long() if z3.is_bv_value(offset) else None

    def _stacked(self, offset):
        lowest = self._on_stack(self.r[SP])
        if not lowest <= offset < 0 or offset not in self.stack.words:
            raise Misbehaviour(f"a word that nobody wrote is read: {self.instruction.text}")
        return self.stack.words[offset]

    def _read(self, name):
        count = sum(event[:2] == ("read", name) for event in self.events)
        self.events.append(("read", name))
        return self.reads(name, count)

    def _table(self, address, size):
        """A word of a table, once it is shown that the place is in it for all states."""
        for name, (start, count, width) in self.place.tables.items():
            index = z3.simplify(z3.LShR(address - start, width.bit_length() - 1))
            aligned = z3.Extract(width.bit_length() - 2, 0, address - start) == 0
            inside = z3.And(z3.ULT(address - start, count * width), aligned)
            if width == size and self.cuts.may_be(inside) and self.cuts.always(inside):
                return self.cuts.table_word(name, self.cuts.settle(index))
        raise Misbehaviour(f"an address of nothing known, or outside of its table: {self.instruction.text}")

    def do_ldrh(self, destination, mem):
        self.put(destination, self._table(z3.simplify(self._address(mem)), 2))
