# SPDX-License-Identifier: MIT
"""A million lines at the console of a drive that is in operation half of the time (console_storm.c): a few seconds."""
import subprocess

import pytest

from unit.conftest import HERE, build_program

LINES = 1_000_000


@pytest.fixture(scope="module")
def storm(tmp_path_factory):
    target = tmp_path_factory.mktemp("storm") / "console_storm"
    build_program(HERE / "console_storm.c", target)
    output = subprocess.run([target, str(LINES), "2463534242"], check=True, capture_output=True, text=True).stdout
    return {name: int(count) for name, count in (line.split() for line in output.splitlines())}


def test_there_was_something_to_judge(storm):
    assert storm["lines"] == LINES and min(storm[kind] for kind in ("noise", "keys", "right", "mutated")) > LINES / 10
    assert storm["set"] > LINES / 20 and storm["commands"] > LINES / 3


@pytest.mark.parametrize("what", ("changed_by_nothing", "other_changed", "not_set", "set_while_on", "out_of_range",
                                  "unanswered"))
def test_nothing_but_a_right_line_does_anything(storm, what):
    assert storm[what] == 0
