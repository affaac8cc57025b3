# SPDX-License-Identifier: MIT
"""The rows of the firmware's parameter table, as its source has them."""
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROW = re.compile(r'^ +PARAM\((\w+), (-?\w+), (-?\w+), (-?\w+), "([^"]*)"\) \\\n +/\* (\S+\.md): (.*) \*/', re.MULTILINE)


def text_of(source):
    return (source / "firmware/settings/params.h").read_text(encoding="utf-8")


def param_rows(source=ROOT):
    """{parameter: (least, most, initial)}; a bound with a name has its value from the same file."""
    text = text_of(source)
    named = dict(re.findall(r"^#define (\w+) (\d+)$", text, re.MULTILINE))
    return {name: tuple(int(named.get(bound, bound)) for bound in bounds) for name, *bounds, _, _, _ in ROW.findall(text)}


def texts(source=ROOT):
    """{parameter: what it is}, as the console says it."""
    return {name: what for name, _, _, _, what, _, _ in ROW.findall(text_of(source))}


def remarks(source=ROOT):
    """{parameter: (the page of docs/ that explains it, what it affects)}."""
    return {name: (page, affects) for name, *_, page, affects in ROW.findall(text_of(source))}
