# SPDX-License-Identifier: MIT
"""Loads, stores and the return; a part of the machine (machine.py). Memory is regions; nothing is assumed of where they lie."""
import z3
from disassembly import Reg, Unknown
from terms import LR, PC, SP, Misbehaviour, word


class Region:
    """Words behind one pointer. `writable`: the offsets that may be stored to. With `table`: a table, read through that."""

    def __init__(self, name, words, writable=(), table=None, table_words=0):
        self.base = z3.BitVec(f"{name}@", 32)
        self.words, self.writable, self.table, self.table_words = dict(words), set(writable), table, table_words


class Stack(Region):
    """Everything below the stack pointer at entry may be used; above it are the arguments."""

    def __init__(self, arguments):
        super().__init__("sp", arguments)


class Memory:
    # ---- memory ----------------------------------------------------------------------------------------------------
    def _place(self, address):
        """(region, offset) of an address; the offset is an int, or a term where a table is indexed."""
        for region in self.regions:
            offset = z3.simplify(address - region.base)
            if z3.is_bv_value(offset):
                return region, offset.as_signed_long()
            if region.table is not None and not _mentions(offset, region.base):
                return region, offset
        raise Misbehaviour(f"an address of no known object: {self.instruction.text}")

    def load(self, address):
        region, offset = self._place(address)
        if region.table is not None:
            offset = offset if not isinstance(offset, int) else word(offset)
            inside = z3.And(z3.ULT(offset, 4 * region.table_words), z3.Extract(1, 0, offset) == 0)
            self.obligations.append((f"'{self.instruction.text}' reads inside the table", inside))
            return region.table(z3.simplify(z3.LShR(offset, 2)))
        if offset not in region.words:
            raise Misbehaviour(f"a word that nobody wrote is read: {self.instruction.text}")
        return region.words[offset]

    def store(self, address, value):
        region, offset = self._place(address)
        if not isinstance(offset, int) or not z3.is_true(self.condition):
            raise Unknown(f"a conditional or indexed store: '{self.instruction.text}'")
        lowest = z3.simplify(self.r[SP] - self.stack.base).as_signed_long()
        allowed = lowest <= offset < 0 if region is self.stack else offset in region.writable
        if not allowed or offset % 4:
            raise Misbehaviour(f"a store outside the output: {self.instruction.text}")
        region.words[offset] = value

    def _address(self, mem):
        """The address of an access; base update is done here."""
        if mem.base == PC:
            return None
        base = self.r[mem.base]
        moved = base + self.shifted(self.get(mem.offset), mem.shift)[0]
        if mem.mode != "offset":
            if not z3.is_true(self.condition):
                raise TypeError
            self.r[mem.base] = z3.simplify(moved)
        return base if mem.mode == "post" else moved

    def _literal(self, mem):
        address = (self.instruction.address + 4 & ~3) + mem.offset.value
        if address not in self.code.words:
            raise Misbehaviour(f"no literal there: {self.instruction.text}")
        value, symbol = self.code.words[address]
        return self._address_of(symbol) + value if symbol else word(value)

    def do_ldr(self, destination, mem, *_):
        address = self._address(mem)
        value = self._literal(mem) if address is None else self.load(address)
        if destination.number == PC:
            self._return(value)
        else:
            self.put(destination, value)

    def do_str(self, source, mem):
        value = self.get(source)
        self.store(self._address(mem), value)

    def do_ldrd(self, first, second, mem):
        address = self._address(mem)
        values = self.load(address), self.load(address + 4)
        self.put(first, values[0])
        self.put(second, values[1])

    def do_strd(self, first, second, mem):
        address = self._address(mem)
        self.store(address, self.get(first))
        self.store(address + 4, self.get(second))

    def _load_many(self, base, address, numbers, after):
        values = [self.load(address + 4 * index) for index, _ in enumerate(numbers)]
        if after is not None and not z3.is_true(self.condition):
            raise TypeError
        if after is not None:
            self.r[base] = z3.simplify(after)
        for number, value in zip(numbers, values):
            if number == PC:
                self._return(value)
            else:
                self.put(Reg(number), value)

    def do_ldmia(self, base, registers):
        address = self.get(base)
        after = address + 4 * len(registers.numbers) if self.instruction.writeback else None
        self._load_many(base.number, address, registers.numbers, after)

    def do_stmia(self, base, registers):
        address = self.get(base)
        for index, number in enumerate(registers.numbers):
            self.store(address + 4 * index, self.r[number])
        if self.instruction.writeback:
            self.r[base.number] = z3.simplify(address + 4 * len(registers.numbers))

    def do_stmdb(self, base, registers):
        if base.number != SP or not self.instruction.writeback:
            raise TypeError
        self.do_push(registers)

    def do_push(self, registers):
        values = [self.r[number] for number in registers.numbers]
        self.r[SP] = z3.simplify(self.r[SP] - 4 * len(values))
        for index, value in enumerate(values):
            self.store(self.r[SP] + 4 * index, value)

    def do_pop(self, registers):
        address = self.r[SP]
        self._load_many(SP, address, registers.numbers, address + 4 * len(registers.numbers))

    # ---- return ----------------------------------------------------------------------------------------------------
    def _return(self, target):
        if not self.same(target, self.entry[LR]) or not z3.is_true(self.condition):
            raise Misbehaviour(f"a branch elsewhere than back to the caller: {self.instruction.text}")
        self.returned = True

    def do_bx(self, target):
        self._return(self.get(target))


def _mentions(term, variable):
    todo, seen = [term], set()
    while todo:
        current = todo.pop()
        if current.eq(variable):
            return True
        if current.get_id() not in seen:
            seen.add(current.get_id())
            todo += current.children()
    return False
