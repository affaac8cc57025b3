# SPDX-License-Identifier: MIT
"""Cycles instruction by instruction: counted by hand, with their reasons, and together what the bound and the twin say."""
import os
from pathlib import Path

import disasm
import listing
import pytest
import remarks
from bench.report import baseline

BUILD = Path(os.environ.get("BUILD", "build"))
NAKED = "__attribute__((naked, aligned(4))) "


@pytest.fixture
def listed(make_image):
    """listed(instructions) -> [Step] of a function made of them and bx lr, without the latter."""
    def of(body):
        image = disasm.Image(make_image(f'{NAKED} int work(int n) {{ __asm("{body}\\n bx lr"); }}')[0])
        return listing.steps(image, image.functions["work"])[:-1]
    return of


@pytest.mark.parametrize("body, cycles, kinds", [
    ("ldr r2, [r0]\\n ldr r3, [r0, #4]\\n str r2, [r1]", [2, 1, 0], [listing.LOAD, listing.LOAD, listing.STORE]),
    ("movw r2, #1234\\n movt r2, #5678\\n smull r2, r3, r0, r1", [1, 1, 5], [listing.CONSTANT] * 2 + [listing.PRODUCT]),
    ("mls r0, r1, r2, r3\\n mul r0, r1, r2", [2, 1], [listing.PRODUCT] * 2),
    ("smlal r2, r3, r0, r1\\n mla r0, r1, r2, r3\\n muls r0, r1, r0", [7, 2, 1], [listing.PRODUCT] * 3),
    ("adds r0, r0, r1\\n itt vs\\n movvs r0, #0\\n addvs r0, r0, r1", [1, 0, 1, 1], [listing.DATA] + [listing.CONDITION] * 3),
    ("add.w r0, r0, r1\\n it vs\\n movvs r0, #0", [1, 1, 1], [listing.DATA] + [listing.CONDITION] * 2),
    ("push {r4, r5}\\n pop {r4, r5}", [3, 3], [listing.STORE, listing.LOAD]),
    ("b 1f\\n nop\\n 1: nop", [2, 1], [listing.FLOW, listing.OTHER]),
    ("adds r1, r1, r0\\n ldr r0, [r1]", [1, 3], [listing.DATA, listing.LOAD]),
    ("str r0, [r1]\\n ldr r0, [r1, #4]", [1, 3], [listing.STORE, listing.LOAD]),
])
def test_counted_by_hand(listed, body, cycles, kinds):
    found = listed(body)
    assert [step.cycles for step in found] == cycles
    assert [step.kind for step in found] == kinds


@pytest.mark.parametrize("body, reasons", [
    ("ldr r2, [r0]\\n ldr r3, [r0, #4]\\n str r2, [r1]", ["load: address, data", "load behind a load", "store behind a load"]),
    ("adds r1, r1, r0\\n ldr r0, [r1]", ["", "load: address, data; +1 address just computed"]),
    ("str r0, [r1]\\n ldr r0, [r1, #4]", ["store", "load: address, data; +1 store before"]),
    ("add.w r0, r0, r1\\n it vs\\n movvs r0, #0", ["", "behind 32 bits", "also when skipped"]),
    ("b 1f\\n nop\\n 1: nop", ["taken: refill", ""]),
])
def test_reasons(listed, body, reasons):
    assert [step.why for step in listed(body)] == reasons


def test_every_cycle_above_one_has_a_reason(listed):
    body = ("push {r4}\\n ldr r2, [r0]\\n smull r2, r3, r0, r1\\n mla r0, r1, r2, r3\\n sdiv r0, r1, r2\\n strd r0, r1, [r2]\\n"
            " ldm r1, {r0, r2}\\n pop {r4}")
    assert all(step.why for step in listed(body) if step.cycles != 1)


def test_a_load_of_the_pc_waits_for_the_store_before(listed, make_image):
    code = f'{NAKED} int work(int n) {{ __asm("push {{lr}}\\n str r0, [r1]\\n ldr pc, [sp], #4"); }}'
    image = disasm.Image(make_image(code)[0])
    assert [step.cycles for step in listing.steps(image, image.functions["work"])] == [2, 1, 5 + 1]


