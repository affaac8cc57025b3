# SPDX-License-Identifier: MIT
"""The code of a linked image as functions of instructions: what objdump shows, with every branch target resolved.

Symbols, mapping of code and data, and branch tables come from the ELF; nothing comes from the sources.
"""
import os
import re
import subprocess
from bisect import bisect_right
from dataclasses import dataclass, field

from elftools.elf.elffile import ELFFile

CONDITIONS = "eq|ne|cs|cc|mi|pl|vs|vc|hi|ls|ge|lt|gt|le"
_LINE = re.compile(r"^\s*([0-9a-f]+):\t([0-9a-f ]+?)\s*\t(\S+)(?:\t(.*))?$")
_BRANCH = re.compile(rf"^(?:b(?P<cond>{CONDITIONS})?|(?P<zero>cbn?z)|(?P<call>bl)(?P<callcond>{CONDITIONS})?)$")
_INDIRECT = re.compile(rf"^(?P<kind>blx|bx)(?:{CONDITIONS})?$")
LINK_REGISTER, PROGRAM_COUNTER = "lr", "pc"


class ImageError(Exception):
    """Something about an image that a bound cannot be given for."""


@dataclass(frozen=True)
class Instruction:
    """One instruction. `mnemonic` has no width suffix and, in an IT block, no condition: that is in `condition`.

    flow: "" goes on, "jump", "branch" (may go on), "call", "call pointer", "jump pointer", "return", "table"
    """
    address: int
    size: int
    mnemonic: str
    operands: str
    flow: str = ""
    targets: tuple = ()
    condition: str = ""

    @property
    def conditional(self):
        return bool(self.condition)

    @property
    def end(self):
        return self.address + self.size

    @property
    def registers(self):
        """The names in a register list { }, ranges written out."""
        inside = re.search(r"\{(.*?)\}", self.operands)
        names = []
        for item in inside.group(1).split(",") if inside else []:
            first, *last = item.strip().split("-")
            names += _register_range(first, last[0]) if last else [first]
        return names

    def __str__(self):
        condition = "" if self.mnemonic in ("cbz", "cbnz") else self.condition
        return f"{self.mnemonic}{condition} {self.operands}".strip()


VENEER = bytes.fromhex("5ff800f0")  # ldr.w pc, [pc]
_NAMES = [f"r{n}" for n in range(10)] + ["sl", "fp", "ip", "sp", "lr", "pc"]


def _register_range(first, last):
    return _NAMES[_NAMES.index(first):_NAMES.index(last) + 1]


@dataclass
class Function:
    name: str
    start: int
    end: int
    aliases: list
    code: dict = field(default_factory=dict)  # address -> Instruction

    def successors(self, instruction):
        """Addresses inside the function that may be executed after it, calls taken as returning."""
        inside = tuple(t for t in instruction.targets if self.start <= t < self.end and instruction.flow != "call")
        ends = instruction.flow in ("jump", "jump pointer", "return", "table") and not instruction.conditional
        return inside if ends else (*inside, instruction.end)

    def leaves_to(self, instruction):
        """The target of a jump out of the function (a tail call), or None."""
        if instruction.flow in ("jump", "branch"):
            outside = [t for t in instruction.targets if not self.start <= t < self.end]
            return outside[0] if outside else None
        return None


