# SPDX-License-Identifier: MIT
"""What a debugger needs to see the caller of a function: where the frame is and where registers were saved, at every
instruction of it, and no other name in its middle. The handler in assembly says so by hand."""
import os
from pathlib import Path

import disasm
import pytest
import wcet
from elftools.dwarf.callframe import FDE
from elftools.elf.elffile import ELFFile

BUILD = Path(os.environ.get("BUILD", "build"))
SP, LR = 13, 14
PUSHED = (*range(4, 12), LR)


@pytest.fixture(scope="module")
def elf():
    with open(BUILD / "mssfoc.elf", "rb") as stream:
        yield ELFFile(stream)


@pytest.fixture(scope="module")
def image():
    return disasm.Image(BUILD / "mssfoc.elf")


@pytest.fixture(scope="module")
def frames(elf):
    return [entry for entry in elf.get_dwarf_info().CFI_entries() if isinstance(entry, FDE)]


def described(frames, address):
    for entry in frames:
        start = entry["initial_location"]
        if start <= address < start + entry["address_range"]:
            return entry
    return None


def row_at(rows, address):
    """The rules in effect before the instruction at an address is executed."""
    return [row for row in rows if row["pc"] <= address][-1]


def test_the_frame_of_the_handler_at_every_instruction(frames, image):
    handler = image.functions[wcet.HANDLER]
    rows = described(frames, handler.start).get_decoded().table
    first, *inside = sorted(handler.code)
    last_pop = max(a for a in inside if handler.code[a].mnemonic.startswith(("pop", "ldm")))
    for address in inside:
        row = row_at(rows, address)
        if address > last_pop:  # on the way to the fault's cause
            assert (row["cfa"].reg, row["cfa"].offset) == (SP, 0)
            continue
        assert (row["cfa"].reg, row["cfa"].offset) == (SP, 4 * len(PUSHED)), hex(address)
        assert [row[register].arg for register in PUSHED] == [4 * n - 36 for n in range(len(PUSHED))]
    assert row_at(rows, first)["cfa"].offset == 0


@pytest.mark.parametrize("name", [wcet.HANDLER, "handlers_forced_ab", "Timer1_IRQHandler", "drive_step", "current_loop_fault"])
def test_every_function_on_the_way_is_described_to_its_end(frames, image, name):
    function = image.functions[name]
    entry = described(frames, function.start)
    assert entry is not None and entry["initial_location"] == function.start
    assert function.start + entry["address_range"] > max(function.code)


def test_no_name_in_the_middle_of_the_handler(elf, image):
    handler = image.functions[wcet.HANDLER]
    end = max(handler.code)
    names = [symbol.name for symbol in elf.get_section_by_name(".symtab").iter_symbols()
             if handler.start < symbol["st_value"] & ~1 <= end and not symbol.name.startswith("$")
             and symbol["st_info"]["type"] in ("STT_FUNC", "STT_NOTYPE") and isinstance(symbol["st_shndx"], int)]
    assert not names
