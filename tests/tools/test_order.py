# SPDX-License-Identifier: MIT
"""What must happen in an order, in the object code: switching on and off, and the acknowledge of a conversion.

The interrupt breaks in between any two instructions, so an order that only stands in the source does not hold. Each check is
shown to see what it is for: the same source without one of its `volatile` must not pass.
"""
import os
import re
import shutil
import subprocess
from pathlib import Path

import disasm
import pytest
import wcet
from addresses import Constants

BUILD = Path(os.environ.get("BUILD", "build"))
CROSS = os.environ.get("CROSS", "arm-none-eabi-")
FLAGS = ["-mcpu=cortex-m3", "-mthumb", "-std=c11", "-ffreestanding", "-O2", "-ffunction-sections", "-fno-common",
         "-fno-delete-null-pointer-checks", "-fno-tree-loop-distribute-patterns", "-DLIB_TRIG_FRAC=15"]
ADC_STATUS, GATE_CONTROL, GATE_STATUS, ENC_LATCHED, ENC_HALL = 0x104, 0x300, 0x304, 0x20C, 0x224
MERGED = "two members in one access"


def layout():
    """{name: offset} of struct current_loop, as the assembly knows it."""
    text = Path("firmware/control/current_loop_layout.h").read_text()
    return {name: int(value) for name, value in re.findall(r"#define LOOP_(\w+) +(\d+)$", text, re.M)}


def listing(root, work):
    """{function: [instructions]} of current_loop.c below a root, compiled as the image is; calls by name."""
    unit = work / "current_loop.o"
    subprocess.run([f"{CROSS}gcc", *FLAGS, f"-I{root}", "-I.", "-c", f"{root}/firmware/control/current_loop.c", "-o",
                    str(unit)], check=True)
    text = subprocess.run([f"{CROSS}objdump", "-dr", "--no-show-raw-insn", str(unit)], capture_output=True, text=True,
                          check=True).stdout
    found, lines = {}, []
    for line in text.splitlines():
        if match := re.match(r"[0-9a-f]+ <(\w+)>:", line):
            found[match.group(1)] = lines = []
        elif match := re.search(r"R_ARM_THM_(?:CALL|JUMP24)\s+(\w+)", line):
            lines[-1] = f"call {match.group(1)}"
        elif match := re.match(r"\s+[0-9a-f]+:\s+(\S.*)", line):
            lines.append(match.group(1).split("@")[0].strip().replace(".w", ""))
    return found


def accesses(lines):
    """What a function does to its first two arguments, the loop and the fabric, and whom it calls, in order."""
    where, found = {"r0": "loop", "r1": "fabric"}, []
    for line in lines:
        name, _, operands = line.partition(" ")
        operands = operands.replace("\t", " ").strip()
        if name == "call":
            found.append(operands)
            continue
        name, operands = re.split(r"\s+", line, maxsplit=1) if re.search(r"\s", line) else (line, "")
        access = re.match(r"(.*)\[(\w+)(?:, #(-?\d+))?\]", operands)
        if access and access.group(2) in where:
            base, offset = where[access.group(2)], int(access.group(3) or 0)
            found.append(MERGED if name.startswith(("strd", "ldrd")) else f"{name[:3]} {base} {offset}")
        elif name.startswith(("stm", "ldm")) and operands.split(",")[0].rstrip("!") in where:
            found.append(MERGED)
        target = operands.split(",")[0].strip()
        if name == "mov" and operands.split(",")[1].strip() in where:
            where[target] = where[operands.split(",")[1].strip()]
        elif not name.startswith(("str", "cmp", "push")):
            where.pop(target, None)
    return found


def in_order(found, *wanted):
    places = [found.index(one) for one in wanted if one in found]
    return len(places) == len(wanted) and places == sorted(places)


def switching_on_holds(lines):
    at, found = layout(), accesses(lines)
    integrals = [f"str loop {at['INTEGRAL_D']}", f"str loop {at['INTEGRAL_Q']}"]
    return MERGED not in found and in_order(found, f"str fabric {ADC_STATUS}", "adc_set_limits", *integrals,
                                            "bridge_enable", f"str loop {at['STATUS_MAX']}", "current_loop_follow")


def switching_off_holds(lines):
    found = accesses(lines)
    return MERGED not in found and found[0] == f"str fabric {GATE_CONTROL}" and in_order(
        found, f"str fabric {GATE_CONTROL}", f"str loop {layout()['STATUS_MAX']}", f"str loop {layout()['INTEGRAL_D']}")


def test_switching_on_and_off(tmp_path):
    code = listing(".", tmp_path)
    assert switching_on_holds(code["current_loop_on"]), accesses(code["current_loop_on"])
    assert switching_off_holds(code["current_loop_off"]), accesses(code["current_loop_off"])


@pytest.mark.parametrize("files, old, new", [
    ([f"firmware/control/current_loop{name}" for name in (".c", ".h")], "volatile struct current_loop",
     "struct current_loop"),
    (["firmware/control/current_loop.c"], "    gate_disable(&f->gate);\n    c->status_max = UINT32_MAX;\n",
     "    c->status_max = UINT32_MAX;\n    gate_disable(&f->gate);\n"),
    (["firmware/control/current_loop.c"], "        return;\n    }\n    c->status_max = GATE_STATUS_LIVE;\n",
     "        return;\n    }\n"),
])
def test_another_order_is_seen(files, old, new, tmp_path):
    for folder in ("drivers", "firmware", "lib"):
        shutil.copytree(folder, tmp_path / folder)
    for name in files:
        text = Path(name).read_text()
        assert old in text
        (tmp_path / name).write_text(text.replace(old, new))
    code = listing(tmp_path, tmp_path)
    assert not (switching_on_holds(code["current_loop_on"]) and switching_off_holds(code["current_loop_off"]))


HANDLERS = [(image, name) for image, names in (
    ("mssfoc", (wcet.HANDLER, "handlers_forced_ab", "handlers_observer_ab", "handlers_injection_ab", "handlers_hall_ab",
                "handlers_weakening_ab", "handlers_overmodulating_ab")),
    ("bench", ("handlers_encoder_ab",))) for name in names]


@pytest.mark.parametrize("image, handler", HANDLERS)
def test_the_line_has_dropped_before_the_handler_returns(image, handler):
    """The fabric keeps the order of accesses: a read that follows the acknowledge has its answer when the line is low."""
    found = disasm.Image(BUILD / f"{image}.elf")
    function = found.functions[handler]
    constants, done = Constants(found, function), []
    for address in sorted(function.code):
        i = function.code[address]
        to = constants.address(i)[0] if "[" in i.operands else None
        if to is not None and to >> 12 == 0x50000:
            done.append((i.mnemonic[:3], to & 0xFFF))
    assert done.count(("str", ADC_STATUS)) == 1 and done[-1] == ("ldr", GATE_STATUS)
    if "observer" in handler or "injection" in handler:
        assert ("ldr", ENC_LATCHED) not in done
    elif "hall" in handler:
        assert in_order(done, ("ldr", ENC_HALL), ("str", ADC_STATUS)) and ("ldr", ENC_LATCHED) not in done
    else:
        assert in_order(done, ("ldr", ENC_LATCHED), ("str", ADC_STATUS))
    assert in_order(done, ("str", ADC_STATUS), ("ldr", GATE_STATUS))
