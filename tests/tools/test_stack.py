# SPDX-License-Identifier: MIT
"""The stack bound: right on images whose depth is known, refused where there is none, and not below what was measured."""
import os
import re
import subprocess
from pathlib import Path

import crosscheck
import disasm
import entries
import frames
import highwater
import pytest
import stack

BUILD = Path(os.environ.get("BUILD", "build"))
PRIORITIES = {16: 8, 17: 0, 19: 0}  # of Slow, Fast and Fast2 in the small images
CROSS = os.environ.get("CROSS", "arm-none-eabi-")


def bounds_of(image_and_objects, priorities=None):
    image = disasm.Image(image_and_objects[0])
    return stack.bounds(image, PRIORITIES if priorities is None else priorities)


def row(found, name):
    return next(r for r in found.rows if r.name == name)


def test_depths_add_up_along_the_deepest_chain_only(make_image):
    found = bounds_of(make_image("""
__attribute__((naked, noinline)) int shallow(int n) { __asm("push {r4, lr}\\n pop {r4, pc}"); }
__attribute__((naked, noinline)) int deep(int n) { __asm("push {r4, lr}\\n sub sp, #100\\n bl shallow\\n add sp, #100\\n"
                                                         "pop {r4, pc}"); }
__attribute__((naked, noinline)) int work(int n) { __asm("push {r4, r5, r6, lr}\\n bl shallow\\n pop {r4, r5, r6, lr}\\n"
                                                         "push {r4, lr}\\n bl deep\\n pop {r4, pc}"); }
"""))
    # Reset_Handler pushes 8; work 8 at its call of deep, not the 16 of its own maximum; deep 8 + 100; shallow 8
    assert row(found, "Reset_Handler").own == 8 + 8 + 108 + 8
    assert row(found, "Reset_Handler").chain == ("Reset_Handler", "work", "deep", "shallow")


def test_a_load_through_the_stack_pointer_leaves_it(make_image):
    """As GCC 14 reads two words there; with the address written back it would be a release."""
    code = '__attribute__((naked)) int work(int n) {{ __asm("sub sp, #8\\n ldmia sp{}, {{r0, r1}}\\n add sp, #{}\\n bx lr"); }}'
    assert row(bounds_of(make_image(code.format("", 8))), "Reset_Handler").chain[-1] == "work"
    assert row(bounds_of(make_image(code.format("!", 0))), "Reset_Handler").chain[-1] == "work"
    with pytest.raises(disasm.ImageError, match="leaves 8 bytes"):
        bounds_of(make_image(code.format("", 0)))


@pytest.mark.parametrize("branch", (
    "tbb [pc, r0]\\n 9: .byte (1f - 9b) / 2, (2f - 9b) / 2",
    "adr r1, 9f\\n ldr pc, [r1, r0, lsl #2]\\n .balign 4\\n 9: .word 1f + 1, 2f + 1"))
def test_every_way_of_a_branch_table_counts(make_image, branch):
    """The second as -Os makes them."""
    found = bounds_of(make_image('__attribute__((naked)) int work(int n) { __asm("push {r4, lr}\\n .balign 4\\n' + branch +
                                 '\\n .balign 2\\n 1: pop {r4, pc}\\n 2: sub sp, #60\\n add sp, #60\\n b 1b"); }'))
    assert row(found, "Reset_Handler").own == 8 + 8 + 60


def test_nesting_by_priority(make_image):
    handlers = "".join(f'__attribute__((naked)) void {name}(void) {{ __asm("sub sp, #{size}\\n add sp, #{size}\\n bx lr"); }}\n'
                       for name, size in (("Slow", 40), ("Fast", 16), ("Fast2", 24)))
    found = bounds_of(make_image("int work(int n) { return n; }\n" + handlers))
    thread = row(found, "Reset_Handler").own
    assert row(found, "Slow").nested == thread + 36 + 40
    assert row(found, "Fast").nested == thread + 36 + 40 + 36 + 16
    # Fast and Fast2 have one priority: only one of them is on the stack; then a fault's frame
    assert found.main == thread + 36 + 40 + 36 + 24 + 36


def test_equal_priorities_do_not_nest(make_image):
    handlers = '__attribute__((naked)) void Slow(void) { __asm("sub sp, #40\\n add sp, #40\\n bx lr"); }'
    found = bounds_of(make_image("int work(int n) { return n; }\n" + handlers), {16: 4, 17: 4, 19: 4})
    assert found.main == row(found, "Reset_Handler").own + 36 + 40 + 36


def test_a_handler_without_priority_is_refused(make_image):
    with pytest.raises(disasm.ImageError, match="Fast has a vector but no priority"):
        bounds_of(make_image("int work(int n) { return n; }"), {16: 8, 19: 0})


@pytest.mark.parametrize("code, complaint", [
    ("int work(int n) { return n < 2 ? 1 : n * work(n - 1) + 1; }", "recursion: work -> work"),
    ("int other(int n); __attribute__((noipa)) int work(int n) { return n ? other(n - 1) + 1 : 0; }\n"
     "__attribute__((noipa)) int other(int n) { return work(n / 2) + 3; }", "recursion: work -> other -> work"),
    ("int (*hook)(int); int work(int n) { return hook(n) + 1; }", "work calls through a pointer"),
    ("int work(int n) { volatile char room[n]; room[0] = 1; return room[0]; }", "amount that is not a constant"),
    ("__attribute__((naked)) int work(int n) { __asm(\"push {r4}\\n cmp r0, #0\\n beq 1f\\n push {r5}\\n 1: b 1b\"); }",
     "depending on the way"),
    ("__attribute__((naked)) int work(int n) { __asm(\"push {r4}\\n bx lr\"); }", "leaves 4 bytes on the stack"),
])
def test_refused(make_image, code, complaint):
    with pytest.raises(disasm.ImageError, match=complaint):
        bounds_of(make_image(code))


