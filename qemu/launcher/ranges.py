# SPDX-License-Identifier: MIT
"""What the cycle model takes for the device's: nominal values, which are the twin's defaults, and the ranges around them."""
import re

from .data import read_toml
from .paths import QEMU_DIR

RANGES = QEMU_DIR / "chips/ranges.toml"
KEYS = QEMU_DIR / "twin/cycles_keys.c"


def load_ranges():
    """{key of cycles.*: (least, nominal, most)}"""
    return {key: tuple(values) for key, values in read_toml(RANGES).items()}


def defaults():
    """{key of cycles.*: what the twin uses when it is told nothing}"""
    found = re.findall(r"KEY\((\w+), \d+, \d+, (\d+)\)", KEYS.read_text())
    return {name: int(initial) for name, initial in found}


def pessimistic():
    """Lines of the twin's configuration: every range at its worst end."""
    return [f"cycles.{key} {most}" for key, (_, _, most) in load_ranges().items()]
