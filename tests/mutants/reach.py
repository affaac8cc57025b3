# SPDX-License-Identifier: MIT
"""Which functions of its image a test executes at the twin, and which a mutant changes: a test that executes none of those says
nothing of it, and need not be asked."""
import re
import subprocess

from elftools.elf.elffile import ELFFile

SPAN = 0x80000  # as qemu/twin/reach.h has it
ESRAM = 2
CODE = re.compile(r"\.text\.(?:unlikely\.|startup\.)?(.+)")
QUIET = (".ARM.", ".eh_frame", ".rela.", ".rel.", ".debug", ".comment", ".note")  # nobody executes or reads these
HEADING = re.compile(r"^(?:Contents of section |RELOCATION RECORDS FOR \[)([^\]\s]+?)\]?:$", re.MULTILINE)


def _place(address):
    return (address % SPAN + (SPAN if address >> 28 == ESRAM else 0)) // 2


class Functions:
    """Those of a linked image."""

    def __init__(self, path):
        with open(path, "rb") as stream:
            table = ELFFile(stream).get_section_by_name(".symtab")
            self.places = [(symbol.name, symbol["st_value"] & ~1, symbol["st_size"]) for symbol in table.iter_symbols()
                           if symbol["st_info"]["type"] == "STT_FUNC" and symbol["st_size"]]

    def executed(self, bits):
        """The names of those of which the twin's TWIN_REACH saw any instruction."""
        number = int.from_bytes(bits, "little")
        return frozenset(name for name, address, size in self.places
                         if number >> _place(address) & ((1 << size // 2) - 1))


def _sections(path, objdump):
    """{name: what it holds and what it refers to}."""
    text = subprocess.run([objdump, "-s", "-r", path], capture_output=True, text=True, check=True).stdout
    parts, found = HEADING.split(text)[1:], {}
    for name, part in zip(parts[::2], parts[1::2]):
        if not name.startswith(QUIET):
            found[name] = found.get(name, "") + part
    return found


def changed_functions(pairs, objdump="objdump"):
    """The functions that differ between objects as they were and as they are, [(path, path)]; None if more than code does."""
    names = set()
    for was, now in pairs:
        try:
            before, after = _sections(was, objdump), _sections(now, objdump)
        except subprocess.CalledProcessError:
            return None  # there is none now
        for name in {*before, *after}:
            if before.get(name) != after.get(name):
                function = CODE.fullmatch(name)
                if not function:
                    return None
                names |= {function[1]} if name in before else set()
    return frozenset(names)
