# SPDX-License-Identifier: MIT
"""The bound of cycles: exact on sequences counted by hand, an error where there is no bound, above what was measured."""
import os
from dataclasses import replace
from pathlib import Path

import disasm
import numpy as np
import pytest
import wcet
from addresses import Constants, region_of
from longest import Longest
from timing import Costs, Waits, default_waits

BUILD = Path(os.environ.get("BUILD", "build"))
NAKED = "__attribute__((naked, aligned(4))) "
RETURN = 2  # bx lr


def cycles(make_image, body, waits=Waits(), loops=None, extra=""):
    """Cycles of a function made of these instructions and bx lr, without the latter."""
    image = disasm.Image(make_image(f'{extra}{NAKED} int work(int n) {{ __asm("{body}\\n bx lr"); }}')[0])
    longest = Longest(image, lambda f: Costs(waits, Constants(image, f).regions()), loops)
    return longest.cycles(image.functions["work"]) - RETURN


RAM_R1 = "mov.w r1, #0x20000000\\n nop\\n"  # the nop: no address that was just computed
APB_R2 = "mov.w r2, #0x50000000\\n nop\\n"


@pytest.mark.parametrize("body, expected", [
    ("nop\\n adds r0, r0, r1\\n mul r0, r1, r2", 3),
    ("mla r0, r1, r2, r3\\n mls r0, r1, r2, r3", 4),
    ("smull r0, r1, r2, r3\\n umull r0, r1, r2, r3\\n smlal r0, r1, r2, r3\\n umlal r0, r1, r2, r3", 5 + 5 + 7 + 7),
    ("udiv r0, r1, r2\\n sdiv r0, r1, r2", 24),
    (RAM_R1 + "ldr r0, [r1]", 2 + 2),
    (RAM_R1 + "ldr r0, [r1]\\n ldr r3, [r1, #4]\\n ldr r2, [r1, #8]", 2 + 2 + 1 + 1),
    (RAM_R1 + "ldr r0, [r1]\\n ldr r3, [r0]", 2 + 2 + 2),
    (RAM_R1 + "ldr r0, [r1]\\n str r0, [r1, #4]", 2 + 2 + 0),
    (RAM_R1 + "str r0, [r1]\\n str r3, [r1, #4]", 2 + 1 + 1),
    (RAM_R1 + "str r0, [r1]\\n ldr r3, [r1, #4]", 2 + 1 + 1 + 2),
    (RAM_R1 + "str r0, [r1, r3]", 2 + 2),
    (RAM_R1 + "str r0, [r1], #4\\n str r0, [r1]", 2 + 1 + 1 + 1),
    (RAM_R1 + "ldrd r0, r3, [r1]\\n strd r0, r3, [r1]", 2 + 3 + 3),
    (RAM_R1 + "ldmia r1, {r0, r2, r3}", 2 + 1 + 3),
    ("push {r4, r5}\\n pop {r4, r5}", 3 + 3),
    (RAM_R1 + "adds r1, r1, #4\\n ldr r0, [r1]", 2 + 1 + 1 + 2),
    ("ldr r0, [r1]\\n ldr r3, [r2]", 2 + 2),  # where they go is not known: no pairing
    ("cmp r0, #0\\n it eq\\n moveq r0, #1", 1 + 0 + 1),
    ("cmp.w r0, #0\\n it eq\\n moveq r0, #1", 1 + 1 + 1),
    ("b 1f\\n nop\\n 1: nop", 2 + 1),
    ("cmp r0, #0\\n beq 1f\\n nop\\n nop\\n 1: nop", 1 + 1 + 2 + 1),  # not taken is the longer way: 1 + 2, taken 2
    ("cmp r0, #0\\n beq 1f\\n 1: nop", 1 + 2 + 1),
    ("cbz r0, 1f\\n nop\\n 1: nop", 3 + 1),
    ("nop\\n b 1f\\n nop\\n 1: add.w r0, r0, r1", 1 + 2 + 1 + 1),  # on a halfword address
    ("nop\\n b 1f\\n nop\\n nop\\n 1: add.w r0, r0, r1", 1 + 2 + 1),
    ("dsb\\n isb", 4 + 3),
])
def test_counted_by_hand(make_image, body, expected):
    assert cycles(make_image, body) == expected


