# SPDX-License-Identifier: MIT
"""`make bringup`: the image on the twin is as docs/silicon.md documents, step by step, and says so; a device that is made
otherwise is named."""
import os
import random
import re
import struct
import subprocess
import sys
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile

from launcher import bringup
from launcher.errors import LauncherError
from launcher.ranges import load_ranges
from rigs import flash_bits
from silicon import facts

ROOT = facts.ROOT
BUILD = (ROOT / os.environ.get("BUILD", "build")).resolve()
LINE = re.compile(r"(B\d\d) (.{40})(\S+) +(?:documented (\S+)|nothing documented)(   DIFFERS)?")
ENDED = re.compile(r"(B\d\d ended in a reset): .*   DIFFERS")
NUMBER = r"0x[0-9A-Fa-f]+|\d+"
RANGE = re.compile(rf"(?<![\w.])({NUMBER})(?:\.\.\.({NUMBER}))?(?![\w.]*\w)")
BITS_A_CHARACTER, BAUD = 10, 115200
ENVM_ARRAY, PAGE_BYTES = 0x60000000, 128
SETTINGS = 0x3A000  # docs/settings.md: what the drive keeps, of both axes
UNTIL_B18 = re.compile(r"(?m)^B18 RESET_SOURCE_CR.*\r?\n(?:.*\n)*?(as documented|not as documented: \d+)\r?$")


def play(tmp_path, *lines, wrong=None, **how):
    return bringup.play([*bringup.lines_of(wrong), *lines], BUILD, os.environ.get("QEMU"), tmp_path, **how).replace("\r", "")


def named(page):
    """What the page marks as different, as it stands in its lines."""
    found = [f"{m[1]} {m[2].rstrip()}" for m in map(LINE.fullmatch, page.split("\n")) if m and m[5]]
    return found + [m[1] for m in map(ENDED.fullmatch, page.split("\n")) if m]


def ranges(text):
    """{(least, largest)} of the numbers in a text; what stands in parentheses explains."""
    found = RANGE.findall(re.sub(r"\([^)]*\)", "", text))
    return {(int(least, 0), int(largest or least, 0)) for least, largest in found}


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    return play(tmp_path_factory.mktemp("documented"))


@pytest.fixture(scope="module")
def rows():
    """{step: row of the page's table}"""
    return {row[0]: row for row in facts.tables(facts.PAGE.read_text(), facts.STEPS)}


def test_the_device_as_documented_is_found_so(page):
    assert not named(page)
    assert page.rstrip().split("\n")[-2:] == [
        "Send us this page, whole: it is what we know of your device (docs/silicon.md).", "as documented"]


@pytest.mark.parametrize("end", (0, 2), ids=("least", "most"))
def test_so_is_one_at_either_end_of_every_range(end, tmp_path):
    lines = [f"cycles.{key} {values[end]}" for key, values in load_ranges().items()]
    assert not named(play(tmp_path, *lines))


def test_each_step_of_the_page_is_printed_and_no_other(page, rows):
    printed = [line[:3] for line in page.split("\n") if re.match(r"B\d\d ", line)]
    assert list(dict.fromkeys(printed)) == list(rows)
    assert not [line for line in page.split("\n") if line.startswith("B") and not LINE.fullmatch(line)
                and line[:3] not in ("B18", "B19", "B20")]


def printed_ranges(page):
    """{step: {(least, largest)}} of what the lines have as documented."""
    found = {}
    for step, _, _, documented, _ in (m.groups() for m in map(LINE.fullmatch, page.split("\n")) if m):
        found.setdefault(step, set()).update(ranges(documented or ""))
    return found


def disagreements(printed, rows):
    return {step: (printed[step], ranges(rows[step][2])) for step in printed if printed[step] != ranges(rows[step][2])}


def test_what_is_printed_as_documented_stands_in_the_page(page, rows):
    assert not disagreements(printed_ranges(page), rows)


@pytest.mark.parametrize("step, was, becomes", [
    ("B05", "475000", "476000"), ("B09", "10...29", "10...30"), ("B02", "0xFF", "0xFE")])
def test_a_page_with_other_values_is_noticed(page, rows, step, was, becomes):
    row = rows[step]
    assert was in row[2]
    assert step in disagreements(printed_ranges(page), {**rows, step: [*row[:2], row[2].replace(was, becomes, 1)]})


def test_it_is_printed_in_five_seconds(page, tmp_path):
    """By the line's rate, and what the measuring takes: the twin's UART takes no time."""
    play(tmp_path, latest_s=5 - len(page) * BITS_A_CHARACTER / BAUD)


