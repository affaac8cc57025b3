# SPDX-License-Identifier: MIT
"""Who enters the image and who interrupts whom: the vector table of the image, the priorities of the sources."""
import os
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

from disasm import ImageError

ROOT = Path(__file__).resolve().parents[2]
SYSTEM_VECTORS = 16
RESET, SVCALL = 1, 11
VECTORS_MOST = 128
CHOICES = "handlers_of_axes"  # firmware/system/handlers.c
HARDWARE_FRAME = 32 + 4  # eight words, and one that aligns the stack to 8 bytes (ARMv7-M, B1.5.7)


@dataclass(frozen=True)
class Entry:
    """An exception with a handler of its own. `priority` is None for what no priority can hold back."""
    number: int
    function: object
    priority: object = None


def vector_entries(image):
    """(reset, fault function, [Entry of every other handler], without priorities) from the image's vector table and from
    what may take a place in it later.

    The fault function is the one that vectors 2...6 and all interrupts without an owner end in.
    """
    start, size = image.objects.get("vectors") or (image.value("vectors"), 4 * SYSTEM_VECTORS)
    words = {number: image.word(start + 4 * number) for number in range(1, size // 4)}
    functions = {number: image.functions_at.get(word & ~1) for number, word in words.items() if word}
    for number, function in functions.items():
        if function is None or not words[number] & 1:
            raise ImageError(f"vector {number} holds {words[number]:#x}, which is no function's start")
    fault = functions[3]  # HardFault
    entries = [Entry(number, function) for number, function in functions.items()
               if number != RESET and function is not fault]
    entries += [Entry(number, function) for number, others in choices(image).items() for function in others
                if Entry(number, function) not in entries]
    return functions[RESET], fault, entries


def choices(image):
    """{exception number: [functions]} that the image's struct loop_handlers offer to a vector (control/current_loop.h)."""
    found, vectors = {}, image.values.get("startup_vectors")
    for start, size in (place for name, place in image.objects.items() if name == CHOICES):
        for word in (image.word(at) for at in range(start, start + size, 4)):
            if vectors <= word < vectors + 4 * VECTORS_MOST:  # the next axis's begin with their vector's place
                functions = found.setdefault((word - vectors) // 4, [])
            elif word:  # 0: left out of this build
                functions.append(image.functions_at[word & ~1])
    return found


def source_priorities(root=ROOT):
    """{exception number: priority} of every nvic_priority(IRQ, LEVEL) call in firmware/, as the compiler sees the names."""
    found = []
    for path in sorted((root / "firmware").rglob("*.c")):
        found += re.findall(r"\bnvic_priority\(([^,;]+),\s*([^;]+)\);", path.read_text())
    names = "".join(f"PRIORITY {irq} = {level}\n" for irq, level in found)
    headers = '#include "firmware/settings/config.h"\n#include "drivers/board.h"\n'
    out = subprocess.run([os.environ.get("CROSS", "arm-none-eabi-") + "gcc", "-E", "-P", "-I", str(root), "-xc", "-"],
                         input=headers + names, capture_output=True, text=True, check=True).stdout
    priorities = {}
    for irq, level in re.findall(r"PRIORITY (.*?) = (.*)", out):
        priorities[SYSTEM_VECTORS + _constant(irq)] = _constant(level)
    return priorities


def _constant(text):
    plain = re.sub(r"\b(0x[0-9a-fA-F]+|\d+)[uUlL]*\b", r"\1", text)
    if not re.fullmatch(r"[0-9a-fA-Fx+*/() <|-]+", plain):
        raise ImageError(f"'{text}' is not a constant")
    return int(eval(plain, {"__builtins__": {}}))  # pylint: disable=eval-used


def with_priorities(entries, priorities):
    for entry in entries:
        if entry.number not in priorities:
            raise ImageError(f"{entry.function.name} has a vector but no priority: a bound needs to know what it interrupts")
    return sorted((Entry(e.number, e.function, priorities[e.number]) for e in entries), key=lambda e: -e.priority)