@pytest.mark.parametrize("body, expected", [
    (APB_R2 + "ldr r0, [r2]\\n ldr r1, [r2, #4]", 2 + (2 + 3) + (1 + 3)),
    (RAM_R1 + "ldr r0, [r1]", 2 + 2),
    ("ldr r0, [r3]", 2 + 7),  # not known: the slowest there is
    ("ldr r0, =0x50001000\\n nop\\n ldr r0, [r0, #8]", 2 + 1 + 2 + 3),
])
def test_wait_cycles(make_image, body, expected):
    assert cycles(make_image, body, Waits(apb_read=3, ppb=7)) == expected


# a write of whoever ran before still takes 5 cycles at the start, and what is posted at the end counts in full
@pytest.mark.parametrize("body, expected", [
    (APB_R2 + "str r0, [r2]\\n str r1, [r2, #4]", 2 + (3 + 1) + (5 + 1) + 5),
    (APB_R2 + "str r0, [r2]\\n nop\\n nop\\n nop\\n ldr r1, [r2, #4]", 2 + (3 + 1) + 3 + (2 + 2)),
    (APB_R2 + "str r0, [r2]\\n mul r0, r0, r1\\n nop\\n nop\\n nop\\n nop\\n ldr r1, [r2, #4]", 2 + (3 + 1) + 5 + 2),
    (APB_R2 + "str r0, [r2]\\n dsb", 2 + (3 + 1) + (5 + 4)),
])
def test_posted_writes(make_image, body, expected):
    assert cycles(make_image, body, Waits(apb_write=5)) == expected


def test_calls_and_tail_calls_add_up(make_image):
    leaf = NAKED + 'int leaf(int n) { __asm("adds r0, r0, r0\\n bx lr"); }\n' + NAKED + \
        'int tail(int n) { __asm("nop\\n b leaf"); }\n'
    expected = 2 + 2 + (1 + 2 + (1 + 2)) + 2 + 1  # the last 1: BX LR directly after LR was written takes 3
    assert cycles(make_image, "nop\\n push {lr}\\n bl tail\\n ldr lr, [sp], #4", extra=leaf) == 1 + expected


def test_the_way_avoided_does_not_count(make_image):
    rare = NAKED + 'int rare(int n) { __asm("udiv r0, r0, r0\\n bx lr"); }\n'
    code = rare + NAKED + 'int work(int n) { __asm("cmp r0, #0\\n beq 1f\\n push {lr}\\n bl rare\\n pop {pc}\\n 1: bx lr"); }'
    image = disasm.Image(make_image(code)[0])
    costs = Costs(Waits(), {})
    assert Longest(image, lambda f: costs, avoid={"rare"}).cycles(image.functions["work"]) == 1 + 2 + RETURN
    assert Longest(image, lambda f: costs).cycles(image.functions["work"]) > 1 + 1 + 2 + 2 + 12 + RETURN


def test_a_loop_needs_a_bound(make_image):
    loop = "movs r1, #4\\n 1: subs r1, r1, #1\\n bne 1b"
    with pytest.raises(disasm.ImageError, match="work has a loop"):
        cycles(make_image, loop)
    assert cycles(make_image, loop, loops={"work": 3}) == 1 + 3 * (1 + 2) + 1 + 1


