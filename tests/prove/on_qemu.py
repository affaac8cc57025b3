# SPDX-License-Identifier: MIT
"""
The machine against QEMU's Cortex-M3: every instruction that stands in the kernels, but for loads, stores and branches, on
random registers and flags. QEMU's mps2-an385 has RAM at 0, and semihosting brings the results out: no part of the product
is in it.
"""
import random
import re
import struct
import subprocess
from abstraction import Products
from machine import Machine
from memory import Stack
from pathlib import Path

import z3
from disassembly import Reg

MEMORY = ("ldr", "str", "ldrd", "strd", "ldrh", "ldmia", "stmia", "stmdb", "push", "pop", "b", "bx", "nop")
SHIFTS = ("lsl", "lsr", "asr", "ror")
STATES = 24  # for each instruction
WORDS = 16  # r0-r12, lr, flags, one spare
CORNERS = (0, 1, 2, 0x7FFFFFFF, 0x80000000, 0x80000001, 0xFFFFFFFF, 0xFFFF8000, 0x8000, 0x7FFF, 0x40000000)

START = """    .syntax unified
    .thumb
    .section .text
    .word 0x20400000, start + 1
start:
"""
# states are read and written through sp, which no instruction under test uses
EACH = """    ldr r0, =states + {first}
    mov sp, r0
1:  ldr lr, [sp, #52]
    ldr r0, [sp, #56]
    msr apsr_nzcvq, r0
    ldmia sp, {{r0-r12}}
{body}
    stmia sp, {{r0-r12}}
    str lr, [sp, #52]
    mrs r0, apsr
    str r0, [sp, #56]
    add sp, #64
    mov r0, sp
    ldr r1, =states + {last}
    cmp r0, r1
    bne 1b
    b 2f
    .ltorg
2:
"""
END = """    movs r0, #1
    ldr r1, =open
    bkpt 0xab
    ldr r1, =write
    str r0, [r1]
    movs r0, #5
    bkpt 0xab
    movs r0, #0x18
    ldr r1, =0x20026
    bkpt 0xab
    .ltorg
    .data
states: .incbin "{binary}"
    .p2align 2
open: .word name, 5, 3
name: .asciz ":tt"
    .p2align 2
write: .word 0, states, {size}
"""


def instructions(codes):
    """Distinct ones, by text."""
    found = {}
    for code in codes:
        for i in code.instructions:
            by_register = i.base in SHIFTS and isinstance(i.operands[-1], Reg)  # by a known number (interrupt.py)
            if i.base not in MEMORY and not i.symbol and not by_register and Reg(13) not in i.operands:
                found.setdefault(re.sub(r"\.[nw]\b", "", i.text), i)
    return found


def random_state(generator):
    values = [generator.choice(CORNERS) if generator.random() < 0.5 else generator.getrandbits(32) for _ in range(14)]
    return [*values, generator.getrandbits(4) << 28, 0]


def run_on_qemu(texts, states, folder, cross, qemu):
    """The states after their instructions, as words."""
    source, elf, binary = folder / "states.S", folder / "states.elf", folder / "states.bin"
    binary.write_bytes(b"".join(struct.pack("<16I", *state) for state in states))
    text = START
    for number, (instruction, cond) in enumerate(texts):
        body = f"    it {cond}\n    {instruction}" if cond != "al" else f"    {instruction}"
        first = number * STATES * 4 * WORDS
        text += EACH.format(first=first, last=first + STATES * 4 * WORDS, body=body)
    source.write_text(text + END.format(binary=binary, size=len(states) * 4 * WORDS))
    subprocess.run([f"{cross}gcc", "-mcpu=cortex-m3", "-mthumb", "-nostdlib", "-Wl,-Ttext=0,-Tdata=0x20000000",
                    str(source), "-o", str(elf)], check=True, stderr=subprocess.DEVNULL)
    command = [qemu, "-M", "mps2-an385", "-display", "none", "-monitor", "none", "-serial", "none", "-semihosting-config",
               "enable=on,target=native", "-kernel", str(elf)]
    result = subprocess.run(command, capture_output=True, timeout=60, check=True, stdin=subprocess.DEVNULL)
    return list(struct.iter_unpack("<16I", result.stdout))


def run_in_machine(instruction, state):
    registers = {n: z3.BitVecVal(value, 32) for n, value in enumerate(state[:13])} | {14: z3.BitVecVal(state[13], 32)}
    machine = Machine(None, registers, [Stack({})], Products())
    machine.flags = {name: z3.BoolVal(bool(state[14] >> at & 1)) for name, at in zip("nzcv", (31, 30, 29, 28))}
    machine.step(instruction)
    flags = sum(1 << at for name, at in zip("nzcv", (31, 30, 29, 28)) if z3.is_true(z3.simplify(machine.flags[name])))
    return [z3.simplify(machine.r[n]).as_long() for n in (*range(13), 14)] + [flags]


def differences(codes, folder, cross="arm-none-eabi-", qemu="qemu-system-arm"):
    """(number of comparisons, [what differs])"""
    found = instructions(codes)
    generator = random.Random(4)
    states = [random_state(generator) for _ in range(len(found) * STATES)]
    after = run_on_qemu([(text, i.cond) for text, i in found.items()], states, Path(folder), cross, qemu)
    wrong = []
    for number, (text, instruction) in enumerate(found.items()):
        for at in range(number * STATES, (number + 1) * STATES):
            mine, real = run_in_machine(instruction, states[at]), [*after[at][:14], after[at][14] & 0xF0000000]
            if mine != real:
                wrong.append(f"{text}: {states[at]}: {mine}, QEMU {real}")
    return len(states), wrong
