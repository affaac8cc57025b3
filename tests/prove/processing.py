# SPDX-License-Identifier: MIT
"""Instructions on registers and flags alone; a part of the machine (machine.py), whose state they change."""
import z3
from disassembly import Imm, Shift, Unknown
from terms import PC, SP, Misbehaviour, as_bit, bit, word


class Processing:
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


class _Flagged:
    """A comparison: the instruction, which sets flags though its name has no S."""

    def __init__(self, instruction):
        self.text, self.sets_flags = instruction.text, True
