# SPDX-License-Identifier: MIT
"""The image is what it says: one content in every format, vectors in place, nothing in it that should not be."""
import os
import re
import subprocess
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile

BUILD = Path(os.environ.get("BUILD", "build"))
CROSS = os.environ.get("CROSS", "arm-none-eabi-")
ENVM = 0x60000000


def read_hex(path):
    """{address: byte} of an Intel HEX file, every checksum verified."""
    memory, upper = {}, 0
    for line in path.read_text().split():
        raw = bytes.fromhex(line[1:])
        assert line[0] == ":" and sum(raw) & 0xFF == 0, f"{path}: bad record {line}"
        count, offset, kind, data = raw[0], int.from_bytes(raw[1:3], "big"), raw[3], raw[4:-1]
        assert len(data) == count
        if kind == 0:
            memory.update({upper + offset + i: byte for i, byte in enumerate(data)})
        elif kind == 4:
            upper = int.from_bytes(data, "big") << 16
        elif kind == 2:
            upper = int.from_bytes(data, "big") << 4
    return memory


@pytest.fixture(scope="module")
def image():
    return (BUILD / "mssfoc.bin").read_bytes()


def test_every_format_has_the_same_content(image):
    flat = read_hex(BUILD / "mssfoc.hex")
    envm = read_hex(BUILD / "mssfoc-envm.hex")
    assert min(flat) == 0 and min(envm) == ENVM
    assert {address + ENVM: byte for address, byte in flat.items()} == envm
    # objcopy fills gaps between sections in the binary with zeros
    assert bytes(flat.get(i, 0) for i in range(len(image))) == image and max(flat) == len(image) - 1


def test_fits_the_usable_envm(image):
    assert len(image) <= 240 * 1024  # then come the settings, and what is reserved


def symbols():
    with open(BUILD / "mssfoc.elf", "rb") as stream:
        return {symbol.name: symbol["st_value"] for symbol in ELFFile(stream).get_section_by_name(".symtab").iter_symbols()}


def test_the_slots_of_the_settings_are_pages_that_are_free(image):
    """No file that is flashed has anything there, and neither the device nor a design's protection keeps it: of every device
    with 256 KB the sectors from 0x3E000 on are the device's, or can be protected."""
    start, second, end = (symbols()["link_settings_" + name] - ENVM for name in ("start", "slot_1", "end"))
    assert start % 4096 == 0 and second - start == end - second == 4096
    assert len(image) <= start and end <= 0x3E000
    assert not [at for at in read_hex(BUILD / "mssfoc.hex") if at >= start]


def test_what_runs_while_the_envm_is_busy_needs_nothing_of_it(image):
    """Programming a page, from the command to the controller on: calls and constants are in eSRAM, all of them."""
    known = symbols()
    start, end = known["link_data_start"], known["link_data_end"]
    out = subprocess.run([CROSS + "objdump", "-d", "-j", ".data", BUILD / "mssfoc.elf"], capture_output=True, text=True,
                         check=True).stdout
    functions = re.findall(r"(?m)^([0-9a-f]{8}) <(\w+)>:", out)
    assert {"command", "with_wait_states", "program_and_verify"} <= {name for _, name in functions}
    assert all(start <= int(at, 16) < end for at, _ in functions)
    branches = re.findall(r"\tb(?:l|\w{2})?(?:\.[nw])?\s+([0-9a-f]{8})\b|\tcbn?z\s+r\d+, ([0-9a-f]{8})", out)
    targets = [int(a or b, 16) for a, b in branches]
    assert len(targets) > 20 and all(start <= target < end for target in targets)
    assert not re.search(r"\tblx|\ttb[bh]|\tldr(?:\.w)?\s+pc", out)
    words = [int(word, 16) for word in re.findall(r"\.word\s+0x([0-9a-f]{8})", out)]
    assert words and not [word for word in words if word < len(image) or 0x60000000 <= word < 0x60080000]


CACHE_BYTES = 8192  # what drivers/mss/cache.h locks
TIMED = ("FabricIrq0_IRQHandler", "scoped_tick", "fault_entry", "fault_taken", "current_loop_fault",
         "drive_sample_fault", "fault_latch", "fault_raise_with", "polar_roots")


def test_what_must_not_wait_stands_where_the_cache_is_locked():
    with open(BUILD / "mssfoc.elf", "rb") as stream:
        table = ELFFile(stream).get_section_by_name(".symtab").iter_symbols()
        found = {s.name: (s["st_value"] & ~1, s["st_size"]) for s in table if s["st_size"]}
    handlers = [name for name in found if re.fullmatch(r"handlers_\w+_ab", name)]
    assert len(handlers) >= 3
    for name in (*TIMED, *handlers):
        assert sum(found[name]) <= CACHE_BYTES, name
    assert found["trig_chords"][0] >> 28 == 2, "of any angle: in eSRAM"
    # what they call on the usual way: nothing that lies behind
    out = subprocess.run([CROSS + "objdump", "-d", "--no-show-raw-insn", "--stop-address=0x2000", BUILD / "mssfoc.elf"],
                         capture_output=True, text=True, check=True).stdout
    parts = dict(re.findall(r"(?ms)^[0-9a-f]+ <(\w+)>:\n(.*?)(?=^[0-9a-f]+ <|\Z)", out))
    for name in ("FabricIrq0_IRQHandler", *handlers):
        called = {int(at, 16) for at in re.findall(r"\tblx?(?:\.w)?\s+([0-9a-f]+)\b", parts[name])}
        assert all(at < CACHE_BYTES for at in called), name


