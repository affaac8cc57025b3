# SPDX-License-Identifier: MIT
"""A million frames on the CAN bus of a drive that is in operation half of the time (canopen_storm.c). `make test`: a fifth."""
import pytest

from rigs.firmware import HERE, storm

FRAMES, IN_THE_SAMPLE = 1_000_000, 200_000


@pytest.fixture(scope="module")
def counts(tmp_path_factory, request):
    count = IN_THE_SAMPLE if request.config.getoption("--sample", False) else FRAMES
    return storm(HERE / "canopen_storm.c", tmp_path_factory.mktemp("storm"), count)


def test_there_was_something_to_judge(counts):
    assert counts["frames"] in (IN_THE_SAMPLE, FRAMES)
    assert min(counts[kind] for kind in ("meant", "noise")) > counts["frames"] / 5
    assert counts["answered"] > counts["aborted"] > 0 and counts["written"] > counts["frames"] / 1000
    assert counts["process"] > counts["frames"] / 50


@pytest.mark.parametrize("what", ("changed_by_nothing", "answered_nothing", "not_one_answer", "refused_but_changed",
                                  "process_changed_more"))
def test_nothing_is_done_that_no_frame_asked_for(counts, what):
    assert counts[what] == 0
