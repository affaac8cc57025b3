# SPDX-License-Identifier: MIT
"""docs/silicon.md against the code: what the drivers, start-up and the twin have is what the page's sources say."""
import os
import re
import shutil
import subprocess
from functools import cache

import pytest

from silicon import constants, facts

ROOT = facts.ROOT
CROSS = os.environ.get("CROSS", "arm-none-eabi-")
FOLDERS = ("drivers/mss", "drivers/cortex")
BOARD = "drivers/board.h"
# what these folders define that no device has: our choices, and sums of what has its fact
OURS = {"GRANT_LOOKS", "WAIT_LOOKS", "PATIENCE_TICKS", "LSR_ERRORS", "IER_RECEIVE", "IER_BOTH", "EMERGENCY_POLLS",
        "MMUART_TX_BYTES", "MMUART_RX_BYTES", "MMUART_XON", "MMUART_XOFF", "MMUART_RX_HIGH", "MMUART_RX_LOW", "MMUART_RX_LOSS",
        "MMUART_RX_SILENCE", "CHARACTER_BITS", "SETTLE", "WATCHDOG_ON_LOOKS"}
OUR_ENUMS = ("envm_result", "mmuart_format")
WARM = ("watchdog", "lock-up", "software", "external")
RESETS = {"reset": ("power-on", *WARM), "warm": WARM, **{name: (name,) for name in ("power-on", *WARM)}}
TWIN = ("sysreg", "watchdog", "gpio", "envm", "dwt", "random")


def device_constants(root=ROOT):
    """{name: value} of what the drivers take for the device's; an enumerator goes by its own name."""
    found = {}
    for name, (value, _) in constants.of_folders(root, *FOLDERS).items():
        tag, _, plain = name.rpartition(":")
        if plain not in OURS and tag not in OUR_ENUMS:
            found[plain] = value
    return found


def documented(table=None):
    """{name in the code: value}; a vector by its handler's name. None: the page gives no number."""
    return {name: facts.number(fact.value) for fact in table or facts.facts() for name in fact.code if ":" not in name}


def shown(value):
    return "no number" if value is None else f"{value:#x}"


def differences(code, table):
    """What is documented otherwise, and what is not documented."""
    found = [f"{name} is {code[name]:#x} in the code and {shown(table[name])} in docs/silicon.md"
             for name in sorted(code.keys() & table.keys()) if code[name] != table[name]]
    return found + [f"{name} has no fact in docs/silicon.md" for name in sorted(code.keys() - table.keys())]


@cache
def board():
    return constants.of_file(ROOT, BOARD)


@cache
def vectors():
    """{handler: interrupt} by the vector table that start-up's macro makes: the compiler fills it in."""
    code = ('#include "startup/startup.h"\n#define ROW(number, handler) int fact_##handler = number;\n'
            "STARTUP_EXTERNAL_HANDLERS(ROW)\n")
    text = subprocess.run([*constants.compiler(ROOT), "-P", "-E", "-"], input=code, cwd=ROOT, capture_output=True, text=True,
                          check=True).stdout
    return {name: int(value) for name, value in re.findall(r"int fact_(\w+) = (\d+);", text)}


def test_the_drivers_constants_are_the_documented_ones():
    assert not differences(device_constants(), documented())


@pytest.mark.parametrize("file, was, becomes", [
    ("drivers/mss/timer.h", "0x40004000u", "0x40004100u"),
    ("drivers/mss/sysreg.h", "FABRIC  (1u << 16)", "FABRIC  (1u << 17)"),
    ("drivers/mss/envm.h", "(0xFFu << 5)", "(0x7Fu << 5)"),
    ("drivers/mss/sysreg.c", "FACC1_FIC0 = 13", "FACC1_FIC0 = 16"),
    ("drivers/mss/irq.h", "PLL_LOCK_LOST        23u", "PLL_LOCK_LOST        22u"),
    ("drivers/cortex/scb.h", "volatile uint32_t SHCSR;", "uint32_t one_more; volatile uint32_t SHCSR;"),
    ("drivers/mss/gpio.h", "#define GPIO_PINS ", "#define GPIO_NEW 1u\n#define GPIO_PINS "),
], ids=("address", "bit", "mask", "enumerator", "interrupt", "register", "new"))
def test_a_change_in_a_driver_is_noticed(file, was, becomes, tmp_path):
    shutil.copytree(ROOT / "drivers", tmp_path / "drivers")
    text = (tmp_path / file).read_text()
    assert text.count(was) == 1
    (tmp_path / file).write_text(text.replace(was, becomes))
    # the headers check their own offsets: what shall be found here is what a reader got wrong in both places
    checks = tmp_path / "drivers/reg.h"
    checks.write_text(checks.read_text().replace("offsetof(type, field) == (offset)", "1"))
    assert differences(device_constants(tmp_path), documented())