@pytest.mark.parametrize("body, complaint", [
    ("1: b 1b", "has a loop|never returns"),
    ("push {r4, lr}\\n blx r1\\n pop {r4, pc}", "through a pointer"),
    ("push {r4, lr}\\n bl work\\n pop {r4, pc}", "recursion: work -> work"),
])
def test_no_bound(make_image, body, complaint):
    with pytest.raises(disasm.ImageError, match=complaint):
        cycles(make_image, body)


# ---- the image ---------------------------------------------------------------------------------------------------------

@pytest.fixture(scope="module")
def image():
    return disasm.Image(BUILD / "mssfoc.elf")


HANDLERS = [wcet.HANDLER, *(f"handlers_{source}_ab" for source in (
    "encoder", "forced", "observer", "injection", "hall", "weakening", "overmodulating"))]


def test_the_vector_and_what_may_take_its_place(image):
    found = wcet.handlers(image)
    assert found[0] == HANDLERS[0] and sorted(found) == sorted(HANDLERS)


def test_every_access_of_the_current_loop_is_resolved(image):
    constants = Constants(image, image.functions[wcet.HANDLER])
    unknown = [hex(at) for at, region in constants.regions().items()
               if region is None and "[" in constants.function.code[at].operands]
    assert not unknown
    assert region_of(0xE0001004) == "PPB" and region_of(0x50000108) == "APB"


@pytest.mark.parametrize("number", range(len(HANDLERS)))
def test_the_current_loop_is_free_of_loops_and_a_trip_costs_more(image, number):
    handler = wcet.handlers(image)[number]
    found = wcet.bound(image, Waits(), handler)
    assert 150 < found.latency < found.whole < found.fault
    slower = wcet.bound(image, default_waits(), handler)
    assert found.latency + 4 * 3 <= slower.latency < slower.whole  # two currents and two of the compares, at least


def test_measured_above_the_bound_fails(image, tmp_path, capsys):
    found = wcet.bound(image, Waits())
    smaller = wcet.Bound(found.latency - 1, found.whole - 1, found.fault - 1)

    def written(name, *rows):
        (tmp_path / name).write_bytes(b"t_s,exception,cycles,latency_cycles\n" + np.array(rows, "<f8").tobytes())
        return tmp_path / name

    for whole, latency, fault in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)):
        log = written("irq.bin", (0.1, 30, 99999, 0), (0.2, 50, found.whole + whole, found.latency - 5),
                      (0.3, 50, found.whole - 9, found.latency + latency))
        tripped = written("tripped.bin", (0.1, 50, found.fault + fault, found.latency))
        assert wcet.show({"one": smaller, "other": found}, log, tripped) == whole + latency + fault
    assert "measured: 2 interrupts" in capsys.readouterr().out


@pytest.mark.parametrize("waits", [{"apb_read": 0, "apb_write": 0}, {"apb_read": 7, "apb_write": 11}])
def test_measured_is_below_the_bound_and_near_it(image, tmp_path, waits):
    """The twin prices what it executes, the bound what it reads: two programs, one manual."""
    from launcher import simulate

    result = simulate({"key": "short", "end_s": 0.3, "preamble_s": 0.02, "step": [{"t_s": 0.12, "console": "on"}]},
                      out_dir=tmp_path, cycles=waits, plant="ideal", spread=0)
    whole, latency, count = wcet.measured(result.irqlog)
    chosen = replace(default_waits(), **waits)
    found = wcet.largest([wcet.bound(image, chosen, name) for name in (wcet.HANDLER, "handlers_forced_ab")])  # aligning
    assert count > 5900 and 0.95 * found.latency < latency <= found.latency and 0.95 * found.whole < whole <= found.whole


def test_a_trip_is_below_its_bound(image, tmp_path):
    from launcher import simulate

    result = simulate("fault_overcurrent", out_dir=tmp_path, plant="ideal", spread=0)
    whole, _, _ = wcet.measured(result.irqlog)
    found = [wcet.bound(image, default_waits(), name) for name in wcet.handlers(image)]
    assert found[0].whole < whole <= wcet.largest(found).fault
