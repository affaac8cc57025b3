# SPDX-License-Identifier: MIT
"""
The part of the Armv7-M instruction set that the kernels use, over z3 bit-vectors: given constants, it computes constants.

Memory is a set of regions, each a symbolic base with words at known offsets: nothing is assumed about where they lie, except
that two regions do not overlap. Whatever the machine does not know is an error, never a guess.
"""
import z3
from disassembly import Unknown
from memory import Memory, Stack
from processing import Processing
from terms import SP, Misbehaviour


class Machine(Processing, Memory):
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
