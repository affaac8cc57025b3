# SPDX-License-Identifier: MIT
"""docs/reference.md: no parameter, fault or refusal without its entry; numbers never change; the console says the same."""
import re
import sys
import tomllib
from pathlib import Path

import pytest

from rigs.console import Operator
from rigs.firmware import ROOT
from rigs.settings import names

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))

from rows import faults, param_rows, refusals, remarks, texts  # noqa: E402
import reference_page  # noqa: E402  (beside the tools)
from pages import replaced  # noqa: E402

PAGE = (ROOT / "docs/reference.md").read_text()
FROZEN = tomllib.loads((ROOT / "tests/unit/numbers.toml").read_text())
ENUMS = {"fault": ("fault", "FAULT_"), "refusal": ("error", "ERROR_")}


@pytest.mark.parametrize("name", reference_page.TABLES)
def test_the_tables_are_fresh(name):
    assert replaced(PAGE, name, reference_page.TABLES[name]()) == PAGE, "tests/tools/reference_page.py writes them anew"


@pytest.mark.parametrize("kind", ENUMS)
def test_numbers_are_those_given_once(c, kind):
    enum, prefix = ENUMS[kind]
    numbers = {name.removeprefix(prefix): number for name, number in c.enums[enum].items() if not name.endswith("_COUNT")}
    assert numbers == FROZEN[kind], "tests/unit/numbers.toml: append what is new, change nothing"
    assert sorted(numbers.values()) == list(range(len(numbers))), "one each, without a gap"


def test_registers_of_parameters_are_those_given_once(c):
    rows = {row.name.decode(): n for n, row in enumerate(names(c))}
    assert rows == FROZEN["parameter"], "tests/unit/numbers.toml: append what is new, change nothing"


def test_each_parameter_is_explained_where_it_says():
    said = texts()
    assert len(set(said.values())) == len(said) and all(re.fullmatch(r"[ -~]{4,80}(?<![.,;:])", text) for text in said.values())
    for name, (page, affects) in remarks().items():
        shown = re.sub(r"_[2-5]_", "_1_", name)
        assert f"`{shown}`" in (ROOT / "docs" / page).read_text(), f"{page} does not speak of {name}"
        assert len(affects) > 3


def test_each_fault_and_refusal_has_a_remark():
    assert not [name for name, row in faults().items() if len(row.what) < 4]
    assert not [name for name, row in refusals().items() if len(row.helps) < 4]


@pytest.mark.parametrize("kind", ENUMS)
def test_each_number_has_its_row(kind):
    rows = PAGE.split(f"<!-- {kind}s:")[1].split("<!-- end -->")[0]
    assert re.findall(r"^\| (\d+) \|", rows, re.M) == [str(n) for n in sorted(FROZEN[kind].values()) if n]


def test_help_says_the_same(c):
    operator = Operator(c)
    for name, text in texts().items():
        least, most, initial = param_rows()[name]
        first, second = operator(f"help {name}")[:2]
        unit = reference_page.unit_of(name)
        assert first == f"{name}: {text}" and second == f"{least}...{most}{unit and ' ' + unit}, initially {initial}"
    for row in faults().values():
        typed = row.text.replace(" ", "_").lower()
        assert operator(f"help {typed}")[-1] == f"fault {row.number}, {row.text}: look at: {row.hint}"
    for row in refusals().values():
        text = re.sub("[@#$&]", "...", row.text)
        assert operator(f"help {row.number}") == [f"refusal {row.number}: {text}"]
    for number in (0, -1, c.ERROR_COUNT):
        assert operator(f"help {number}")[0].startswith(f"error: {number}: no command")
