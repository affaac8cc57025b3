# SPDX-License-Identifier: MIT
"""The rows of the firmware's tables of faults and of refusals, as their sources have them."""
import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
STRING = r'"((?:[^"\\]|\\.)*)"'
FAULT = re.compile(rf"X\((\d+), (\w+), (0x\w+), ([A-Z |]+), (\w+), (\w+), (?:NULL|{STRING}), {STRING}, {STRING}, {STRING}\) "
                   r"/\* (.*?) \*/")
REFUSAL = re.compile(rf"X\((\d+), (\w+), (?:OF\((\w+), )?{STRING}\)+ /\* (.*?) \*/")


class Fault(NamedTuple):
    number: int
    code: str
    allowed: list
    initial: str
    retry: bool
    text: str
    hint: str
    details: str
    what: str


class Refusal(NamedTuple):
    number: int
    feature: str  # that alone makes it; "": no certain one
    text: str
    helps: str


def joined(path):
    """What the preprocessor makes of continued lines, and a compiler of adjacent strings."""
    text = re.sub(r"\\\n\s*", "", path.read_text(encoding="utf-8"))
    return re.sub(r'"\s*"(?!,|\))', "", text)


def faults(source=ROOT):
    """{name: Fault}"""
    rows = FAULT.findall(joined(source / "firmware/fault/fault.h"))
    return {name: Fault(int(number), code, allowed.split(" | "), initial, retry == "RETRY", *texts)
            for number, name, code, allowed, initial, retry, _, *texts in rows}


def refusals(source=ROOT):
    """{name: Refusal}"""
    return {name: Refusal(int(number), *rest)
            for number, name, *rest in REFUSAL.findall(joined(source / "firmware/settings/error.h"))}
