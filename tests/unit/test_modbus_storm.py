# SPDX-License-Identifier: MIT
"""A million frames on the line of a drive that is in operation half of the time (modbus_storm.c): a few seconds."""
import subprocess

import pytest

from unit.conftest import HERE, build_program

FRAMES = 1_000_000


@pytest.fixture(scope="module")
def storm(tmp_path_factory):
    target = tmp_path_factory.mktemp("storm") / "modbus_storm"
    build_program(HERE / "modbus_storm.c", target)
    output = subprocess.run([target, str(FRAMES), "2463534242"], check=True, capture_output=True, text=True).stdout
    return {name: int(count) for name, count in (line.split() for line in output.splitlines())}


def test_there_was_something_to_judge(storm):
    assert storm["frames"] == FRAMES and min(storm[kind] for kind in ("right", "mutated", "foreign", "noise")) > FRAMES / 5
    assert storm["answered"] > storm["exceptions"] > 0 and storm["written"] > 1000


@pytest.mark.parametrize("what", ("changed_by_nothing", "answered_nothing", "wrong_reply", "late_reply", "refused_but_changed",
                                  "unanswered"))
def test_nothing_but_a_request_to_this_drive_does_anything(storm, what):
    assert storm[what] == 0
