# SPDX-License-Identifier: MIT
"""The library's flash, RAM and stack: no RAM of its own, and the stack as the compiler and the instructions have it."""
import os
import subprocess
from collections import Counter
from pathlib import Path

import pytest
import size
from crosscheck import compiler_frames

BUILD = Path(os.environ.get("BUILD", "build"))
CROSS = os.environ.get("CROSS", "arm-none-eabi-")
LIBRARY = BUILD / "libmssfoc.a"
STACK_MAX = {"Clarke_Lib_Do": 0, "InvClarke_Lib_Do": 0, "Park_Lib_Do": 8, "InvPark_Lib_Do": 8}  # two registers saved
LIBRARY_STACK_MAX = 64  # of the others
CODE = """
    .syntax unified
    .cpu cortex-m3
    .thumb
    .section .text.outer, "ax", %progbits
    .global outer
    .type outer, %function
outer:
    push {r4, lr}
    sub sp, #8
    bl inner
    add sp, #8
    pop {r4, pc}
    .size outer, . - outer
    .section .text.inner, "ax", %progbits
    .type inner, %function
inner:
    push {r4, r5, r6}
    pop {r4, r5, r6}
    bx lr
    .size inner, . - inner
"""


@pytest.fixture
def make_library(tmp_path):
    def make(assembly):
        (tmp_path / "code.s").write_text(assembly)
        for command in (["gcc", "-mcpu=cortex-m3", "-c", "code.s"], ["ar", "rcs", "library.a", "code.o"]):
            subprocess.run([CROSS + command[0], *command[1:]], cwd=tmp_path, check=True)
        return tmp_path / "library.a"
    return make


def test_the_library_has_no_ram():
    assert {name: row[1:] for name, row in size.object_sizes(LIBRARY).items() if any(row[1:])} == {}


def test_the_stack_of_every_function_is_known_and_small():
    rows = {row.name: row for row in size.library_rows(LIBRARY)}
    for name, row in rows.items():
        limit = STACK_MAX.get(name, LIBRARY_STACK_MAX)
        assert row.stack is None or row.stack <= limit, f"{name}: {row.stack} bytes of stack"
    assert all(rows[name].flash > 0 and rows[name].stack is not None for name in STACK_MAX)


def test_the_stack_is_at_least_what_the_compiler_says():
    frames = compiler_frames(BUILD / "arm" / "lib")
    for row in size.library_rows(LIBRARY):
        if row.name in frames and row.stack is not None:
            assert row.stack >= min(frames[row.name]), row.name


def test_stack_of_assembly_with_calls(make_library):
    rows = {row.name: row for row in size.library_rows(make_library(CODE))}
    assert rows["outer"].stack == 2 * 4 + 8 + 3 * 4
    assert rows["inner"].stack == 3 * 4
    assert rows["inner"].flash == 2 + 2 + 2 and rows["outer"].ram == 0


def test_ram_is_seen(make_library):
    data = "    .data\n    .type word, %object\nword: .word 1\n    .size word, 4\n    .bss\n    .space 8\n"
    rows = {row.name: row for row in size.library_rows(make_library(CODE + data))}
    assert rows["outer"].ram == 4 + 8 and rows["word"].flash == 0


def elf_sections(image):
    lines = subprocess.run([CROSS + "size", "-A", image], capture_output=True, text=True, check=True).stdout.splitlines()
    return {line.split()[0]: int(line.split()[1]) for line in lines if line.startswith(".")}


def test_what_was_placed_adds_up_to_the_image():
    """But for gaps. A linker's map may give merged strings the bytes that they had before."""
    placed = Counter()
    for section, _, count in size.contributions(BUILD / "mssfoc.map"):
        placed[section] += count
    whole = elf_sections(BUILD / "mssfoc.elf")
    for section in (*size.IN_FLASH, ".bss"):
        assert 0 <= whole[section] - placed[section] <= max(8, whole[section] // 50), section


@pytest.mark.parametrize("text, count", (
    ("int a /* b + c */ = 0x1Fu; // d\n", 5), ("x->y <<= 'a' + 1.5e3f;", 8), ("#define A(b) \\\n    #b \"c \\\" d\"", 9),
    ("", 0)))
def test_tokens_of_a_source(text, count):
    assert size.tokens(text) == count


@pytest.mark.parametrize("bytes_of_merged", ("0x00000010", "0x00000000"))
def test_strings_that_are_merged_take_nothing(bytes_of_merged, tmp_path):
    (tmp_path / "image.map").write_text(f"""Linker script and memory map

.text           0x00000000       0x2c load address 0x60000000
 .rodata.str1.4
                0x00000000       0x20 a.o
                                 0x10 (size before relaxing)
 .rodata.str1.4
                0x00000020 {bytes_of_merged} b.o
 *fill*         0x00000020        0x4
 .text.c        0x00000024        0x8 c.o

.comment        0x00000000       0x10
""")
    assert list(size.contributions(tmp_path / "image.map")) == [(".text", "a.o", 0x20), (".text", "c.o", 8)]
