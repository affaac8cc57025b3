# SPDX-License-Identifier: MIT
"""docs/reference.md: no parameter, fault or refusal without its entry; numbers never change; the console says the same."""
import re
import sys
import tomllib
from pathlib import Path

import pytest

from rigs.firmware import ROOT
from rigs.console import Operator

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))

import reference_page  # noqa: E402  (beside the tools)
from pages import replaced  # noqa: E402
from param_rows import param_rows, remarks, texts  # noqa: E402

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
    rows = {row.name.decode(): n for n, row in enumerate(rows_of(c))}
    assert rows == FROZEN["parameter"], "tests/unit/numbers.toml: append what is new, change nothing"


def rows_of(c):
    import ctypes
    count = c.param_count.value if hasattr(c.param_count, "value") else c.param_count
    table = ctypes.cast(ctypes.addressof(ctypes.c_char.in_dll(c._library, "param_table")), ctypes.POINTER(c.param_info))
    return [table[n] for n in range(count)]


def test_each_parameter_is_explained_where_it_says(c):
    said = {name: c.message_of_param(n).decode() for n, name in enumerate(param_rows())}
    assert said == texts()
    assert len(set(said.values())) == len(said) and all(re.fullmatch(r"[ -~]{4,80}(?<![.,;:])", text) for text in said.values())
    for name, (page, affects) in remarks().items():
        shown = re.sub(r"_[2-5]_", "_1_", name)
        assert f"`{shown}`" in (ROOT / "docs" / page).read_text(), f"{page} does not speak of {name}"
        assert len(affects) > 3


@pytest.mark.parametrize("path", ("fault/fault.h", "settings/error.h"))
def test_each_fault_and_refusal_has_a_remark(path):
    assert not [name for name, (number, remark) in reference_page.numbers(path).items() if number and len(remark) < 4]


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
    for number in range(1, c.FAULT_COUNT):
        name = c.message_of_fault(number).decode()
        typed = name.replace(" ", "_").lower()
        assert operator(f"help {typed}")[-1] == (f"fault {number}, {name}: look at: {c.message_fault_hint(number).decode()}")
    for number in range(1, c.ERROR_COUNT):
        text = re.sub("[@#$]", "...", c.message_of_error(number).decode())
        assert operator(f"help {number}") == [f"refusal {number}: {text}"]
    for number in (0, -1, c.ERROR_COUNT):
        assert operator(f"help {number}")[0].startswith(f"error: {number}: no command")
