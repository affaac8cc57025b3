# SPDX-License-Identifier: MIT
"""The one table of texts: everything that can be said has a text of its own, in one form."""
import re
from pathlib import Path

import pytest

from rigs.firmware import ROOT

COUNTS = ("ERROR_COUNT", "FAULT_COUNT", "AXIS_MODES")


def names(c, enum):
    return [name for name in c.enums[enum] if name not in COUNTS]


def text(function, c, enum, name):
    return function(c.enums[enum][name]).decode()


def in_form(said):
    """A phrase that fits behind "error: " and in front of "; see": no sentence's dot, no blank at its ends, printable."""
    return said and said == said.strip() and not said.endswith((".", ",", ";", ":")) and re.fullmatch(r"[ -~]+", said)


@pytest.mark.parametrize("enum, function", [("error", "message_of_error"), ("fault", "message_of_fault"),
                                            ("axis_state", "message_of_state"), ("axis_mode", "message_of_mode"),
                                            ("pwm_update", "message_of_update")])
def test_each_has_a_text_of_its_own(c, enum, function):
    said = {name: text(getattr(c, function), c, enum, name) for name in names(c, enum)}
    assert all(in_form(words) for words in said.values()), said
    assert len(set(said.values())) == len(said)
    assert not any(words.startswith("unknown") for words in said.values()), said


def test_each_fault_has_a_hint_of_its_own(c):
    hints = {name: text(c.message_fault_hint, c, "fault", name) for name in names(c, "fault") if name != "FAULT_NONE"}
    assert all(in_form(hint) for hint in hints.values()), hints
    assert len(set(hints.values())) == len(hints)


def test_what_is_no_fault_or_error_has_a_text_too(c):
    for function in (c.message_of_error, c.message_of_fault, c.message_of_state, c.message_of_mode, c.message_of_update):
        assert function(1000).decode().startswith("unknown")
    assert c.message_fault_hint(1000) == b""


def test_each_fault_is_in_the_table_of_docs_faults(c):
    rows = re.findall(r"(?m)^\| ([^|]+?) \| (?:fabric|sample|slow|start|boot) \|", (ROOT / "docs/faults.md").read_text())
    said = [text(c.message_of_fault, c, "fault", name) for name in names(c, "fault") if name != "FAULT_NONE"]
    assert sorted(rows) == sorted(said)


def test_texts_stand_in_one_place():
    """No room but operate/ has words for people; what has a '%' is an instruction.

    A step of identify is one line of its script, a parameter one row of its table, words included; operate/ alone makes strings
    of them.
    """
    for path in Path(ROOT / "firmware").rglob("*.[ch]"):
        if path.parent.name != "operate" and path.name not in ("identify_script.h", "params.h"):
            code = re.sub(r"/\*.*?\*/|#include[^\n]*|_Static_assert[^;]*;", "", path.read_text(), flags=re.S)
            strings = [s for s in re.findall(r'"([^"]*)"', code) if " " in s and "%" not in s]
            assert not strings, (path, strings)
