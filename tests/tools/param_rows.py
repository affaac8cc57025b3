# SPDX-License-Identifier: MIT
"""The rows of the firmware's parameter table, as its source has them."""
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROW = re.compile(r"^ +PARAM\((\w+), (-?\w+), (-?\w+), (-?\w+)\)", re.MULTILINE)


def param_rows(source=ROOT):
    """{parameter: (least, most, initial)}; a bound with a name has its value from params.h."""
    settings = source / "firmware/settings"
    named = dict(re.findall(r"^#define (\w+) (\d+)$", (settings / "params.h").read_text(encoding="utf-8"), re.MULTILINE))
    rows = ROW.findall((settings / "params.c").read_text(encoding="utf-8"))
    return {name: tuple(int(named.get(bound, bound)) for bound in bounds) for name, *bounds in rows}
