# SPDX-License-Identifier: MIT
"""A million lines at the console of a drive that is in operation half of the time (console_storm.c): a few seconds."""
import pytest

from unit.conftest import HERE, storm

LINES = 1_000_000


@pytest.fixture(scope="module")
def counts(tmp_path_factory):
    return storm(HERE / "console_storm.c", tmp_path_factory.mktemp("storm"), LINES)


def test_there_was_something_to_judge(counts):
    assert counts["lines"] == LINES and min(counts[kind] for kind in ("noise", "keys", "right", "mutated")) > LINES / 10
    assert counts["set"] > LINES / 20 and counts["commands"] > LINES / 3


@pytest.mark.parametrize("what", ("changed_by_nothing", "other_changed", "not_set", "set_while_on", "out_of_range",
                                  "unanswered"))
def test_nothing_but_a_right_line_does_anything(counts, what):
    assert counts[what] == 0
