# SPDX-License-Identifier: MIT
"""
The part of the Armv7-M instruction set that the kernels use, over z3 bit-vectors: given constants, it computes constants.

Memory is a set of regions, each a symbolic base with words at known offsets: nothing is assumed about where they lie, except
that two regions do not overlap. Whatever the machine does not know is an error, never a guess.
"""
import hashlib

import z3
from disassembly import Imm, Reg, Shift, Unknown

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


class Products:
    """
    Signed 32 x 32 -> 64 bit products, each a fresh 64-bit variable. Of two variables only the range of such a product is
    known, and that equal factors give equal products: what is proved with that holds for all values in range, so in
    particular for the true ones. With a constant factor, `definitions` say the value, and `facts` that it lies between the
    products with the next powers of two, which is often enough and much quicker.
    """
    LOWEST, HIGHEST = -(2**62) + 2**31, 2**62
    SMALL = 12, 17  # factors within +-2^n have a product within +-2^(2n)

    def __init__(self):
        self.known = []  # (a, b, product)
        self.facts, self.definitions = [], []

    def __call__(self, a, b):
        a, b = z3.simplify(a), z3.simplify(b)
        if z3.is_bv_value(a):
            a, b = b, a
        for x, y, product in self.known:
            if (always_equal(a, x) and always_equal(b, y)) or (always_equal(a, y) and always_equal(b, x)):
                return product
        exact = z3.SignExt(32, a) * z3.SignExt(32, b)
        if z3.is_bv_value(a):
            return z3.simplify(exact)
        product = z3.BitVec(f"product {short_name(a)} {short_name(b)}", 64)
        if z3.is_bv_value(b):
            self.definitions.append(product == exact)
            self.facts.append(self._between(z3.SignExt(32, a), b.as_signed_long(), product))
        else:
            self._abstract(a, b, product)
        self.known.append((a, b, product))
        return product

    @staticmethod
    def _between(x, constant, product):
        """x 2^n <= x |constant| <= x 2^(n+1), or reversed."""
        power = max(abs(constant).bit_length() - 1, 0)
        small, large = x * (1 << power), x * (1 << (power + 1))
        product = product if constant >= 0 else -product
        if constant == 0:
            return product == 0
        return z3.If(x >= 0, z3.And(small <= product, product <= large), z3.And(large <= product, product <= small))

    def _abstract(self, a, b, product):
        self.facts += [product >= self.LOWEST, product <= self.HIGHEST]
        for bits in self.SMALL:
            small = [z3.And(x >= -(1 << bits), x <= 1 << bits) for x in (a, b)]
            self.facts.append(z3.Implies(z3.And(*small), z3.And(product >= -(1 << 2 * bits), product <= 1 << 2 * bits)))
        for x, y, other in self.known:
            same = z3.Or(z3.And(a == x, b == y), z3.And(a == y, b == x))
            self.facts.append(z3.Implies(same, product == other))


class Lookups:
    """Words of a constant table: for each index a fresh variable, of which a range is known; equal ones for equal indices."""

    def __init__(self, lowest, highest):
        self.range = lowest, highest
        self.known = []  # (index, word)
        self.facts = []

    def __call__(self, index):
        index = z3.simplify(index)
        for other, found in self.known:
            if index.eq(other):
                return found
        found = z3.BitVec(f"word {short_name(index)}", 32)
        self.facts += [found >= self.range[0], found <= self.range[1]]
        self.facts += [z3.Implies(index == other, found == word_there) for other, word_there in self.known]
        self.known.append((index, found))
        return found


class Region:
    """Words behind one pointer. `writable`: the offsets that may be stored to. With `table`: a table, read through that."""

    def __init__(self, name, words, writable=(), table=None, table_words=0):
        self.base = z3.BitVec(f"{name}@", 32)
        self.words, self.writable, self.table, self.table_words = dict(words), set(writable), table, table_words


class Stack(Region):
    """Everything below the stack pointer at entry may be used; above it are the arguments."""

    def __init__(self, arguments):
        super().__init__("sp", arguments)


