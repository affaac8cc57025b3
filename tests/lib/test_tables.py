# SPDX-License-Identifier: MIT
"""The tables in lib/ are what their formulas say."""
import re
from pathlib import Path

import pytest
from make_tables import TABLES

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("name", TABLES)
def test_source_holds_the_formula(name):
    source, values = TABLES[name]
    text = (ROOT / "lib" / source).read_text()
    body = re.search(rf"\b{name}\[\d*\] = {{(.*?)}};", text, re.S).group(1)
    assert [int(value) for value in body.replace("U", "").replace(",", " ").split()] == values()
