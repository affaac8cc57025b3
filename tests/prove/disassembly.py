# SPDX-License-Identifier: MIT
"""Reads an object file or archive through GNU objdump: {function: Code}, each instruction taken apart."""
import io
import os
import re
import struct
import subprocess
from dataclasses import dataclass, replace

from elftools.elf.elffile import ELFFile

CONDITIONS = ("eq", "ne", "cs", "cc", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le", "al")
SYNONYMS = {"hs": "cs", "lo": "cc"}
SETS_FLAGS = ("mov", "mvn", "add", "adc", "sub", "sbc", "rsb", "and", "orr", "eor", "bic", "orn", "lsl", "lsr", "asr", "ror",
              "rrx", "mul", "neg")
NEVER_SETS = ("movw", "movt", "addw", "subw", "cmp", "cmn", "tst", "teq", "mla", "mls", "smull", "umull", "smlal", "umlal",
              "ssat", "usat", "sbfx", "ubfx", "bfi", "bfc", "sxth", "uxth", "sxtb", "uxtb", "clz", "ldr", "str", "ldrd", "strd",
              "ldrh", "ldrsh", "strh", "ldmia", "stmia", "ldmdb", "stmdb", "push", "pop", "nop", "bx", "b")
REGISTERS = {f"r{n}": n for n in range(16)} | {"sl": 10, "fp": 11, "ip": 12, "sp": 13, "lr": 14, "pc": 15}


class Unknown(Exception):
    """An instruction, or a form of one, that the machine has no meaning for."""


@dataclass(frozen=True)
class Reg:
    number: int


@dataclass(frozen=True)
class Imm:
    value: int


@dataclass(frozen=True)
class Shift:
    kind: str
    amount: int


@dataclass(frozen=True)
class Mem:
    base: int
    offset: object  # Imm or Reg
    shift: Shift
    mode: str  # "offset", "pre", "post"


@dataclass(frozen=True)
class Target:
    address: int


@dataclass(frozen=True)
class RegList:
    numbers: tuple


@dataclass(frozen=True)
class Instruction:
    address: int
    text: str
    base: str
    cond: str  # "al" if none
    sets_flags: bool
    operands: tuple
    writeback: bool = False  # of LDM and STM
    symbol: str = ""  # relocation against this symbol

    def with_operand(self, index, operand):
        return replace(self, operands=self.operands[:index] + (operand,) + self.operands[index + 1:])


@dataclass
class Code:
    instructions: list
    words: dict  # literals: address -> (value, symbol or "")


def _spellings():
    table = {}
    for base in SETS_FLAGS + NEVER_SETS:
        for sets in ("", "s") if base in SETS_FLAGS else ("",):
            for cond in ("", *CONDITIONS, *SYNONYMS):
                meaning = (base, SYNONYMS.get(cond, cond) or "al", bool(sets))
                assert table.setdefault(base + sets + cond, meaning) == meaning, base + sets + cond
    return table


SPELLINGS = _spellings()


def _number(text):
    return int(text.lstrip("#"), 0)


def _shift(text):
    if text == "rrx":
        return Shift("rrx", 1)
    kind, amount = text.split()
    return Shift(kind, _number(amount))


def _memory(text):
    inside, after = re.match(r"\[([^\]]*)\](.*)", text).groups()
    parts = [part.strip() for part in inside.split(",")]
    mode = "pre" if after.strip() == "!" else "offset"
    if after.strip().startswith(","):
        mode, parts = "post", parts + [after.strip()[1:].strip()]
    offset = Imm(0)
    if len(parts) > 1:
        offset = Imm(_number(parts[1])) if parts[1].startswith("#") else Reg(REGISTERS[parts[1]])
    return Mem(REGISTERS[parts[0]], offset, _shift(parts[2]) if len(parts) > 2 else Shift("lsl", 0), mode)


def _registers(text):
    numbers = []
    for part in text.strip("{}").split(","):
        first, _, last = part.strip().partition("-")
        numbers += range(REGISTERS[first], REGISTERS[last or first] + 1)
    return RegList(tuple(numbers))


def _operand(text):
    if text.startswith("{"):
        return _registers(text)
    if text.startswith("["):
        return _memory(text)
    if text.startswith("#"):
        return Imm(_number(text))
    if text in REGISTERS:
        return Reg(REGISTERS[text])
    if match := re.match(r"([0-9a-f]+) <", text):
        return Target(int(match.group(1), 16))
    return _shift(text)


def _split(text):
    """Operands at the commas outside of brackets and braces; what follows a closing bracket stays with it (post-index)."""
    merged = []
    for part in re.findall(r"\{[^}]*\}|\[[^\]]*\](?:!|\s*,\s*#-?\w+)?|[^,\s][^,]*", text):
        merged.append(part.strip())
    return merged


def parse(address, mnemonic, rest):
    text = f"{mnemonic} {rest}".strip()
    name = re.sub(r"\.[nw]$", "", mnemonic)
    name = {"ldm": "ldmia", "stm": "stmia"}.get(name, name)
    if name not in SPELLINGS:
        raise Unknown(f"instruction '{text}' at {address:#x}")
    base, cond, sets = SPELLINGS[name]
    try:
        parts = _split(rest)
        writeback = base in ("ldmia", "stmia", "ldmdb", "stmdb") and parts[0].endswith("!")
        parts = [part.rstrip("!") if writeback and index == 0 else part for index, part in enumerate(parts)]
        return Instruction(address, text, base, cond, sets, tuple(map(_operand, parts)), writeback)
    except (KeyError, ValueError, AttributeError, IndexError):
        raise Unknown(f"operands of '{text}' at {address:#x}") from None


def functions(path, wanted):
    """{name: Code} of those `wanted` functions that the file holds."""
    objdump = os.environ.get("CROSS", "arm-none-eabi-") + "objdump"
    listing = subprocess.run([objdump, "-d", "-r", "-z", "--no-show-raw-insn", "-w", str(path)], capture_output=True,
                             text=True, check=True).stdout
    found, current, last = {}, None, None
    for line in listing.splitlines():
        if match := re.match(r"[0-9a-f]+ <([^>]+)>:$", line):
            current = found.setdefault(match.group(1), Code([], {})) if match.group(1) in wanted else None
        elif current is None:
            continue
        elif match := re.match(r"\s*([0-9a-f]+):\s+(\S+)\s*(.*)", line):
            last = _line(current, int(match.group(1), 16), match.group(2), re.split(r"[@;]", match.group(3), maxsplit=1)[0])
    return found


def _line(code, address, mnemonic, rest):
    """One line of the listing; -w puts relocations on lines of their own or behind a tab, both arrive here."""
    relocation = re.search(r"R_ARM_(\w+)\s+(\S+)", f"{mnemonic} {rest}")
    rest = re.split(r"\s+[0-9a-f]+: R_ARM_", rest)[0].strip()
    if mnemonic.startswith("R_ARM_"):
        symbol = relocation.group(2)
        if address in code.words:
            code.words[address] = (code.words[address][0], symbol)
        else:
            code.instructions[-1] = replace(code.instructions[-1], symbol=symbol)
    elif mnemonic == ".word":
        code.words[address] = (int(rest, 16), relocation.group(2) if relocation else "")
    elif mnemonic.startswith("."):
        return
    elif re.fullmatch(r"it[te]{0,3}", mnemonic):
        return  # objdump prints the condition at each instruction
    else:
        instruction = parse(address, mnemonic, rest)
        code.instructions.append(replace(instruction, symbol=relocation.group(2)) if relocation else instruction)


def table_words(library, symbol):
    """The words of a constant in an archive, signed."""
    archiver = os.environ.get("CROSS", "arm-none-eabi-") + "ar"
    members = subprocess.run([archiver, "t", str(library)], capture_output=True, text=True, check=True).stdout.split()
    for member in members:
        data = subprocess.run([archiver, "p", str(library), member], capture_output=True, check=True).stdout
        elf = ELFFile(io.BytesIO(data))
        for entry in elf.get_section_by_name(".symtab").get_symbol_by_name(symbol) or []:
            if entry["st_shndx"] != "SHN_UNDEF":
                start, size = entry["st_value"], entry["st_size"]
                return struct.unpack(f"<{size // 4}i", elf.get_section(entry["st_shndx"]).data()[start:start + size])
    raise Unknown(f"table {symbol}: it is in no object file")