class Machine:
    def __init__(self, code, registers, regions, products):
        self.code, self.products = code, products
        self.stack = next(region for region in regions if isinstance(region, Stack))
        self.regions = regions
        self.entry = [registers.get(n, z3.BitVec(f"r{n}_at_entry", 32)) for n in range(16)]
        self.entry[SP] = self.stack.base
        self.r = list(self.entry)
        self.flags = {name: z3.Bool(f"{name}_at_entry") for name in "nzcv"}
        self.obligations = []  # (what, condition) that must hold whenever the kernel's assumptions do
        self.returned = False

    # ---- running ---------------------------------------------------------------------------------------------------
    def run(self):
        for instruction in self.code.instructions:
            if self.returned:
                if instruction.base != "nop":
                    raise Misbehaviour(f"code behind the return: {instruction.text}")
                continue
            self.step(instruction)
        if not self.returned:
            raise Misbehaviour("no return")
        for number in (4, 5, 6, 7, 8, 9, 10, 11, SP):
            if not self.same(self.r[number], self.entry[number]):
                raise Misbehaviour(f"r{number} is not restored")
        return self

    def step(self, instruction):
        execute = getattr(self, f"do_{instruction.base}", None)
        if execute is None:
            raise Unknown(f"no meaning for instruction '{instruction.text}' at {instruction.address:#x}")
        self.instruction, self.condition = instruction, self.holds(instruction.cond)
        try:
            execute(*instruction.operands)
        except (TypeError, AttributeError):
            raise Unknown(f"no meaning for the operands of '{instruction.text}' at {instruction.address:#x}") from None

    @staticmethod
    def same(a, b):
        return z3.is_true(z3.simplify(a == b))

    def holds(self, cond):
        n, z, c, v = (self.flags[name] for name in "nzcv")
        pair = {"eq": z, "cs": c, "mi": n, "vs": v, "hi": z3.And(c, z3.Not(z)), "ge": n == v, "gt": z3.And(n == v, z3.Not(z)),
                "al": z3.BoolVal(True)}
        opposite = {"ne": "eq", "cc": "cs", "pl": "mi", "vc": "vs", "ls": "hi", "lt": "ge", "le": "gt"}
        return z3.simplify(pair[cond] if cond in pair else z3.Not(pair[opposite[cond]]))

    # ---- registers, flags, operands --------------------------------------------------------------------------------
    def get(self, operand):
        if isinstance(operand, Imm):
            return word(operand.value)
        if operand.number == PC:
            raise Misbehaviour(f"the PC as an operand: {self.instruction.text}")
        return self.r[operand.number]

    def put(self, register, value):
        if register.number in (SP, PC):
            if register.number == PC or not z3.is_true(self.condition):
                raise Misbehaviour(f"the program or stack pointer is changed: {self.instruction.text}")
        self.r[register.number] = z3.simplify(z3.If(self.condition, value, self.r[register.number]))

    def set_flags(self, result, carry=None, overflow=None):
        if not self.instruction.sets_flags:
            return
        new = {"n": bit(result, 31), "z": result == 0, "c": carry, "v": overflow}
        for name, value in new.items():
            if value is not None:
                self.flags[name] = z3.simplify(z3.If(self.condition, value, self.flags[name]))

    def shifted(self, value, shift):
        """(shifted value, carry out)"""
        kind, n = shift.kind, shift.amount
        if n == 0:
            return value, self.flags["c"]
        if kind == "lsl":
            return value * (1 << n), bit(value, 32 - n)
        if kind == "lsr":
            return (z3.LShR(value, n) if n < 32 else word(0)), bit(value, n - 1)
        if kind == "asr":
            return value >> min(n, 31), bit(value, min(n, 32) - 1)
        if kind == "ror":
            return z3.RotateRight(value, n), bit(value, n - 1)
        return z3.Concat(as_bit(self.flags["c"], 1), z3.Extract(31, 1, value)), bit(value, 0)  # rrx

    def second(self, operand, shift):
        """A flexible second operand: (value, carry out)."""
        if isinstance(operand, Imm):
            value = operand.value & 0xFFFFFFFF
            half = value & 0xFFFF
            replicated = value < 256 or value == half * 0x10001 and (half >> 8 in (half & 255, 0) or half & 255 == 0)
            return word(value), self.flags["c"] if replicated else z3.BoolVal(bool(value >> 31))
        return self.shifted(self.get(operand), shift or Shift("lsl", 0))

    # ---- addition, logic, shifts -----------------------------------------------------------------------------------
    def add_with_carry(self, x, y, carry_in):
        wide = z3.ZeroExt(1, x) + z3.ZeroExt(1, y) + as_bit(carry_in, 33)
        result = z3.Extract(31, 0, wide)
        return result, bit(wide, 32), bit((x ^ result) & (y ^ result), 31)

    def _arithmetic(self, operands, compute, compare=False):
        operands = self._three(operands, compare)
        value, _ = self.second(operands[2], operands[3] if len(operands) > 3 else None)
        result, carry, overflow = compute(self.get(operands[1]), value)
        self.set_flags(result, carry, overflow)
        if not compare:
            self.put(operands[0], result)

    def _logic(self, operands, compute, compare=False):
        operands = self._three(operands, compare)
        value, carry = self.second(operands[2], operands[3] if len(operands) > 3 else None)
        result = compute(self.get(operands[1]), value)
        self.set_flags(result, carry)
        if not compare:
            self.put(operands[0], result)

    @staticmethod
    def _three(operands, compare):
        """Two-operand forms: the destination is the first source."""
        if compare:
            return (None, *operands)
        if len(operands) == 2 or isinstance(operands[2], Shift):
            return (operands[0], *operands)
        return operands

    def _compare(self, operands, compute, logic=False):
        kept, self.instruction = self.instruction, _Flagged(self.instruction)
        (self._logic if logic else self._arithmetic)(operands, compute, compare=True)
        self.instruction = kept

    def do_add(self, *ops):
        self._arithmetic(ops, lambda x, y: self.add_with_carry(x, y, z3.BoolVal(False)))

    def do_adc(self, *ops):
        self._arithmetic(ops, lambda x, y: self.add_with_carry(x, y, self.flags["c"]))

    def do_sub(self, *ops):
        self._arithmetic(ops, lambda x, y: self.add_with_carry(x, ~y, z3.BoolVal(True)))

    def do_sbc(self, *ops):
        self._arithmetic(ops, lambda x, y: self.add_with_carry(x, ~y, self.flags["c"]))

    def do_rsb(self, *ops):
        self._arithmetic(ops, lambda x, y: self.add_with_carry(~x, y, z3.BoolVal(True)))

    def do_neg(self, destination, source):
        self.do_rsb(destination, source, Imm(0))

    def do_cmp(self, *ops):
        self._compare(ops, lambda x, y: self.add_with_carry(x, ~y, z3.BoolVal(True)))

    def do_cmn(self, *ops):
        self._compare(ops, lambda x, y: self.add_with_carry(x, y, z3.BoolVal(False)))

    def do_tst(self, *ops):
        self._compare(ops, lambda x, y: x & y, logic=True)

    def do_teq(self, *ops):
        self._compare(ops, lambda x, y: x ^ y, logic=True)

    def do_and(self, *ops):
        self._logic(ops, lambda x, y: x & y)

    def do_orr(self, *ops):
        self._logic(ops, lambda x, y: x | y)

    def do_eor(self, *ops):
        self._logic(ops, lambda x, y: x ^ y)

    def do_bic(self, *ops):
        self._logic(ops, lambda x, y: x & ~y)

    def do_orn(self, *ops):
        self._logic(ops, lambda x, y: x | ~y)

    def do_mov(self, destination, source, shift=None):
        value, carry = self.second(source, shift)
        self.set_flags(value, carry)
        self.put(destination, value)

    def do_mvn(self, destination, source, shift=None):
        value, carry = self.second(source, shift)
        self.set_flags(~value, carry)
        self.put(destination, ~value)

    def _address_of(self, symbol):
        for region in self.regions:
            if region.base.decl().name() == f"{symbol}@":
                return region.base
        raise Unknown(f"symbol '{symbol}' in '{self.instruction.text}'")

    def do_movw(self, destination, source):
        value = self.get(source)
        if self.instruction.symbol:
            value = self._address_of(self.instruction.symbol) & 0xFFFF
        self.put(destination, value)

    def do_movt(self, destination, source):
        high = z3.Extract(15, 0, self.get(source))
        if self.instruction.symbol:
            high = z3.Extract(31, 16, self._address_of(self.instruction.symbol))
        self.put(destination, z3.Concat(high, z3.Extract(15, 0, self.r[destination.number])))

    def _shift(self, kind, ops):
        destination, source, amount = ops if len(ops) == 3 else (ops[0], ops[0], ops[1])
        if not isinstance(amount, Imm):
            raise TypeError
        value, carry = self.shifted(self.get(source), Shift(kind, amount.value))
        self.set_flags(value, carry)
        self.put(destination, value)

    def do_lsl(self, *ops):
        self._shift("lsl", ops)

    def do_lsr(self, *ops):
        self._shift("lsr", ops)

    def do_asr(self, *ops):
        self._shift("asr", ops)

    def do_ror(self, *ops):
        self._shift("ror", ops)

    def do_rrx(self, destination, source):
        self._shift("rrx", (destination, source, Imm(1)))

    # ---- products --------------------------------------------------------------------------------------------------
    def low_product(self, a, b):
        return z3.Extract(31, 0, self.products(self.get(a), self.get(b)))

    def do_mul(self, destination, a, b=None):
        result = self.low_product(a, b or destination)
        self.set_flags(result)
        self.put(destination, result)

    def do_mla(self, destination, a, b, addend):
        self.put(destination, self.get(addend) + self.low_product(a, b))

    def do_mls(self, destination, a, b, minuend):
        self.put(destination, self.get(minuend) - self.low_product(a, b))

    def _long(self, low, high, result):
        result = z3.simplify(result)
        self.put(low, z3.Extract(31, 0, result))
        self.put(high, z3.Extract(63, 32, result))

    def do_smull(self, low, high, a, b):
        self._long(low, high, self.products(self.get(a), self.get(b)))

    def do_smlal(self, low, high, a, b):
        self._long(low, high, z3.Concat(self.get(high), self.get(low)) + self.products(self.get(a), self.get(b)))

    def do_umull(self, low, high, a, b):
        x, y = self.get(a), self.get(b)
        if not z3.is_bv_value(x) and not z3.is_bv_value(y):
            raise Unknown(f"an unsigned product of two variables in '{self.instruction.text}'")
        self._long(low, high, z3.ZeroExt(32, x) * z3.ZeroExt(32, y))

    # ---- bit fields and saturation ---------------------------------------------------------------------------------
    def _saturate(self, destination, source, shift, lowest, highest):
        value, _ = self.shifted(self.get(source), shift or Shift("lsl", 0))
        self.put(destination, z3.If(value < lowest, word(lowest), z3.If(value > highest, word(highest), value)))

    def do_ssat(self, destination, bits, source, shift=None):
        self._saturate(destination, source, shift, -(1 << (bits.value - 1)), (1 << (bits.value - 1)) - 1)

    def do_usat(self, destination, bits, source, shift=None):
        self._saturate(destination, source, shift, 0, (1 << bits.value) - 1)

    def do_sbfx(self, destination, source, lowest, width):
        field = z3.Extract(lowest.value + width.value - 1, lowest.value, self.get(source))
        self.put(destination, z3.SignExt(32 - width.value, field) if width.value < 32 else field)

    def do_ubfx(self, destination, source, lowest, width):
        field = z3.Extract(lowest.value + width.value - 1, lowest.value, self.get(source))
        self.put(destination, z3.ZeroExt(32 - width.value, field) if width.value < 32 else field)

    def do_bfi(self, destination, source, lowest, width):
        mask = ((1 << width.value) - 1) << lowest.value
        self.put(destination, self.get(destination) & ~word(mask) | (self.get(source) << lowest.value) & word(mask))

    def do_bfc(self, destination, lowest, width):
        self.put(destination, self.get(destination) & ~word(((1 << width.value) - 1) << lowest.value))

    def do_sxth(self, destination, source):
        self.do_sbfx(destination, source, Imm(0), Imm(16))

    def do_uxth(self, destination, source):
        self.do_ubfx(destination, source, Imm(0), Imm(16))

    def do_sxtb(self, destination, source):
        self.do_sbfx(destination, source, Imm(0), Imm(8))

    def do_uxtb(self, destination, source):
        self.do_ubfx(destination, source, Imm(0), Imm(8))

    def do_clz(self, destination, source):
        value, count = self.get(source), word(32)
        for position in range(32):
            count = z3.If(bit(value, position), word(31 - position), count)
        self.put(destination, count)

    def do_nop(self, *_):
        pass

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


class _Flagged:
    """A comparison: the instruction, which sets flags though its name has no S."""

    def __init__(self, instruction):
        self.text, self.sets_flags = instruction.text, True


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