@pytest.mark.parametrize("names", ("table", "tab*"))
def test_a_table_of_pointers_is_followed_only_if_constant(make_image, monkeypatch, names):
    monkeypatch.setitem(frames.POINTER_TABLES, "work", names)
    code = """
static __attribute__((naked)) int small(int n) { __asm("push {r4}\\n pop {r4}\\n bx lr"); }
static __attribute__((naked)) int large(int n) { __asm("sub sp, #80\\n add sp, #80\\n bx lr"); }
%s struct { int key; int (*run)(int); } table[] = { { 1, small }, { 3, large } };
int work(int n) { return table[n & 1].run(n) + 1; }
"""
    found = bounds_of(make_image(code % "extern const int no; const"))
    assert row(found, "Reset_Handler").chain[-1] == "large"
    with pytest.raises(disasm.ImageError, match="not constant"):
        bounds_of(make_image(code % ""))


def test_what_the_compiler_says_must_agree(make_image):
    path, folder = make_image("int work(int n) { volatile int a[8]; a[0] = n; return a[0]; }")
    image, usage = disasm.Image(path), folder / "code.su"
    assert crosscheck.check_against_compiler(image, folder) == 6
    usage.write_text(re.sub(r"(:work\t)\d+", r"\g<1>96", usage.read_text()))
    with pytest.raises(disasm.ImageError, match=r"work: \d+ bytes of stack in the image, \[96\] by the compiler"):
        crosscheck.check_against_compiler(image, folder)


def test_a_frame_without_a_fixed_size_is_refused_by_the_compilers_word_too(make_image):
    path, folder = make_image("int work(int n) { volatile char room[n]; room[0] = 1; return room[0]; }")
    with pytest.raises(disasm.ImageError, match="the frame of work is dynamic"):
        crosscheck.check_against_compiler(disasm.Image(path), folder)


def test_too_deep_does_not_fit(make_image):
    deep = "int work(int n) { volatile int space[250]; space[n] = 1; return space[0]; }"
    assert not bounds_of(make_image(deep)).fits
    assert bounds_of(make_image(deep, link=["-Wl,--defsym=LINK_STACK_SIZE=2048"])).fits


# ---- the image itself ------------------------------------------------------------------------------------------------

@pytest.fixture(scope="module")
def image():
    return disasm.Image(BUILD / "mssfoc.elf")


def test_every_entry_point_of_the_image_has_a_bound(image):
    found = stack.bounds(image, entries.source_priorities())
    names = [r.name for r in found.rows]
    assert names[:8] == ["Reset_Handler", "UART0_IRQHandler", "UART1_IRQHandler", "Timer2_IRQHandler", "Timer1_IRQHandler",
                         "CAN_IRQHandler", "I2C1_SMBus_IRQHandler", "FabricIrq0_IRQHandler"]
    assert found.fits and "fault_taken" in found.rows[-1].chain
    assert crosscheck.check_against_compiler(image, BUILD / "arm") > 60


def test_priorities_are_the_compilers_view(image):
    assert entries.source_priorities() == {25: 2, 26: 8, 27: 8, 30: 4, 31: 8, 32: 3, 50: 0, 51: 0}


@pytest.mark.parametrize("symbol, size", [("LINK_STACK_BOUND", 1024), ("LINK_FAULT_STACK_BOUND", 256)])
def test_the_linker_refuses_what_does_not_fit(tmp_path, symbol, size):
    objects = [str(p) for room in ("startup", "drivers", "firmware") for p in sorted((BUILD / "arm" / room).rglob("*.o"))
               if list(p.parent.relative_to(BUILD / "arm").glob(f"{p.stem}.[cS]"))]
    link = [CROSS + "gcc", "-mcpu=cortex-m3", "-mthumb", "-nostdlib", "-T", "linker/m2s010.ld", "-Wl,--gc-sections", *objects,
            str(BUILD / "libmssfoc.a"), "-lgcc", "-o", str(tmp_path / "image.elf"),
            "-Wl,--defsym=LINK_STACK_SIZE=1024,--defsym=LINK_FAULT_STACK_SIZE=256"]
    for bound, refused in ((size, False), (size + 1, True)):
        done = subprocess.run([*link, f"-Wl,--defsym={symbol}={bound}"], capture_output=True, text=True, check=False)
        assert (done.returncode != 0) == refused and ("worst-case" in done.stderr) == refused, done.stderr


def test_high_water_mark_is_below_the_bound(image, tmp_path):
    mark, result = highwater.measure(image, tmp_path)
    found = stack.bounds(image, entries.source_priorities())
    assert result.console.count("ok\n") > 25
    assert result.enums["fault"][int(result.trace["fault"][-1])] == "FAULT_ENCODER"
    assert found.main / 3 < mark <= found.main


def test_reading_of_paint():
    paint = highwater.PAINT
    assert highwater.used(paint * 8) == 0
    assert highwater.used(paint * 4 + b"\0\0\0\0" + paint * 3) == 16
