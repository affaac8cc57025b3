# SPDX-License-Identifier: MIT
"""The rows of the firmware's parameter table, as its source has them."""
import re
from pathlib import Path

SETTINGS = Path(__file__).resolve().parents[2] / "firmware/settings"
ROW = re.compile(r"^ +PARAM\((\w+), (\w+), (\w+), (\w+)\)", re.MULTILINE)


def param_rows():
    """{parameter: (least, most, initial)}; a bound with a name has its value from params.h."""
    named = dict(re.findall(r"^#define (\w+) (\d+)$", (SETTINGS / "params.h").read_text(encoding="utf-8"), re.MULTILINE))
    rows = ROW.findall((SETTINGS / "params.c").read_text(encoding="utf-8"))
    return {name: tuple(int(named.get(bound, bound)) for bound in bounds) for name, *bounds in rows}