def test_a_page_without_an_end_is_told(tmp_path):
    with pytest.raises(LauncherError, match="the page has no end"):
        play(tmp_path, latest_s=0.01)


@pytest.mark.parametrize("wrong", sorted(bringup.chips()))
def test_a_device_made_otherwise_is_named(wrong, tmp_path):
    page = play(tmp_path, wrong=wrong)
    expected = bringup.chips()[wrong]["differs"]
    assert sorted(named(page)) == sorted(expected)
    listed = re.findall(r"(?m)^differs: (.*)$", page)
    assert sorted(listed + [name for name in expected if name.endswith("in a reset")]) == sorted(expected)
    assert page.rstrip().split("\n")[-1] == f"not as documented: {len(expected)}"


def test_a_device_on_which_ones_clear_the_causes_is_as_documented(tmp_path):
    """Sources disagree; the page shows which it is."""
    zeros, ones = play(tmp_path), play(tmp_path, "design 0xB0 0x0 0xFF")
    assert not named(ones) and ones.rstrip().endswith("as documented")
    for page, left in ((zeros, "0x0"), (ones, "0xFF")):
        assert re.search(rf"(?m)^B02 RESET_SOURCE_CR after writing 0 +{left} ", page)


def design(register, word):
    """The twin's configuration for a register of the MSS as flash bits have it."""
    offset = next(facts.number(fact.value) for fact in facts.facts() if f"SYSREG.{register}" in fact.code)
    return f"design {offset:#x} {word:#x}"


@pytest.mark.parametrize("board", flash_bits.BOARDS)
def test_a_right_libero_project_is_found_as_documented(board, tmp_path):
    """The twin does what the System Controller does, but for the PLL's start."""
    flash = flash_bits.of_board(board)
    flash["MSSDDR_FACC1_CR"] = flash_bits.at_start(flash)["MSSDDR_FACC1_CR"]
    page = play(tmp_path, *(design(register, word) for register, word in flash.items()))
    assert not named(page) and page.rstrip().endswith("\nas documented")


def test_so_is_one_as_openocd_leaves_it(tmp_path):
    page = play(tmp_path, "event 0.001 openocd")
    assert page.count("mssfoc bring-up") == 2 and page.count("as found, no power-on ") == 3
    assert not named(page) and page.rstrip().endswith("\nas documented")


# registers of flash bits, and how many bits they have; the memories', the fabric's reset and idle interrupts' stay
BITS = {"SOFT_RESET_CR": 27, "MSSDDR_FACC1_CR": 28, "ENVM_CR": 13, "WDOG_CR": 2, "EDAC_CR": 7, "EDAC_IRQ_ENABLE": 15,
        "MASTER_WEIGHT0_CR": 30, "ESRAM_PIPELINE_CR": 1, "MSS_GPIO_DEF": 4, "WDOGLOAD": 26, "PLL_LOCK_EN_CR": 4}
STAY = {"SOFT_RESET_CR": 0xF | 1 << 16 | flash_bits.BY_THE_BOARD, "PLL_LOCK_EN_CR": 0x5}
SHOWN_AS = {"MSS_GPIO_DEF": "GPIO_OUT"}


def test_ten_designs_with_another_bit_are_named(tmp_path):
    """Drawn by lot, each in another register."""
    draw = random.Random(48)
    right = flash_bits.at_start(flash_bits.of_board("creative"))
    for register in draw.sample(sorted(BITS), 10):
        bit = draw.choice([bit for bit in range(BITS[register]) if not STAY.get(register, 0) >> bit & 1])
        page = play(tmp_path, design(register, right[register] ^ 1 << bit))
        assert any(SHOWN_AS.get(register, register) in name for name in named(page)), f"{register} b{bit}: {named(page)}"


def test_an_unexpected_fault_is_told_and_the_page_goes_on(tmp_path):
    """The kernel of a step becomes an undefined instruction."""
    with open(BUILD / "bringup.elf", "rb") as file:
        symbol = ELFFile(file).get_section_by_name(".symtab").get_symbol_by_name("measure_stores")[0]
    page = play(tmp_path, f"event 0 poke_rom {symbol['st_value'] & ~1} 0xde00")
    assert "B06 ended in a reset: RESET_SOURCE_CR 0x8, exception 6   DIFFERS" in page
    assert "\nB07 " in page and page.rstrip().endswith(f"not as documented: {len(named(page))}")


@pytest.mark.parametrize("lines, says", [
    (("event 0.3 lockup_reset",), ("a lock-up", "0x10")),
    (("watchdog 0x8000", "event 0.3 keys 77"), ("the watchdog", "0x20"))], ids=("lock-up", "watchdog"))
