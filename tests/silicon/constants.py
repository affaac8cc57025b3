# SPDX-License-Identifier: MIT
"""What the drivers' sources define, with the values that the compiler for the target gives it: macros, enumerators, and the
registers of every `struct ..._regs` by their offsets.

    of_file(ROOT, "drivers/mss/timer.h")    {"MSS_TIMER": 0x40004000, "MSS_TIMER.TIM1_VAL": 0x00, ...}
"""
import os
import re
import subprocess
import tempfile
from functools import cache
from pathlib import Path

from elftools.elf.elffile import ELFFile

SECTION = ".facts"
LINE = re.compile(r'# \d+ "([^"]*)"')
DEFINE = re.compile(r"#define (\w+)(?:\((\w*)\))? ?(.*)")


def compiler(root):
    return [os.environ.get("CROSS", "arm-none-eabi-") + "gcc", "-mcpu=cortex-m3", "-mthumb", "-std=c11", "-ffreestanding",
            f"-I{root}"]


def macros(root, path):
    """[(name, parameter or None, body)] of what this very file defines, in its order."""
    text = subprocess.run([*compiler(root), "-dD", "-E", path], cwd=root, capture_output=True, text=True, check=True).stdout
    found, here = [], False
    for line in text.split("\n"):
        if marker := LINE.match(line):
            here = marker.group(1) == str(path)
        elif here and (define := DEFINE.match(line)):
            found.append(define.groups())
    return found


def expressions(root, path):
    """{name: C expression} of the macros that are values; one with a parameter counts with 0 for it, as NAME(n)."""
    found = {}
    for name, parameter, body in macros(root, path):
        if not body or body.startswith("__attribute__"):  # a guard of the file, a property of a function
            continue
        used = name if parameter is None else f"{name}(0u)"
        found[name if parameter is None else f"{name}(n)"] = f"&{used}" if body.startswith("(*") else used
    return found


def compiled(root, code, folder):
    (folder / "facts.c").write_text(code)
    subprocess.run([*compiler(root), "-g", "-fno-eliminate-unused-debug-types", "-c", "facts.c", "-o", "facts.o"], cwd=folder,
                   check=True)
    return folder / "facts.o"


def from_dwarf(dwarf, path):
    """({tag: {member: offset}}, {tag or "": {enumerator: value}}) of the structures and enums that this file declares."""
    structs, enums = {}, {}
    for unit in dwarf.iter_CUs():
        program = dwarf.line_program_for_CU(unit)
        names = [entry.name.decode() for entry in program["file_entry"]]
        first = 0 if program["version"] >= 5 else 1
        for die in unit.get_top_DIE().iter_children():
            file = die.attributes.get("DW_AT_decl_file")
            if file is None or names[file.value - first] != Path(path).name:
                continue
            tag = die.attributes["DW_AT_name"].value.decode() if "DW_AT_name" in die.attributes else ""
            if die.tag == "DW_TAG_structure_type" and tag.endswith("_regs"):
                structs[tag] = dict(members(die))
            elif die.tag == "DW_TAG_enumeration_type":
                enums.setdefault(tag, {}).update({one.attributes["DW_AT_name"].value.decode():
                                                  one.attributes["DW_AT_const_value"].value for one in die.iter_children()})
    return structs, enums


def members(die, base=0):
    for one in die.iter_children():
        if one.tag != "DW_TAG_member":
            continue
        offset = base + one.attributes["DW_AT_data_member_location"].value if "DW_AT_data_member_location" in one.attributes \
            else base
        if "DW_AT_name" not in one.attributes:  # a union of what shares an address
            yield from members(one.get_DIE_from_attribute("DW_AT_type"), offset)
        elif not one.attributes["DW_AT_name"].value.startswith(b"reserved_"):
            yield one.attributes["DW_AT_name"].value.decode(), offset


@cache
def of_file(root, path):
    """{name: value}; a register is BLOCK.REGISTER, BLOCK after its structure: struct mpu_regs is MPU."""
    wanted = expressions(root, path)
    lines = [f'#include "{path}"', "#include <stdint.h>"]
    lines += [f'__attribute__((section("{SECTION}"), used)) const uint32_t fact_{n} = (uint32_t)({expression});'
              for n, expression in enumerate(wanted.values())]
    with tempfile.TemporaryDirectory() as folder, open(compiled(root, "\n".join(lines) + "\n", Path(folder)), "rb") as file:
        elf = ELFFile(file)
        values = {symbol.name: symbol["st_value"] for symbol in elf.get_section_by_name(".symtab").iter_symbols()}
        words = elf.get_section_by_name(SECTION).data() if wanted else b""
        structs, enums = from_dwarf(elf.get_dwarf_info(), path)
    found = {name: int.from_bytes(words[values[f"fact_{n}"]:][:4], "little") for n, name in enumerate(wanted)}
    for tag, offsets in structs.items():
        found |= {f"{block_of(tag)}.{name}": offset for name, offset in offsets.items()}
    for tag, enumerators in enums.items():
        found |= {name if not tag else f"{tag}:{name}": value & 0xFFFFFFFF for name, value in enumerators.items()}
    return found


def block_of(tag):
    return tag.removesuffix("_regs").upper()


def of_folders(root, *folders):
    """{name: (value, file)} of all of them."""
    found = {}
    for path in sorted(path for folder in folders for path in (root / folder).glob("*.[ch]")):
        name = str(path.relative_to(root))
        found |= {key: (value, name) for key, value in of_file(root, name).items()}
    return found