def test_calls_have_what_is_inside(make_image):
    code = f'{NAKED} int two(int n) {{ __asm("nop\\n nop\\n bx lr"); }} int two(int n);'
    code += f'{NAKED} int work(int n) {{ __asm("push {{lr}}\\n bl two\\n pop {{pc}}"); }}'
    image = disasm.Image(make_image(code)[0])
    found = listing.steps(image, image.functions["work"])
    assert [step.cycles for step in found] == [2, 2 + 4, 1 + 1 + 3] and "4 in two" in found[1].why


def test_between_two_readings_of_the_counter(make_image):
    code = (f'{NAKED} int work(int n) {{ __asm("ldr r3, =0xe0001000\\n adds r1, r1, #1\\n ldr r2, [r3, #4]\\n mul r0, r0, r0\\n'
            ' adds r0, r0, r1\\n ldr r1, [r3, #4]\\n subs r0, r1, r2\\n bx lr"); }')
    image = disasm.Image(make_image(code)[0])
    function = image.functions["work"]
    found = listing.between_readings(image, function, listing.steps(image, function))
    assert [step.text for step in found] == ["mul r0, r0, r0", "adds r0, r0, r1"]
    with pytest.raises(disasm.ImageError, match="twice"):
        listing.between_readings(image, function, listing.steps(image, function)[:4])


def test_the_source_beside_an_instruction(make_image):
    image = disasm.Image(make_image("int work(int n) { return n * 77; }")[0])
    start = image.functions["work"].start
    assert listing.Sources(image, [start]).chain(start)[0][0] == "work"
    sources = listing.Sources(image, [])
    assert sources.line("lib/Lib.h", 1).startswith("/* SPDX") and sources.line("../outside", 1) == ""


def test_command(capsys):
    listing.main(str(BUILD / "bench.elf"), "Clarke_Lib_Do")
    out = capsys.readouterr().out.splitlines()
    cycles = [int(line.split()[0]) for line in out]
    assert len(out) > 10 and sum(cycles[:-1]) == cycles[-1]
    with pytest.raises(disasm.ImageError, match="no function"):
        listing.main(str(BUILD / "bench.elf"), "Nothing_Lib_Do")


def test_listings_are_what_is_measured():
    """The bench's figures of the last `make bench`: the same instructions, executed by the twin on all its data."""
    import cycles_page
    figures = baseline()
    image = disasm.Image(BUILD / "bench.elf")
    rows = [*cycles_page.LIBRARY, *cycles_page.kernel_rows(image, figures)]
    listings = {row: cycles_page.counted(image, row)[1] for row in rows}
    assert len(rows) > 10 and listings == {row: figures[row]["cycles_max"] for row in rows}
    alone = {row: sum(step.cycles for step in cycles_page.in_registers(image, row)) for row in figures if ".registers" in row}
    assert alone == {row: figures[row]["cycles_max"] for row in alone}


SOURCE = """
    .macro  rotate first, second
    ldr     r2, [r0]            @ 2  the x
    .ifc    \\first, r3
    smull   r12, r3, \\first, r12 @ 5  y cos
    .else
    smull   r2, r12, \\first, r12 @ 5  x cos
    .endif
    rsbs    r0, \\second, #0     // 1
    .endm
"""


@pytest.mark.parametrize("call, instruction, expected", [
    ("rotate r2, r5", "ldr r2, [r0, #0]", "the x"),
    ("rotate first=r3, second=r5", "smull ip, r3, r3, ip", "y cos"),
    ("rotate first=r2, second=r5", "smull r2, ip, r2, ip", "x cos"),
    ("rotate first=r2, second=r5", "negs r0, r5", ""),
    ("rotate first=r2, second=r5", "adds r0, r5", ""),
    ("other r2", "ldr r2, [r0, #0]", ""),
])
def test_remarks_of_a_macro(call, instruction, expected):
    lines = SOURCE.replace("\\\\", "\\").split("\n")
    assert remarks.of_macro(call, lines, instruction) == expected


@pytest.mark.parametrize("line, expected", [
    ("ldr r0, [r1]   @ 2  ia", "ia"), ("bx lr @ 2", ""), ("bx lr", ""), ("adds r0, r1 /* 1 C = odd */", "C = odd"),
    ("adds r0, r1 @ half = ib", "half = ib")])
def test_remarks(line, expected):
    assert remarks.remark(line) == expected
