# SPDX-License-Identifier: MIT
"""The one table of texts: everything that can be said has a text of its own, in one form."""
import re
from pathlib import Path

import pytest

from rows import faults, refusals
from messages_packed import APART, FIRST, WAITING_MAX, kinds, literal, packed
from rigs.firmware import ROOT

COUNTS = ("ERROR_COUNT", "FAULT_COUNT", "AXIS_MODES")


def names(c, enum):
    return [name for name in c.enums[enum] if name not in COUNTS]


def text(function, c, enum, name):
    return function(c.enums[enum][name]).decode()


def in_form(said):
    """A phrase that fits behind "error: " and in front of "; see": no sentence's dot, no blank at its ends, printable."""
    return said and said == said.strip() and not said.endswith((".", ",", ";", ":")) and re.fullmatch(r"[ -~]+", said)


@pytest.mark.parametrize("enum, function", [("fault", "message_of_fault"), ("axis_state", "message_of_state"),
                                            ("axis_mode", "message_of_mode"), ("pwm_update", "message_of_update")])
def test_each_has_a_text_of_its_own(c, enum, function):
    said = {name: text(getattr(c, function), c, enum, name) for name in names(c, enum)}
    assert all(in_form(words) for words in said.values()), said
    assert len(set(said.values())) == len(said)
    assert not any(words.startswith("unknown") for words in said.values()), said


@pytest.mark.parametrize("said", ([row.text for row in refusals().values()], [row.hint for row in faults().values()]))
def test_each_refusal_and_hint_is_one_of_its_own(said):
    """The console says the same: test_reference."""
    assert all(map(in_form, said)) and len(set(said)) == len(said), said


def test_what_is_no_fault_or_error_has_a_text_too(c):
    for function in (c.message_of_error, c.message_of_fault, c.message_of_state, c.message_of_mode, c.message_of_update):
        assert function(1000).decode().startswith("unknown")
    assert c.message_fault_hint(1000) == b""


def written(pairs, text):
    """As text_put_char() goes through it."""
    for code in text:
        waiting = [code]
        while waiting:
            one = waiting.pop()
            if ord(one) < FIRST:
                yield one
            else:
                waiting += reversed(pairs[ord(one) - FIRST])
                assert len(waiting) - 1 <= WAITING_MAX


@pytest.mark.parametrize("text", ("\0".join(kinds(("HALL",))["error_texts"]), "a" * 1000, "ab" * 500 + "@#$&" * 40,
                                  "".join(chr(n) * k for n in range(1, 128) for k in range(5))),
                         ids=("refusals", "one", "two", "all"))
def test_packed_it_is_still_the_same(text):
    short, pairs = packed(text)
    assert "".join(written(pairs, short)) == text and len(pairs) == 128
    assert not set(APART) & set("".join(pairs)), "what stands for a value is seen without unpacking"


def test_a_packed_text_is_the_compilers_string_too():
    """No escape takes in the digit behind it, no quote ends it, no question marks are a trigraph's."""
    assert literal('a"\\1??=\x80' + "7") == r"a\042\1341\077\077=\2007"


def test_a_refusal_of_what_is_left_out_has_no_text():
    all_rows = refusals().values()
    full, some = (kinds(features)["error_texts"] for features in ({row.feature for row in all_rows}, ("HALL",)))
    assert [a for a, b in zip(full, some) if a != b] == [row.text for row in all_rows if row.feature not in ("", "HALL")]


def test_each_fault_is_in_the_table_of_docs_faults(c):
    rows = re.findall(r"(?m)^\| ([^|]+?) \| (?:fabric|sample|slow|start|boot) \|", (ROOT / "docs/faults.md").read_text())
    said = [text(c.message_of_fault, c, "fault", name) for name in names(c, "fault") if name != "FAULT_NONE"]
    assert sorted(rows) == sorted(said)


def test_texts_stand_in_one_place():
    """No room but operate/ has words for people; what has a '%' is an instruction.

    A step of identify is one line of its script, a parameter, a fault, a refusal one row of its table, words included; operate/
    alone makes strings of them.
    """
    for path in Path(ROOT / "firmware").rglob("*.[ch]"):
        if path.parent.name != "operate" and path.name not in ("identify.h", "params.h", "fault.h", "error.h"):
            code = re.sub(r"/\*.*?\*/|#include[^\n]*|_Static_assert[^;]*;", "", path.read_text(), flags=re.S)
            strings = [s for s in re.findall(r'"([^"]*)"', code) if " " in s and "%" not in s]
            assert not strings, (path, strings)
