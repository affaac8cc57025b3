# SPDX-License-Identifier: MIT
"""A capture against the plain description of one: a list of samples, cut around the first that triggers."""
import ctypes

import pytest
from hypothesis import given
from hypothesis import strategies as st

WORDS = 64  # of the memory


def oracle(samples, setup):
    """(record, place of the trigger, cause) of a list of (watched, fault, fire); None while it is not complete."""
    length, before, when, level, fault_at_begin = setup
    seen, last, had_fault = [], None, fault_at_begin
    for number, (watched, fault, fire) in enumerate(samples):
        signal = {"NEVER": False, "ABOVE": watched >= level, "BELOW": watched <= level,
                  "RISES": last is not None and last < level <= watched,
                  "FALLS": last is not None and last > level >= watched}[when]
        cause = "FAULT" if fault and not had_fault else "COMMAND" if fire else "SIGNAL" if signal and number >= before else None
        if cause:
            first, end = max(0, number - before), number + length - before
            seen = list(range(first, end))
            return (seen, number - first, cause) if end <= len(samples) else (None, None, cause)
        last, had_fault = watched, fault
    return None, None, None


@st.composite
def captures(draw):
    words = draw(st.integers(1, 8))
    length = draw(st.integers(1, WORDS // words))
    before = draw(st.integers(0, length - 1))
    when = draw(st.sampled_from(["NEVER", "ABOVE", "BELOW", "RISES", "FALLS"]))
    small = st.integers(-3, 3)
    rare = st.sampled_from([False] * 9 + [True])
    samples = draw(st.lists(st.tuples(small, rare, rare), min_size=1, max_size=4 * length + 5))
    return words, (length, before, when, draw(small), draw(st.booleans())), samples


def capture_of(c, memory, words, setup, first):
    length, before, when, level, fault = setup
    capture = c.capture()
    capture.memory = ctypes.cast(memory, type(capture.memory))
    capture.words, capture.samples, capture.before = words, length, before
    capture.when, capture.level = getattr(c, f"CAPTURE_{when}"), level
    c.capture_begin(capture, first, fault)
    return capture


@given(captures())
def test_the_record_is_what_stands_around_the_trigger(c, case):
    words, setup, samples = case
    memory = (ctypes.c_int32 * WORDS)()
    capture = capture_of(c, memory, words, setup, samples[0][0])  # the signal as it is: no edge leads to the first sample
    for number, (watched, fault, fire) in enumerate(samples):
        capture.fire = capture.fire or fire
        c.host_capture_take(capture, (ctypes.c_int32 * 8)(*range(10 * number, 10 * number + 8)), watched, fault)
    record, trigger, cause = oracle(samples, setup)
    # a command that comes before the signal's first sample counts in the oracle as well: both see it with that sample
    assert capture.cause == (getattr(c, f"CAPTURE_BY_{cause}") if cause else c.CAPTURE_BY_NOTHING)
    if record is None:
        assert c.capture_samples(capture) == 0 and capture.state != c.CAPTURE_DONE
        return
    assert capture.state == c.CAPTURE_DONE and capture.had_before == trigger
    assert c.capture_samples(capture) == len(record)
    found = [[c.capture_word(capture, i, k) for k in range(words)] for i in range(len(record))]
    assert found == [[10 * number + k for k in range(words)] for number in record]


@pytest.mark.parametrize("when, values, at", [
    ("RISES", [5, 0, 4, 5, 6], 3), ("RISES", [0, 5, 6, 4, 9], 1), ("FALLS", [0, 9, 6, 5, 4], 3), ("ABOVE", [4, 4, 5, 0, 0], 2),
    ("BELOW", [9, 6, 5, 9, 9], 2), ("RISES", [5, 5, 5, 5, 5], None), ("FALLS", [5, 4, 3, 5, 5], None),
])
def test_which_sample_triggers(c, when, values, at):
    memory = (ctypes.c_int32 * WORDS)()
    capture = capture_of(c, memory, 1, (1, 0, when, 5, False), values[0])
    for number, value in enumerate(values):
        c.host_capture_take(capture, (ctypes.c_int32 * 8)(number), value, False)
    assert (c.capture_word(capture, 0, 0) if c.capture_samples(capture) else None) == at


def test_nothing_is_taken_when_off_or_done(c):
    memory = (ctypes.c_int32 * WORDS)()
    capture = capture_of(c, memory, 1, (4, 1, "ABOVE", 0, False), 0)
    for number in range(9):
        c.host_capture_take(capture, (ctypes.c_int32 * 8)(number), 0, False)
    assert [c.capture_word(capture, i, 0) for i in range(c.capture_samples(capture))] == [0, 1, 2, 3]
