# SPDX-License-Identifier: MIT
"""200 000 frames on the line of a drive that is in operation half of the time (modbus_storm.c). `make test`: half of them."""
import pytest

from rigs.firmware import HERE, storm

FRAMES, IN_THE_SAMPLE = 200_000, 100_000


@pytest.fixture(scope="module")
def counts(tmp_path_factory, request):
    count = IN_THE_SAMPLE if request.config.getoption("--sample", False) else FRAMES
    return storm(HERE / "modbus_storm.c", tmp_path_factory.mktemp("storm"), count)


def test_there_was_something_to_judge(counts):
    frames = counts["frames"]
    assert frames in (IN_THE_SAMPLE, FRAMES)
    assert min(counts[kind] for kind in ("right", "mutated", "foreign", "noise")) > frames / 5
    assert counts["answered"] > counts["exceptions"] > 0 and counts["written"] > frames / 1000


@pytest.mark.parametrize("what", ("changed_by_nothing", "answered_nothing", "wrong_reply", "late_reply", "refused_but_changed",
                                  "unanswered"))
def test_nothing_but_a_request_to_this_drive_does_anything(counts, what):
    assert counts[what] == 0
