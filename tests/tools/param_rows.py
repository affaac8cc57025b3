# SPDX-License-Identifier: MIT
"""The rows of the firmware's parameter table, as its source has them."""
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROW = re.compile(r"^ +PARAM\((\w+), (-?\w+), (-?\w+), (-?\w+)\) +/\* (.*) \*/", re.MULTILINE)


def text_of(source):
    return (source / "firmware/settings/params.h").read_text(encoding="utf-8")


def param_rows(source=ROOT):
    """{parameter: (least, most, initial)}; a bound with a name has its value from the same file."""
    text = text_of(source)
    named = dict(re.findall(r"^#define (\w+) (\d+)$", text, re.MULTILINE))
    return {name: tuple(int(named.get(bound, bound)) for bound in bounds) for name, *bounds, _ in ROW.findall(text)}


def meanings(source=ROOT):
    """{parameter: its remark}."""
    return {name: what for name, *_, what in ROW.findall(text_of(source))}
