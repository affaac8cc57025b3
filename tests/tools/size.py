# SPDX-License-Identifier: MIT
"""Flash and RAM of the image by room; flash, RAM and stack of the library by function; files, lines and tokens of the sources.

usage: size.py IMAGE.elf LIBRARY.a      (reads IMAGE.map beside the image)
"""
import os
import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "linker/bounds"))

from disasm import Image  # noqa: E402
from frames import deepest  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
TOKEN = re.compile(r"""//[^\n]*|/\*.*?\*/|(?P<token>[A-Za-z_]\w*|\.?\d[\w.]*|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|"""
                   r"""<<=|>>=|\.\.\.|->|\+\+|--|&&|\|\||##|[-+*/%&|^<>=!]=|<<|>>|[^\s\w\\])""", re.DOTALL)
FLASH = 240 * 1024
RAM = 64 * 1024
CROSS = os.environ.get("CROSS", "arm-none-eabi-")
# output sections of the linker script; what start-up copies is in both
IN_FLASH = (".text", ".data", ".chords")
IN_RAM = (".data", ".chords", ".bss", ".noinit")


@dataclass
class Row:
    """A function or a constant table of the library, bytes."""
    name: str
    flash: int
    ram: int    # of the object it stands in: .data and .bss
    stack: int  # at most, with what it calls; None for a table


def contributions(map_path):
    """(section, object, bytes) of everything the linker placed.

    By addresses, since what the map calls a size is not always what a part takes: strings that are merged with others' take
    nothing, which some linkers say (2.40) and others do not (2.44).
    """
    text = Path(map_path).read_text()
    text = text[text.index("Linker script and memory map"):]
    text = re.sub(r"\n( ?\.\S+)\n\s+(0x)", r"\n\1 \2", text)  # long names stand on a line of their own
    output, placed = None, []  # [address, bytes, object, or None where nothing but the address counts]
    for output_name, name, address, size, owner in re.findall(
            r"^(?:(\.\S+)| (\.\S+|COMMON|\*fill\*)) +0x([0-9a-f]+) +0x([0-9a-f]+)(?: +(.*))?$", text, re.M):
        start, size = int(address, 16), int(size, 16)
        if output_name:
            yield from _without_overlap(output, placed)
            output, placed = output_name, []
            end = [start + size, 0, None]
        elif output:
            placed[-1:] = [[start, size, None if name == "*fill*" else owner], end]
    yield from _without_overlap(output, placed)


def _without_overlap(output, placed):
    for (start, size, owner), (following, *_) in zip(placed, placed[1:]):
        if owner and min(size, following - start) > 0:
            yield output, owner, min(size, following - start)


def room(name):
    match = re.search(r"/arm/([^/]+)/", name)
    if match:
        return match.group(1)
    if "libmssfoc.a" in name:
        return "lib"
    return "compiler's run-time" if "libgcc" in name or name == "linker stubs" else "other"


def image_table(image):
    flash, ram = defaultdict(int), defaultdict(int)
    for section, name, size in contributions(Path(image).with_suffix(".map")):
        if section in IN_FLASH:
            flash[room(name)] += size
        if section in IN_RAM:
            ram[room(name)] += size
        if "stack" in section:
            ram["stacks"] += size
    print(f"{'room':<22}{'flash':>8}{'RAM':>8}")
    for name in sorted(set(flash) | set(ram)):
        print(f"{name:<22}{flash[name]:>8}{ram[name]:>8}")
    print(f"{'sum':<22}{sum(flash.values()):>8}{sum(ram.values()):>8}")
    print(f"{'of':<22}{FLASH:>8}{RAM:>8}")


def output(tool, *arguments):
    return subprocess.run([CROSS + tool, *map(str, arguments)], capture_output=True, text=True, check=True).stdout


def object_sizes(library):
    """{object: (code and constants, data, bss)} of an archive."""
    rows = [line.split(None, 5) for line in output("size", library).strip().split("\n")[1:]]
    return {name.split(" ")[0]: (int(text), int(data), int(bss)) for text, data, bss, _, _, name in rows}


def library_rows(library):
    """A Row for each function and table that has a name. What a function calls is found by linking all of the library."""
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / "whole.elf"
        output("gcc", "-mcpu=cortex-m3", "-mthumb", "-nostdlib", "-Wl,-e,0", "-Wl,--whole-archive", library,
               "-Wl,--no-whole-archive", "-lgcc", "-o", whole)
        image = Image(whole)
    sizes = object_sizes(library)
    for line in output("nm", "-A", "-S", "--defined-only", library).splitlines():
        match = re.match(r"^.*:([^:]+):[0-9a-f]+ ([0-9a-f]+) (\w) (\S+)$", line)
        if match and "_LIB_TRIG_FRAC_" not in match[4]:  # a function's second name (Lib.h)
            unit, size, kind, name = match.groups()
            stack = deepest(image, image.functions[name])[0] if kind in "tTW" else None
            yield Row(name, int(size, 16) if kind in "tTWrRV" else 0, sum(sizes[unit][1:]), stack)


def library_table(library):
    print("\nlibmssfoc.a, bytes")
    print(f"{'object':<22}{'flash':>8}{'.data':>8}{'.bss':>8}")
    sizes = object_sizes(library)
    for name, row in [*sizes.items(), ("sum", tuple(map(sum, zip(*sizes.values()))))]:
        print(f"{name:<22}{row[0]:>8}{row[1]:>8}{row[2]:>8}")
    print(f"\n{'function or table':<22}{'flash':>8}{'RAM':>8}{'stack':>8}")
    for row in sorted(library_rows(library), key=lambda row: (row.stack is None, row.name)):
        print(f"{row.name:<22}{row.flash:>8}{row.ram:>8}{'' if row.stack is None else row.stack:>8}")


def tokens(text):
    """How many a C compiler reads, preprocessor's included."""
    return sum(match["token"] is not None for match in TOKEN.finditer(text))


def source_table(root=ROOT):
    print(f"\n{'C sources':<22}{'files':>8}{'lines':>8}{'tokens':>8}")
    for folder in ("firmware", "drivers", "lib", "startup"):
        texts = [path.read_text(encoding="utf-8") for path in sorted((root / folder).rglob("*.[ch]"))]
        print(f"{folder:<22}{len(texts):>8}{sum(text.count(chr(10)) for text in texts):>8}{sum(map(tokens, texts)):>8}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    image_table(sys.argv[1])
    library_table(sys.argv[2])
    source_table()
