# SPDX-License-Identifier: MIT
"""The tables in lib/ are what their formulas say."""
import re
from pathlib import Path

import pytest
from make_tables import TABLES

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("name", TABLES)
def test_source_holds_the_formula(name):
    text = (ROOT / "lib" / f"{name}.c").read_text()
    body = re.search(r"=\s*{(.*?)};", text, re.S).group(1)
    assert [int(value) for value in body.replace(",", " ").split()] == TABLES[name]()
