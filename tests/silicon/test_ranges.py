# SPDX-License-Identifier: MIT
"""Cycles that are known as ranges: qemu/chips/ranges.toml, the twin's defaults and docs/silicon.md say the same."""
import re

import pytest

from launcher.ranges import KEYS, RANGES, defaults, load_ranges
from silicon import facts

FACT = re.compile(r"(?m)^(\w+) = .*# fact (\S+)$")
VALUE = re.compile(r"(\d+) cycles?, (\d+)\.\.\.(\d+)")
SWITCHES = {"cache", "cold"}  # say how, not how long


def fact_of():
    return dict(FACT.findall(RANGES.read_text()))


def documented(text=None):
    """{fact: (least, nominal, most)} of the facts with a range in cycles."""
    found = {fact.name: VALUE.fullmatch(fact.value) for fact in facts.facts(text)}
    return {name: (int(m[2]), int(m[1]), int(m[3])) for name, m in found.items() if m}


def test_each_key_of_the_cycle_model_has_a_range_and_a_fact():
    assert set(load_ranges()) == set(defaults()) - SWITCHES == set(fact_of())


def test_the_nominal_values_are_the_twin_s_defaults():
    assert {key: nominal for key, (_, nominal, _) in load_ranges().items()} == {
        key: value for key, value in defaults().items() if key not in SWITCHES}


def test_the_page_has_the_same_ranges():
    names = fact_of()
    assert {names[key]: tuple(values) for key, values in load_ranges().items()} == documented()


def test_a_page_with_another_range_is_noticed():
    text = facts.PAGE.read_text()
    assert text.count("| 23 cycles, 18...40 |") == 1
    assert documented(text.replace("| 23 cycles, 18...40 |", "| 23 cycles, 18...45 |")) != documented(text)


@pytest.mark.parametrize("key", sorted(load_ranges()))
def test_a_range_is_in_order(key):
    least, nominal, most = load_ranges()[key]
    assert 0 <= least <= nominal <= most and KEYS.is_file()