def test_the_page_names_nothing_that_the_code_does_not_have():
    known = device_constants().keys() | board().keys() | vectors().keys()
    assert not [name for name in documented() if name not in known]


def test_the_boards_rates_and_interrupts_are_the_documented_ones():
    table = documented()
    missing = {name for name in board() if name.startswith(("BOARD_IRQ_", "BOARD_PIN_", "BOARD_FABRIC_")) or "_HZ" in name}
    assert missing <= table.keys()
    assert not [name for name in board().keys() & table.keys() if board()[name] != table[name]]


def test_the_vectors_are_the_documented_interrupts():
    table, ours = documented(), vectors()
    assert len(ours) == table["MSS_IRQ_COUNT"] and list(ours.values()) == list(range(len(ours)))
    named = {name: value for name, value in table.items() if name.endswith("_IRQHandler")}
    assert named.items() <= ours.items()
    # the two families of which the page has the ends
    assert all(ours[f"FabricIrq{n}_IRQHandler"] == table["MSS_IRQ_FABRIC(n)"] + n for n in range(16))
    assert all(ours[f"GPIO{n}_IRQHandler"] == table["MSS_IRQ_GPIO(n)"] + n for n in range(32))
    families = {f"FabricIrq{n}_IRQHandler" for n in range(16)} | {f"GPIO{n}_IRQHandler" for n in range(32)}
    assert set(ours) == set(named) | families


def test_start_up_in_assembler_uses_the_documented_addresses(tmp_path):
    subprocess.run([*constants.compiler(ROOT), "-c", ROOT / "startup/reset.S", "-o", tmp_path / "reset.o"], check=True)
    listing = subprocess.run([CROSS + "nm", tmp_path / "reset.o"], capture_output=True, text=True, check=True).stdout
    ours = {name: int(value, 16) for value, name in re.findall(r"^(\w+) [aA] (\w+)$", listing, re.M)}
    table = documented()
    address = {name: table[name.split(".")[0]] + table[name] for name in ("SYSREG.RESET_SOURCE_CR", "SCB.VTOR", "SCB.CCR")}
    assert ours["RESET_SOURCE_CR"] == address["SYSREG.RESET_SOURCE_CR"] and ours["POWER_ON"] == table["SYSREG_CAUSE_POWER_ON"]
    assert ours["SCB_VTOR"] == address["SCB.VTOR"] and ours["SCB_CCR"] == address["SCB.CCR"]
    assert ours["CCR_STKALIGN"] == table["SCB_CCR_STKALIGN"] and ours["VECTORS_SIZE"] == 4 * (16 + table["MSS_IRQ_COUNT"])


# ---- the twin --------------------------------------------------------------------------------------------------------

@pytest.fixture(scope="module")
def twin(tmp_path_factory):
    """[(which reset, block, offset, value)] of all that it models."""
    program = tmp_path_factory.mktemp("twin") / "resets"
    sources = [ROOT / "tests/silicon/twin_resets.c", *(ROOT / f"qemu/twin/{name}.c" for name in TWIN)]
    subprocess.run([os.environ.get("HOSTCC", "cc"), "-std=gnu11", "-Wall", "-Wextra", "-Werror", f"-I{ROOT}/qemu/twin",
                    *sources, "-o", program, "-lm"], check=True)
    lines = subprocess.run([program], capture_output=True, text=True, check=True).stdout.split("\n")
    return [(after, block, int(offset, 16), int(value, 16)) for after, block, offset, value in map(str.split, lines[:-1])]


def after_resets(table):
    """{(which reset, register): value} of the page."""
    found = {}
    for fact in table:
        for name in fact.code:
            phase, _, register = name.partition(":")
            for after in RESETS[phase] if register else ():
                found[after, register] = facts.number(fact.value)
    return found


