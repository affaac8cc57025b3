# SPDX-License-Identifier: MIT
"""The rows of the firmware's tables, as their sources have them: faults, refusals, parameters, objects."""
import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
STRING = r'"((?:[^"\\]|\\.)*)"'
FAULT = re.compile(rf"X\((\d+), (\w+), (0x\w+), ([A-Z |]+), (\w+), (\w+), (?:NULL|{STRING}), {STRING}, {STRING}, {STRING}\) "
                   r"/\* (.*?) \*/")
REFUSAL = re.compile(rf"X\((\d+), (\w+), (?:OF\((\w+), )?{STRING}\)+ /\* (.*?) \*/")
PARAM = re.compile(r'^ +PARAM\((\w+), (-?\w+), (-?\w+), (-?\w+), "([^"]*)"\) \\\n +/\* (\S+\.md): (.*) \*/', re.MULTILINE)
OBJECT = re.compile(r'X\((0x\w+), (\w+), (\w+), (\w+), (\w+), "([^"]*)", "([^"]*)",')
REACTIONS, PARAMS = 0x0400, 0x1000
CHOICES = ("OFF", "STOP", "WARN", "CARRY")


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


def params_text(source):
    return (source / "firmware/settings/params.h").read_text(encoding="utf-8")


def param_rows(source=ROOT):
    """{parameter: (least, most, initial)}; a bound with a name has its value from the same file."""
    text = params_text(source)
    named = dict(re.findall(r"^#define (\w+) (\d+)$", text, re.MULTILINE))
    return {name: tuple(int(named.get(bound, bound)) for bound in bounds) for name, *bounds, _, _, _ in PARAM.findall(text)}


def texts(source=ROOT):
    """{parameter: what it is}, as the console says it."""
    return {name: what for name, _, _, _, what, _, _ in PARAM.findall(params_text(source))}


def remarks(source=ROOT):
    """{parameter: (the page of docs/ that explains it, what it affects)}."""
    return {name: (page, affects) for name, *_, page, affects in PARAM.findall(params_text(source))}


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
