# SPDX-License-Identifier: MIT
"""The images of this folder: with which wait states each runs, and what is published for which code."""
import re
from dataclasses import dataclass

from target.runner import BUILD, CLOSING, run_image

ZERO = {"apb_read": 0, "apb_write": 0, "ppb": 0, "esram": 0, "envm_wait": 0, "cache": 1, "vector": 0}
HAND_COUNTED = {
    "rules": ZERO,
    "waits": ZERO | {"apb_read": 3, "apb_write": 2, "ppb": 1, "esram": 1},
    "esram": ZERO | {"esram": 1},
    "fetch": ZERO | {"envm_wait": 2, "cache": 0},
}
TOLERANCE = 0.03


@dataclass(frozen=True)
class Published:
    """A measurement on silicon; `name` is the row of published.S."""
    name: str
    cycles: float
    source: str


SCHWABE = "Schwabe, Stoffelen: All the AES You Need on Cortex-M3 and M4 (SAC 2016), table of their README, STM32L100C"
PUBLISHED = (
    Published("delay loop, 100 times", 300, "blaatschaap.be, wait-a-microsecond: SUBS BHI takes 1 + 2 on STM32F103, from RAM"),
    Published("AES-128 key expansion", 243.9, SCHWABE),
    Published("AES-128, one block", 639.5, SCHWABE),
)


def run(name, out_dir, extra=()):
    """What an image printed."""
    waits = HAND_COUNTED.get(name, ZERO)
    lines = [f"cycles.{key} {value}" for key, value in waits.items()]
    text = run_image(BUILD / "tests" / "timing" / f"{name}.elf", out_dir, [*lines, *extra])
    assert CLOSING.search(text), f"{name}: no closing line:\n{text[-2000:]}"
    return text


def sequences(text):
    """The hand-counted rows of an image: those that agree, and the lines of those that do not."""
    return re.findall(r"(?m)^ok (.*?)\r?$", text), re.findall(r"(?m)^FAIL (.*?)\r?$", text)


def measured(text):
    return {name: int(cycles) for name, cycles in re.findall(r"(?m)^# (.*) (\d+)(?: \(.*\))?\r?$", text)}
