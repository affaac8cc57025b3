# SPDX-License-Identifier: MIT
"""docs/modbus.md shows the registers that there are: its tables are those of the sources, these those of the program."""
import sys
from pathlib import Path

import pytest

from rigs.firmware import ROOT

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))

import modbus_page  # noqa: E402  (beside the tools)
from pages import replaced  # noqa: E402

PAGE = (ROOT / "docs/modbus.md").read_text()


@pytest.mark.parametrize("name", modbus_page.TABLES)
def test_the_tables_are_fresh(name):
    assert replaced(PAGE, name, modbus_page.TABLES[name](ROOT)) == PAGE, "tests/tools/modbus_page.py writes them anew"


def test_the_objects_are_those_of_the_program(c):
    rows = modbus_page.objects(ROOT)
    assert len(rows) == c.OBJECT_COUNT == len(c.objects)
    for number, (at, _, kind, access, name, *_) in enumerate(rows):
        found = c.objects[number]
        assert number == getattr(c, f"OBJECT_{name}")
        assert (found.at, found.type, found.writable) == (at, getattr(c, f"OBJECT_TYPE_{kind}"), access == "RW")


def test_the_parameters_are_where_the_table_says(c):
    for number, name in enumerate(modbus_page.param_rows(ROOT)):
        assert f"| {4096 + 2 * number}...{4097 + 2 * number} | `{name}` |" in PAGE
