# SPDX-License-Identifier: MIT
"""A million frames on the line of a drive that is in operation half of the time (modbus_storm.c): a few seconds."""
import pytest

from unit.conftest import HERE, storm

FRAMES = 1_000_000


@pytest.fixture(scope="module")
def counts(tmp_path_factory):
    return storm(HERE / "modbus_storm.c", tmp_path_factory.mktemp("storm"), FRAMES)


def test_there_was_something_to_judge(counts):
    assert counts["frames"] == FRAMES and min(counts[kind] for kind in ("right", "mutated", "foreign", "noise")) > FRAMES / 5
    assert counts["answered"] > counts["exceptions"] > 0 and counts["written"] > 1000


@pytest.mark.parametrize("what", ("changed_by_nothing", "answered_nothing", "wrong_reply", "late_reply", "refused_but_changed",
                                  "unanswered"))
def test_nothing_but_a_request_to_this_drive_does_anything(counts, what):
    assert counts[what] == 0
