# SPDX-License-Identifier: MIT
"""The rows of the firmware's table of objects, which are Modbus registers as well, and what a fault leaves to choose."""
import re
from pathlib import Path

from cause_rows import faults

ROOT = Path(__file__).resolve().parents[2]
OBJECT = re.compile(r'X\((0x\w+), (\w+), (\w+), (\w+), (\w+), "([^"]*)", "([^"]*)",')
REACTIONS, PARAMS = 0x0400, 0x1000
CHOICES = ("OFF", "STOP", "WARN", "CARRY")


def objects(source=ROOT):
    """[(register, index, type, access, name, unit, what)] of the firmware's table."""
    text = (source / "firmware/operate/objects.h").read_text(encoding="utf-8")
    return [(int(at, 16), int(index, 16), *rest) for at, index, *rest in OBJECT.findall(text)]


def reactions(source=ROOT):
    """(number, fault, choices, initial) of those that leave a choice: the others take 0 alone."""
    for name, row in faults(source).items():
        words = [word.replace("SLOWER", "CARRY") for word in row.allowed]
        choices = [f"{CHOICES.index(word)} {word.lower()}" for word in words]
        if len(choices) > 1:
            yield row.number, name.lower().replace("_", " "), choices, CHOICES.index(row.initial)