def test_what_room_they_leave_in_the_cache_is_the_slow_loops():
    script = Path("linker/m2s010.ld").read_text()
    named = set(re.findall(r"\.text\.(\w+)", re.search(r"(?s)link_timed_end = .*link_slow_loop_end = ", script).group()))
    with open(BUILD / "mssfoc.elf", "rb") as stream:
        symbols = list(ELFFile(stream).get_section_by_name(".symtab").iter_symbols())
    start, end = (next(s["st_value"] for s in symbols if s.name == name) for name in ("link_timed_end", "link_slow_loop_end"))
    behind = {s.name.split(".")[0] for s in symbols
              if s["st_info"]["type"] == "STT_FUNC" and start <= s["st_value"] < end}
    assert behind == named, "a name that fits no function leaves the room to whatever is linked next"


def test_vectors(image):
    words = [int.from_bytes(image[i:i + 4], "little") for i in range(0, 98 * 4, 4)]
    assert 0x20000000 < words[0] <= 0x20010000 and words[0] % 8 == 0
    assert all(word & 1 and word < len(image) for number, word in enumerate(words[1:], 1) if number not in RESERVED)
    with open(BUILD / "mssfoc.elf", "rb") as stream:
        symbols = ELFFile(stream).get_section_by_name(".symtab")
        for number, name in {1: "Reset_Handler", 26: "UART0_IRQHandler", 30: "Timer1_IRQHandler",
                             50: "FabricIrq0_IRQHandler"}.items():
            assert words[number] & ~1 == symbols.get_symbol_by_name(name)[0]["st_value"] & ~1, name


RESERVED = {7, 8, 9, 10, 13}


def test_no_word_of_an_emulator(image):
    text = image.decode("latin-1").lower()
    assert not re.search(r"qemu|semihost|emulat|simulat", text)
    code = subprocess.run([CROSS + "objdump", "-d", BUILD / "mssfoc.elf"], capture_output=True, text=True, check=True)
    assert not re.search(r"\bbkpt\b", code.stdout)


def test_no_floating_point_heap_or_foreign_code():
    out = subprocess.run([CROSS + "nm", BUILD / "mssfoc.elf"], capture_output=True, text=True, check=True).stdout
    names = {line.split()[-1] for line in out.splitlines()}
    assert not {n for n in names if re.match(r"__aeabi_([fd]\w+|u?[il]2[fd]|ul2[fd])|malloc|free|_sbrk|printf", n)}
    # all that the compiler's run-time library gives: 64-bit division
    foreign = {n for n in names if n.startswith("__") and not n.startswith("__aeabi_")}
    # and what the linker puts between eNVM and eSRAM
    assert foreign <= {"__udivmoddi4", "__divdi3", "__udivdi3", "__with_wait_states_veneer", "__cache_lock_veneer"}, foreign


def test_the_library_has_no_data_of_its_own():
    out = subprocess.run([CROSS + "size", "-t", BUILD / "libmssfoc.a"], capture_output=True, text=True, check=True).stdout
    text, data, bss = out.strip().splitlines()[-1].split()[:3]
    assert int(text) > 0 and (data, bss) == ("0", "0")


def test_two_builds_are_identical(tmp_path, image):
    subprocess.run(["make", "-s", "-j2", f"BUILD={tmp_path}/again", "all"], check=True, capture_output=True)
    assert (tmp_path / "again" / "mssfoc.bin").read_bytes() == image


# what must be at a fixed place, because an interrupt or a reset enters there; all other state lives in what is passed on
STATE = {
    "axes": "the axes, which the interrupts' handlers name",
    "axes_heat": "what the motors have kept of heat, which outlives a reset",
    "startup_vectors": "the vector table that the core reads",
    "scope": "the scope, which the current loop's and the sampler's interrupts name",
    "uart": "the console's UART, which its interrupt serves",
    "modbus": "the slave on the bus, whose buffers would take a sixth of the stack",
    "can": "the CAN controller's queues, which its interrupt fills and empties",
    "canopen": "the node on that bus, as modbus",
    "bus": "the bus's UART and transceiver, which their interrupts serve",
    "kept": "the post-mortem record, which outlives a reset",
    "trig_chords": "no state: the sine's table, which would not fit the cache",
}


def test_there_is_no_other_state_than_what_has_a_reason():
    with open(BUILD / "mssfoc.elf", "rb") as stream:
        symbols = ELFFile(stream).get_section_by_name(".symtab")
        objects = {symbol.name for symbol in symbols.iter_symbols()
                   if symbol["st_info"]["type"] == "STT_OBJECT" and symbol["st_value"] >= 0x20000000}
    assert objects == set(STATE)
