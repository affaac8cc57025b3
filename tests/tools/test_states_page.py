# SPDX-License-Identifier: MIT
"""The drive's table of states: drawn as it is, complete, and with no change that CiA 402 does not have."""
import re

import pytest
import states_page


def test_the_page_is_drawn_from_the_table():
    text = states_page.PAGE.read_text()
    assert states_page.page(text) == text, "run tests/tools/states_page.py"


def test_each_change_is_one_of_the_standards():
    missing = [row for row in states_page.rows() if states_page.standard(row[0], row[2]) is None]
    assert not missing


def test_each_event_and_each_state_has_a_row():
    events = {row[1] for row in states_page.rows()}
    assert events == set(re.findall(r"DRIVE_EVENT_(\w+),", states_page.HEADER.read_text())) - {"NONE"} == \
        set(states_page.events()) | {"OFF", "QUICK_STOP", "CLEAR"}
    states = re.search(r"enum axis_state \{(.*?)\}", (states_page.ROOT / "firmware/axis/axis.h").read_text(), re.S).group(1)
    assert {row[0] for row in states_page.rows()} == set(re.findall(r"AXIS_(\w+)", states))


@pytest.mark.parametrize("state", ("SWITCH_ON_DISABLED", "READY", "SWITCHED_ON", "OPERATION_ENABLED", "QUICK_STOP"))
@pytest.mark.parametrize("event, after", (("OFF", "SWITCH_ON_DISABLED"), ("FAULT", "FAULT_REACTION")))
def test_off_and_a_fault_lead_out_of_every_state_unless_it_is_there(state, event, after):
    assert [(row[2], row[3]) for row in states_page.rows() if row[:2] == (state, event)] == [(after, "NULL")]


def test_a_row_that_the_standard_does_not_have_is_told():
    assert states_page.standard("FAULT", "OPERATION_ENABLED") is None


def test_a_row_that_cannot_be_read_is_told():
    broken = states_page.SOURCE.read_text().replace("{IN(READY), DRIVE_EVENT_STARTING", "{ANY(x[1]), DRIVE_EVENT_STARTING")
    with pytest.raises(AssertionError):
        states_page.rows(broken)
