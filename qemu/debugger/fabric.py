# SPDX-License-Identifier: MIT
"""The fabric's registers by name in GDB, from the SVD file that `make registers` writes.

    gdb-multiarch build/mssfoc.elf -x qemu/debugger/fabric.py
    (gdb) fabric                     its blocks
    (gdb) fabric PWM                 a block's registers with their fields
    (gdb) fabric PWM STATUS          one, with what the fields mean
    (gdb) fabric file.svd            take them from elsewhere; otherwise build/fabric/mssfoc.svd
"""
import xml.etree.ElementTree as ElementTree
from pathlib import Path

try:
    import gdb
except ImportError:  # outside of GDB: tests
    gdb = None

DEFAULT = Path(__file__).resolve().parents[2] / "build" / "fabric" / "mssfoc.svd"


class Trouble(Exception):
    """One line for the user."""


def read_svd(path):
    """{block: (base, description, [(register, offset, readable, description, [(field, low, high, description)])])}."""
    try:
        root = ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError) as error:
        raise Trouble(f"cannot read {path}: {error}; `make registers` writes it") from error
    return {block.findtext("name"): (int(block.findtext("baseAddress"), 0), block.findtext("description"),
                                     [_register(register) for register in block.iter("register")])
            for block in root.iter("peripheral")}


def _register(register):
    fields = []
    for entry in register.iter("field"):
        high, low = (int(bit) for bit in entry.findtext("bitRange").strip("[]").split(":"))
        fields.append((entry.findtext("name"), low, high, entry.findtext("description")))
    return (register.findtext("name"), int(register.findtext("addressOffset"), 0),
            register.findtext("access") != "write-only", register.findtext("description"), fields)


def show(blocks, words, read):
    """Lines for `fabric` with these words; read(address) gives 32 bits."""
    if not words:
        return [f"{name:<10} {base:#010x}  {what}" for name, (base, what, _) in blocks.items()]
    if words[0] not in blocks:
        raise Trouble(f"no block '{words[0]}'; there are: {', '.join(blocks)}")
    base, _, registers = blocks[words[0]]
    chosen = [register for register in registers if words[1:] in ([], [register[0]])]
    if not chosen:
        raise Trouble(f"{words[0]} has no register '{' '.join(words[1:])}'; it has: {', '.join(r[0] for r in registers)}")
    return [line for register in chosen for line in _lines(register, base, read, len(words) > 1)]


def _lines(register, base, read, explained):
    name, offset, readable, what, fields = register
    value = read(base + offset) if readable else None
    shown = f"{value:#010x}" if readable else "write only"
    parts = {field: value >> low & ((2 << (high - low)) - 1) for field, low, high, _ in fields} if readable else {}
    if not explained:
        taken_apart = "  ".join(f"{field}={part}" for field, part in parts.items())
        yield f"{base + offset:#010x} {name:<14} {shown}  {taken_apart}".rstrip()
        return
    yield f"{base + offset:#010x} {name} {shown}: {what}"
    for field, low, high, meaning in fields:
        yield f"  {field} [{high}:{low}] = {parts.get(field, '-')}: {meaning}"


if gdb:
    class Fabric(gdb.Command):
        """Registers of the fabric by name: fabric [BLOCK [REGISTER]], or fabric FILE.svd."""

        def __init__(self):
            super().__init__("fabric", gdb.COMMAND_DATA)
            self.path, self.blocks = DEFAULT, None

        def invoke(self, argument, from_tty):
            words = argument.split()
            try:
                if words and words[0].endswith(".svd"):
                    self.path, self.blocks = words.pop(0), None
                self.blocks = self.blocks or read_svd(self.path)
                print("\n".join(show(self.blocks, words, self._read)))
            except (Trouble, gdb.MemoryError) as error:
                raise gdb.GdbError(str(error)) from error

        @staticmethod
        def _read(address):
            return int.from_bytes(gdb.selected_inferior().read_memory(address, 4).tobytes(), "little")

    Fabric()
