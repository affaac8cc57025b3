# SPDX-License-Identifier: MIT
"""Small images for the tools that work out bounds: a vector table, two stacks, and the code a test gives."""
import os
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent))

CROSS = os.environ.get("CROSS", "arm-none-eabi-")
CPU = ["-mcpu=cortex-m3", "-mthumb"]
SCRIPT = """
ENTRY(Reset_Handler)
LINK_STACK_SIZE = DEFINED(LINK_STACK_SIZE) ? LINK_STACK_SIZE : 1024;
SECTIONS {
    .text 0 : { KEEP(*(.vectors)) *(.text*) *(.rodata*) }
    .stack 0x20000000 (NOLOAD) : {
        link_stack_limit = .; . += LINK_STACK_SIZE; link_stack_top = .;
        link_fault_stack_limit = .; . += 256; link_fault_stack_top = .;
    }
    .data : { *(.data*) } .bss : { *(.bss*) }
}
"""
START = """
#define USED __attribute__((used))
void Reset_Handler(void); void Fault(void); void Slow(void); void Fast(void); void Fast2(void); int work(int n);
extern char link_stack_top[];
USED __attribute__((section(".vectors"))) const void *const vectors[20] = {
    link_stack_top, Reset_Handler, Fault, Fault, Fault, Fault, Fault, 0, 0, 0, 0, Fault, Fault, 0, Fault, Fault,
    Slow, Fast, Fault, Fast2 };
__attribute__((weak)) void Fault(void) { for (;;) { } }
__attribute__((weak)) void Slow(void) { }
__attribute__((weak)) void Fast(void) { }
__attribute__((weak)) void Fast2(void) { }
void Reset_Handler(void) { for (;;) { work(1); } }
"""


@pytest.fixture
def make_image(tmp_path):
    """make_image(C text) -> (path of the ELF, folder of its objects)."""
    def make(code, link=()):
        (tmp_path / "start.c").write_text(START)
        (tmp_path / "code.c").write_text(code)
        (tmp_path / "image.ld").write_text(SCRIPT)
        subprocess.run([CROSS + "gcc", *CPU, "-O1", "-g", "-ffreestanding", "-fstack-usage", "-fcallgraph-info=su",
                        "-c", "start.c", "code.c"], cwd=tmp_path, check=True)
        subprocess.run([CROSS + "gcc", *CPU, "-nostdlib", "-T", "image.ld", "-Wl,--no-warn-rwx-segments", *link, "start.o",
                        "code.o", "-lgcc", "-o", "image.elf"], cwd=tmp_path, check=True)
        return tmp_path / "image.elf", tmp_path
    return make