def reset_differences(twin, table):
    """What the twin holds otherwise, or holds and the page does not have."""
    values, offsets = after_resets(table), documented(table)
    registers = {(name.split(".")[0], value): name for name, value in offsets.items() if "." in name}
    return [f"{registers[block, offset]} after {after}: {value:#x} in the twin"
            for after, block, offset, value in twin if values.get((after, registers[block, offset])) != value]


def test_the_twin_holds_the_documented_values_after_resets(twin):
    assert len(twin) > 50 and not reset_differences(twin, facts.facts())


@pytest.mark.parametrize("was, becomes, times", [
    ("| `reset:SYSREG.WDOG_CR` | 0x1 |", "| `reset:SYSREG.WDOG_CR` | 0x3 |", 5),
    ("| `warm:SYSREG.SOFT_RESET_CR` | 0x06097E10 |", "| `warm:SYSREG.SOFT_RESET_CR` | 0x06087E10 |", 4),
    ("| `SYSREG.EDAC_SR` | +0x190 |", "| `SYSREG.EDAC_CNT` | +0x190 |", 5)], ids=("value", "warm", "register"))
def test_a_twin_that_resets_otherwise_is_noticed(twin, was, becomes, times):
    text = facts.PAGE.read_text()
    assert text.count(was) == 1
    wrong = reset_differences(twin, facts.facts(text.replace(was, becomes)))
    assert len(wrong) == times + len(reset_differences(twin, facts.facts(text)))


# ---- the page itself -------------------------------------------------------------------------------------------------

@cache
def tracked():
    command = ["git", "ls-files", "-co", "--exclude-standard"]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")


def files_of(use):
    """Files whose path ends so, unless one is called just that; the page gives as much of it as is needed to tell."""
    return [use] if use in tracked() else [name for name in tracked() if name.endswith("/" + use) and "/fuzz/" not in name]


@cache
def text_of(name):
    """Without line ends, and without the stars of a comment's lines."""
    return re.sub(r"\s+(?:\* )?", " ", (ROOT / name).read_text(errors="replace"))


def mentions(name, fact, words):
    text = text_of(name)
    if words:
        return words in text
    parts = [code.removesuffix("(n)").rpartition(":")[2].rpartition(".")[2] for code in fact.code]
    return any(re.search(rf"\b{re.escape(part)}\b", text) for part in parts)


def test_there_are_enough_facts_and_each_stands_once():
    names = [code for fact in facts.facts() for code in (fact.code or [fact.name])]
    assert len(facts.facts()) >= 150 and len(names) == len(set(names))


def test_each_fact_has_a_value_a_source_and_a_verdict():
    assert not [fact.name for fact in facts.facts()
                if not (fact.value and fact.source and facts.VERDICT.fullmatch(fact.verdict))]


def test_each_fact_is_used_where_it_says():
    wrong = []
    for fact in facts.facts():
        for use, words in fact.uses:
            found = files_of(use)
            if len(found) != 1:
                wrong.append(f"{fact.name}: '{use}' is {len(found)} files")
            elif not mentions(found[0], fact, words):
                wrong.append(f"{fact.name}: {found[0]} does not mention {words or 'it'}")
        if not fact.uses:
            wrong.append(f"{fact.name}: used nowhere")
    assert not wrong


def test_each_unconfirmed_fact_has_its_step_and_each_contradicted_one_its_reason():
    steps, reasons = facts.column(facts.STEPS), facts.column(facts.REASONS)
    needed = {fact.settled_by for fact in facts.facts() if fact.settled_by}
    assert len(steps) == len(set(steps)) and len(reasons) == len(set(reasons))
    assert needed <= set(steps) | set(reasons), "no such step or reason"
    assert set(reasons) <= needed, "a reason without its fact"


def test_a_broken_table_is_told():
    page = facts.PAGE.read_text()
    row = next(line for line in page.split("\n") if line.startswith("| `MSS_TIMER` "))
    with pytest.raises(AssertionError):
        facts.facts(page.replace(row, row[:row.rindex("|", 0, -2)]))
    assert facts.number("a few") is None and facts.number("b24:21") == 0x1E00000 and facts.number("b3 b1") == 0xA
