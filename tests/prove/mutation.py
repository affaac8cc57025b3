# SPDX-License-Identifier: MIT
"""Small, likely mistakes in a kernel's code: {kind: [(description, code)]}. The prover must refute them."""
from dataclasses import replace

from disassembly import Code, Imm, Mem, Reg, Shift

OPPOSITE = {"eq": "ne", "cs": "cc", "mi": "pl", "vs": "vc", "hi": "ls", "ge": "lt", "gt": "le"}
OPPOSITE |= {value: key for key, value in OPPOSITE.items()}
OTHER = {"add": "sub", "sub": "add", "adc": "add", "sbc": "sub", "lsr": "asr", "asr": "lsr", "mla": "mls", "mls": "mla",
         "orr": "and", "bic": "and", "eor": "orr", "mvn": "mov", "ubfx": "sbfx", "sbfx": "ubfx"}
KEPT = ("push", "pop", "stmdb", "ldmia", "bx", "nop", "ldr", "ldrd", "str", "strd", "b")  # of these none is dropped
ORDERED = {"sub": (1, 2), "sbc": (1, 2), "rsb": (1, 2), "bic": (1, 2), "smull": (0, 1), "smlal": (0, 1), "mla": (2, 3),
           "mls": (2, 3), "ldrd": (0, 1), "strd": (0, 1)}
SHIFTS = ("lsl", "lsr", "asr", "ror")


def _condition(i):
    if i.cond in OPPOSITE:
        yield f"condition {OPPOSITE[i.cond]}", replace(i, cond=OPPOSITE[i.cond])


def _other_amount(amount):
    return amount - 1 if amount > 1 else amount + 1


def _shift(i):
    for n, operand in enumerate(i.operands):
        if isinstance(operand, Shift) and operand.kind in SHIFTS:
            amount = _other_amount(operand.amount)
            yield f"{operand.kind} #{amount}", i.with_operand(n, Shift(operand.kind, amount))
    amounts = {"lsl": -1, "lsr": -1, "asr": -1, "ssat": 1, "usat": 1, "sbfx": 2, "ubfx": 2}
    if i.base in amounts and isinstance(i.operands[amounts[i.base]], Imm):
        index = amounts[i.base] % len(i.operands)
        amount = _other_amount(i.operands[index].value)
        yield f"#{amount} in operand {index + 1}", i.with_operand(index, Imm(amount))


def _drop(i):
    if i.base not in KEPT:
        yield "dropped", None


def _swap(i):
    if i.base in ORDERED:
        a, b = ORDERED[i.base]
        operands = list(i.operands) if len(i.operands) > b else [i.operands[0], *i.operands]
        if isinstance(operands[b], Reg) and isinstance(operands[a], Reg) and operands[a] != operands[b]:
            operands[a], operands[b] = operands[b], operands[a]
            yield f"operands {a + 1} and {b + 1} swapped", replace(i, operands=tuple(operands))


def _constant(i):
    if i.base in SHIFTS or i.base in ("ssat", "usat", "sbfx", "ubfx"):
        return
    for n, operand in enumerate(i.operands):
        if isinstance(operand, Imm):
            value = operand.value ^ 1
            yield f"#{value:#x} for #{operand.value:#x}", i.with_operand(n, Imm(value))
        if isinstance(operand, Mem) and operand.base != 15 and isinstance(operand.offset, Imm) and i.base == "ldr":
            value = operand.offset.value ^ 4
            yield f"offset {value}", i.with_operand(n, replace(operand, offset=Imm(value)))


def _operation(i):
    if i.base in OTHER:
        yield f"{OTHER[i.base]} for {i.base}", replace(i, base=OTHER[i.base])
    if i.sets_flags:
        yield "flags not set", replace(i, sets_flags=False)


KINDS = {"condition": _condition, "shift": _shift, "drop": _drop, "swap": _swap, "constant": _constant, "operation": _operation}


def mutations(code):
    """Every mutation of every instruction, and of every literal, by kind."""
    found = {kind: [] for kind in KINDS}
    for n, instruction in enumerate(code.instructions):
        for kind, change in KINDS.items():
            for what, new in change(instruction):
                body = code.instructions[:n] + ([new] if new else []) + code.instructions[n + 1:]
                found[kind].append((f"'{instruction.text}' at {instruction.address:#x}: {what}", Code(body, code.words)))
    for address, (value, symbol) in code.words.items():
        if not symbol:
            words = code.words | {address: (value ^ 1, symbol)}
            found["constant"].append((f"literal {value ^ 1:#x} for {value:#x}", Code(code.instructions, words)))
    return found