class Image:
    """A linked ELF: functions by name and address, objects, sections, and the bytes at any address."""

    def __init__(self, path):
        self.path = str(path)
        try:
            with open(path, "rb") as stream:
                elf = ELFFile(stream)
                self._sections = [(s["sh_addr"], s.data(), bool(s["sh_flags"] & 1), bool(s["sh_flags"] & 4))
                                  for s in elf.iter_sections() if s["sh_flags"] & 2 and s["sh_type"] == "SHT_PROGBITS"]
                table = elf.get_section_by_name(".symtab")
                self.symbols = [] if table is None else [(s.name, s["st_value"], s["st_size"], s["st_info"]["type"])
                                                         for s in table.iter_symbols() if s.name]
        except OSError as error:
            raise ImageError(f"{path}: {error.strerror}") from error
        self.values = {name: value for name, value, _, _ in self.symbols}
        self.objects = {name: (value, size) for name, value, size, kind in self.symbols if kind == "STT_OBJECT"}
        self._marks = sorted((value & ~1, name[1]) for name, value, _, _ in self.symbols if re.match(r"\$[tda](\.|$)", name))
        self._functions()
        self._disassemble()

    def bytes_at(self, address, size):
        for start, data, _, _ in self._sections:
            if start <= address and address + size <= start + len(data):
                return data[address - start:address - start + size]
        raise ImageError(f"{self.path} has nothing at {address:#x}")

    def word(self, address):
        return int.from_bytes(self.bytes_at(address, 4), "little")

    def writable(self, address):
        return any(w for start, data, w, _ in self._sections if start <= address < start + len(data))

    def value(self, name):
        if name not in self.values:
            raise ImageError(f"the image has no symbol {name}")
        return self.values[name]

    def at(self, address):
        """The function that holds an address, or None."""
        n = bisect_right(self._starts, address) - 1
        return self._in_order[n] if n >= 0 and address < self._in_order[n].end else None

    def line_of(self, address):
        """file:line of an instruction."""
        tool = os.environ.get("CROSS", "arm-none-eabi-") + "addr2line"
        out = subprocess.run([tool, "-e", self.path, hex(address)], capture_output=True, text=True, check=True).stdout
        return re.sub(r" \(discriminator \d+\)", "", out.strip()).removeprefix("./")

    def lines_of(self, addresses):
        """{address: [(function, file:line), ...] from the innermost inlined function outwards}."""
        tool = os.environ.get("CROSS", "arm-none-eabi-") + "addr2line"
        out = subprocess.run([tool, "-a", "-i", "-f", "-e", self.path, *map(hex, addresses)], capture_output=True, text=True,
                             check=True).stdout
        found, current, name = {}, None, None
        for line in out.splitlines():
            if re.match(r"^0x[0-9a-f]{8}$", line):
                current = found.setdefault(int(line, 16), [])
                name = None
            elif name is None:
                name = line
            else:
                current.append((name, re.sub(r" \(discriminator \d+\)", "", line).removeprefix("./")))
                name = None
        return found

    def _functions(self):
        found = {}
        for name, value, size, kind in self.symbols:
            if kind == "STT_FUNC":
                old = found.setdefault(value & ~1, [[], 0])
                old[0].append(name)
                old[1] = max(old[1], size)
        starts = sorted(found)
        self._in_order = []
        for n, start in enumerate(starts):
            names, size = found[start]
            following = starts[n + 1] if n + 1 < len(starts) else start + (1 << 20)
            end = start + size if size else min(following, self._section_end(start))  # libgcc's assembly has no sizes
            self._in_order.append(Function(min(names), start, end, sorted(names)))
        self._starts = starts
        self.functions_at = {function.start: function for function in self._in_order}
        self.deepest = {}  # what frames.py has worked out already
        self.functions = {}
        for function in self._in_order:
            for name in function.aliases:
                self.functions.setdefault(name, function)

    def _section_end(self, address):
        return next((start + len(data) for start, data, _, _ in self._sections if start <= address < start + len(data)),
                    address)

    def _disassemble(self):
        tool = os.environ.get("CROSS", "arm-none-eabi-") + "objdump"
        out = subprocess.run([tool, "-d", "-w", self.path], capture_output=True, text=True, check=True).stdout
        for line in out.split("\n"):
            match = _LINE.match(line)
            if not match or match.group(3).startswith(".") or "<UNDEFINED>" in line:
                continue
            address = int(match.group(1), 16)
            function = self.at(address)
            if function is not None:
                operands = (match.group(4) or "").split("@")[0].split(";")[0].strip()
                size = len(match.group(2).replace(" ", "")) // 2
                function.code[address] = self._decoded(address, size, match.group(3), operands)
        for function in self._in_order:
            _apply_it_blocks(function)

    def _decoded(self, address, size, word, operands):
        mnemonic = re.sub(r"\.[nw]$", "", word)
        flow, targets, condition = "", (), ""
        branch, pointer = _BRANCH.match(mnemonic), _INDIRECT.match(mnemonic)
        if branch:
            target = int(re.search(r"(?:^|\s)([0-9a-f]+)(?:\s*<|$)", operands).group(1), 16)
            targets = (self._behind_veneer(target),)
            condition = branch["cond"] or branch["callcond"] or ("zero" if branch["zero"] else "")
            flow = "call" if branch["call"] else "branch" if condition else "jump"
            operands = re.sub(r"\s*<.*>", "", operands)
            mnemonic = branch["zero"] or ("bl" if branch["call"] else "b")
        elif pointer:
            flow = "return" if operands == LINK_REGISTER and pointer["kind"] == "bx" else \
                "call pointer" if pointer["kind"] == "blx" else "jump pointer"
        elif mnemonic in ("tbb", "tbh"):
            flow, targets = "table", self._table(address, mnemonic, operands)
        elif mnemonic == "ldr" and re.fullmatch(r"pc, \[\w+, \w+, lsl #2\]", operands):
            flow, targets = "table", self._table_of_addresses(address + size)
        instruction = Instruction(address, size, mnemonic, operands, flow, targets, condition)
        if not flow and mnemonic.startswith(("pop", "ldm")) and PROGRAM_COUNTER in instruction.registers:
            return Instruction(address, size, mnemonic, operands, "return")
        if not flow and re.match(r"(mov|ldr|add)\w*$", mnemonic) and operands.split(",")[0].strip() == PROGRAM_COUNTER:
            back = operands.replace(" ", "") in ("pc,lr", "pc,[sp],#4")
            return Instruction(address, size, mnemonic, operands, "return" if back else "jump pointer")
        return instruction

    def _behind_veneer(self, target):
        """Where a branch from eNVM to eSRAM ends: the linker puts `ldr.w pc, [pc]` and the address in between."""
        veneer = self.functions_at.get(target)
        if veneer is None or not re.fullmatch(r"__\w+_veneer", veneer.name):
            return target
        if self.bytes_at(target, 4) != VENEER:
            raise ImageError(f"{veneer.name} is not the veneer that is known")
        return self.word(target + 4) & ~1

    def _table(self, address, mnemonic, operands):
        """Targets of a branch table behind the instruction, as far as the linker marks data."""
        if not operands.replace(" ", "").startswith("[pc,"):
            raise ImageError(f"a branch table at {address:#x} that does not follow its instruction")
        base, width = address + 4, 1 if mnemonic == "tbb" else 2
        end = next(at for at, kind in self._marks if at > base and kind == "t")
        data = self.bytes_at(base, end - base)
        steps = [int.from_bytes(data[i:i + width], "little") for i in range(0, len(data) - width + 1, width)]
        return tuple(sorted({base + 2 * step for step in steps if base + 2 * step >= end}))

    def _table_of_addresses(self, behind):
        """As -Os has it, on the next word."""
        base = (behind + 3) & ~3
        if (base, "d") not in self._marks:
            raise ImageError(f"a table of addresses at {behind:#x} that does not follow its instruction")
        end = next(at for at, kind in self._marks if at > base and kind == "t")
        return tuple(sorted({self.word(at) & ~1 for at in range(base, end - 3, 4)}))


def _apply_it_blocks(function):
    """Moves the condition out of the mnemonics in IT blocks; an instruction there may be skipped."""
    left = 0
    for address in sorted(function.code):
        instruction = function.code[address]
        if re.match(r"^it[te]{0,3}$", instruction.mnemonic):
            left = len(instruction.mnemonic) - 1
        elif left:
            left -= 1
            base = re.match(rf"^(.*?)({CONDITIONS})((?:\.\w+)?)$", instruction.mnemonic)
            if not instruction.condition and base:
                flow = "branch" if instruction.flow == "jump" else instruction.flow
                function.code[address] = Instruction(address, instruction.size, base.group(1) + base.group(3),
                                                     instruction.operands, flow, instruction.targets, base.group(2))
