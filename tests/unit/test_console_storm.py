# SPDX-License-Identifier: MIT
"""100 000 lines at the console of a drive that is in operation half of the time (console_storm.c); `make test`: fewer."""
import pytest

from rigs.firmware import HERE, storm

LINES, IN_THE_SAMPLE = 100_000, 50_000


@pytest.fixture(scope="module")
def counts(tmp_path_factory, request):
    count = IN_THE_SAMPLE if request.config.getoption("--sample", False) else LINES
    return storm(HERE / "console_storm.c", tmp_path_factory.mktemp("storm"), count)


def test_there_was_something_to_judge(counts):
    lines = counts["lines"]
    assert lines in (IN_THE_SAMPLE, LINES)
    assert min(counts[kind] for kind in ("noise", "keys", "right", "mutated")) > lines / 10
    assert counts["set"] > lines / 20 and counts["commands"] > lines / 3


@pytest.mark.parametrize("what", ("changed_by_nothing", "other_changed", "not_set", "set_while_on", "out_of_range",
                                  "unanswered"))
def test_nothing_but_a_right_line_does_anything(counts, what):
    assert counts[what] == 0