def test_the_other_resets_add_their_line(lines, says, tmp_path, rows):
    """The watchdog is 42 ms here: the key w ends its refreshes."""
    page = play(tmp_path, *lines, until=UNTIL_B18)
    line = next(LINE.fullmatch(line) for line in page.split("\n") if line.startswith("B18 RESET_SOURCE_CR"))
    assert line[2].rstrip() == f"RESET_SOURCE_CR after {says[0]}" and line[3] == line[4] == says[1] and not line[5]
    assert ranges(line[4]) <= ranges(rows["B18"][2])


def test_the_key_l_locks_the_core_up(tmp_path):
    """QEMU cannot go on from there, and says why."""
    with pytest.raises(LauncherError, match="the processor locked up"):
        play(tmp_path, "event 0.3 keys 6c", until=UNTIL_B18)
    assert "ockup" in (tmp_path / "qemu.log").read_text()


@pytest.mark.parametrize("after_s, there", ((9.99, False), (10.01, True)))
def test_the_key_t_gives_two_lines_ten_seconds_apart(after_s, there, tmp_path):
    """For a clock beside the device's, which is right in the twin."""
    pressed_s = 1.0

    def told(text):
        return play(tmp_path, f"event {pressed_s} keys 74", until=re.compile(text), latest_s=pressed_s + after_s)

    if there:
        assert "\nB19 0 s\n" in told("(?m)^B19 10 s by")
    else:
        with pytest.raises(LauncherError, match="B19 0 s"):
            told("(?m)^B19 10 s by")


def test_a_reset_button_begins_anew(tmp_path):
    """Power-on and DEVRST_N: the causes say so, whatever is in .noinit."""
    page = play(tmp_path, "event 0.3 power_cut", until=re.compile(r"(?s)as documented.*as documented"))
    assert page.count("mssfoc bring-up") == 2 and not named(page)


def test_only_the_spare_page_is_programmed(tmp_path):
    """Below the settings of both axes, above the image; and twice a run, as the page says."""
    play(tmp_path, f"envm {tmp_path / 'kept'}")
    kept = (tmp_path / "kept").read_bytes()
    entry = struct.Struct(f"<III{PAGE_BYTES}s")
    pages = [(page * PAGE_BYTES, writes) for page, writes, _, _ in entry.iter_unpack(kept[8:])]
    assert pages == [(SETTINGS - PAGE_BYTES, 2)]
    with open(BUILD / "bringup.elf", "rb") as file:
        ends = [s["p_paddr"] - ENVM_ARRAY + s["p_filesz"] for s in ELFFile(file).iter_segments()
                if s["p_type"] == "PT_LOAD" and s["p_filesz"]]
    assert max(ends) <= SETTINGS - PAGE_BYTES


def test_no_gate_is_ever_on(tmp_path):
    play(tmp_path, f"csv {tmp_path / 'trace.csv'}")
    lines = (tmp_path / "trace.csv").read_text().split("\n")
    live = lines[0].split(",").index("gate_live")
    values = {line.split(",")[live] for line in lines[1:] if line}
    assert len(lines) > 150 and values == {"0"}


def run(*options):
    command = [sys.executable, ROOT / "qemu/run.py", "bringup", *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_the_command_says_what_it_found(tmp_path):
    good, other = run("--out", tmp_path), run("--out", tmp_path, "--wrong", "secded_off")
    assert good.returncode == 0 and good.stdout.rstrip().endswith("\nas documented")
    assert other.returncode == 1 and "differs: B04 EDAC_CR" in other.stdout


def test_an_unknown_device_is_refused_in_a_line():
    result = run("--wrong", "nothing_such")
    assert result.returncode == 2 and result.stderr.count("\n") == 1
    assert "secded_off" in result.stderr and "Traceback" not in result.stderr


def test_an_image_that_is_not_there_is_told(tmp_path):
    result = run("--build", tmp_path)
    assert result.returncode == 2 and "run make bringup-image twin first" in result.stderr


def test_the_image_has_all_forms():
    for name in ("bringup.elf", "bringup.hex", "bringup-envm.hex"):
        assert (BUILD / name).is_file()
    assert Path(BUILD / "bringup.hex").read_text().startswith(":10000000")


@pytest.mark.parametrize("line, complaint", [("design 0x6C", "expected: design OFFSET WORD"), ("design 0x999 1", "no register"),
                                             ("time seconds", "neither instructions nor cycles")])
def test_a_configuration_that_is_wrong_is_refused(line, complaint, tmp_path):
    with pytest.raises(LauncherError, match=complaint):
        play(tmp_path, line)
