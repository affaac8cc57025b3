# SPDX-License-Identifier: MIT
"""Flash and RAM of the image by room, and of the library by function group.

usage: size.py IMAGE.elf LIBRARY.a      (reads IMAGE.map beside the image)
"""
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

FLASH = 254 * 1024
RAM = 64 * 1024


def contributions(map_path, image):
    """(section, object, bytes) of everything the linker placed."""
    text = Path(map_path).read_text()
    text = text[text.index("Linker script and memory map"):]
    text = re.sub(r"\n (\.\S+)\n\s+(0x)", r"\n \1 \2", text)  # long names stand on a line of their own
    output = None
    for line in text.split("\n"):
        head = re.match(r"^(\.\S+)", line)
        if head:
            output = head.group(1)
        part = re.match(r"^ (\.\S+|COMMON)\s+0x[0-9a-f]+\s+0x([0-9a-f]+)\s+(\S+)$", line)
        if part and output and int(part.group(2), 16):
            yield output, part.group(3), int(part.group(2), 16)


def room(name):
    match = re.search(r"/arm/([^/]+)/", name)
    if match:
        return match.group(1)
    if "libmssfoc.a" in name:
        return "lib"
    return "compiler's run-time" if "libgcc" in name else "other"


def image_table(image):
    flash, ram = defaultdict(int), defaultdict(int)
    for section, name, size in contributions(Path(image).with_suffix(".map"), image):
        if section in (".vectors", ".text", ".rodata", ".data"):
            flash[room(name)] += size
        if section in (".data", ".bss", ".noinit"):
            ram[room(name)] += size
        if "stack" in section:
            ram["stacks"] += size
    print(f"{'room':<22}{'flash':>8}{'RAM':>8}")
    for name in sorted(set(flash) | set(ram)):
        print(f"{name:<22}{flash[name]:>8}{ram[name]:>8}")
    print(f"{'sum':<22}{sum(flash.values()):>8}{sum(ram.values()):>8}")
    print(f"{'of':<22}{FLASH:>8}{RAM:>8}")


def library_table(library):
    out = subprocess.run(["arm-none-eabi-size", "-t", library], capture_output=True, text=True, check=True).stdout
    print("\nlibmssfoc.a, bytes")
    print(f"{'object':<22}{'code':>8}{'data':>8}{'bss':>8}")
    for line in out.strip().split("\n")[1:]:
        text, data, bss, _, _, name = line.split(None, 5)
        print(f"{name.split(' ')[0]:<22}{text:>8}{data:>8}{bss:>8}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    image_table(sys.argv[1])
    library_table(sys.argv[2])
