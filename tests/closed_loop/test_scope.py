# SPDX-License-Identifier: MIT
"""The scope on the running drive: what it captures is what the plant's trace says of the same samples, a fault leaves what was
before it, and off is off: the current loop's interrupt takes the cycles that it takes without a scope."""
import numpy as np
import pytest

from launcher.drive import load_drive
from launcher.recording import read_recording
from rigs.played_scope import answer, play

CURRENT_LOOP, SAMPLER = 16 + 34, 16 + 9
CAPACITY = 512  # of eight signals


def record(console, command):
    """({name: raw values}, {item: number} of the heading) of what a command has printed."""
    text = answer(console, command)
    heading = {key: int(value) for key, value in (item.split(": ") for item in text[0].split(", "))}
    names, rows = text[1].split(), np.array([line.split() for line in text[3:-1]], dtype=np.int64)
    assert text[-1] == f"end: {len(rows)}" == f"end: {heading['samples']}"
    return dict(zip(names, rows.T)), heading


def at_conversions(trace, captured):
    """The rows of the trace that belong to the samples: found by the rotor's angle, which never comes twice while it turns."""
    angle = np.asarray(trace["angle_next_q32"], dtype=np.int64) & 0xFFFFFFFF
    wanted = captured & 0xFFFFFFFF
    starts = [int(i) for i in np.flatnonzero(angle == wanted[-1]) - (len(wanted) - 1) if i >= 0]
    found = [i for i in starts if np.array_equal(angle[i:i + len(wanted)], wanted)]
    assert len(found) == 1, "the angles of the capture stand at one place of the trace, without a gap"
    return slice(found[0], found[0] + len(wanted))


@pytest.fixture(scope="module")
def stepped(tmp_path_factory):
    """A step of torque, captured at each sample around the moment when its reference rises."""
    return play(tmp_path_factory.mktemp("stepped"), [
        (0.03, "scope signals i_q,i_q_ref,i_d,i_a,i_b,angle,sequence,speed"), (0.1, "on"), (0.32, "scope before 100"),
        (0.34, "scope trigger i_q_ref rises 1.5"), (0.36, "scope arm"), (0.40, "torque 2"), (0.43, "scope"),
        (0.44, "scope read"), (0.52, "scope trigger never"), (0.54, "scope arm"), (0.56, "scope off"), (0.58, "scope")], 0.62)


def test_what_is_captured_is_what_the_trace_has_at_the_same_samples(stepped):
    found, heading = record(stepped.console, "scope read")
    assert heading["samples"] == CAPACITY and (heading["dropped"], heading["late"]) == (0, 0)
    assert np.array_equal(np.diff(found["sequence"]), np.ones(CAPACITY - 1)), "one row a conversion"
    offset = int(np.round(np.asarray(stepped.trace["angle_offset_q32"])[-1])) & 0xFFFFFFFF
    rows = at_conversions(stepped.trace, found["angle"] - offset)
    amperes = load_drive("teknic_m2310p", plant="ideal", spread=0).inverter["sensor"]["i_range_a"] / 32768
    for name, column in (("i_q", "i_q_A"), ("i_d", "i_d_A")):
        assert np.array_equal(np.round(np.asarray(stepped.trace[column])[rows] / amperes), found[name]), name
    wanted = np.round(np.asarray(stepped.trace["i_q_ref_A"]) / amperes)  # at the row's end: the slow loop may have been at it
    earlier = slice(rows.start - 1, rows.stop - 1)
    assert np.all((found["i_q_ref"] == wanted[rows]) | (found["i_q_ref"] == wanted[earlier]))
    assert np.abs(np.diff(found["i_q"])).max() > 500, "and there was something to see"


def test_the_trigger_is_where_it_was_asked_for(stepped):
    found, heading = record(stepped.console, "scope read")
    level = 1.5 * 32768 / 23.571
    assert heading["trigger"] == 100 and "done by the signal" in stepped.console
    assert found["i_q_ref"][100] >= level > found["i_q_ref"][99]


def test_off_is_off(stepped):
    """From the interrupts that the core took: the sampler's only while a capture is under way, and the tick's price with it."""
    log = read_recording(stepped.irqlog, "log of interrupts")
    t, cycles = log["t_s"], log["cycles"]
    current, sampler = log["exception"] == CURRENT_LOOP, log["exception"] == SAMPLER

    def during(since, until):
        """(cycles of the current loop's interrupt, which are fewer where it follows another one, interrupts of the sampler)."""
        now = (t > since) & (t < until)
        return int(cycles[current & now].max()), int((sampler & now).sum())

    off, none = during(0.33, 0.36)
    on, some = during(0.366, 0.399)
    assert none == 0 and some == pytest.approx(0.033 * 20000, abs=2) and 0 <= on - off <= 20
    assert during(0.43, 0.54) == (off, 0), "a capture that is done leaves the interrupt as it was"
    assert during(0.545, 0.56) == (on, pytest.approx(300, abs=2))
    assert during(0.563, 0.62) == (off, 0) and "capture: off" in stepped.console.rsplit("> scope\n", 1)[1]


def test_a_fault_leaves_what_was_before_it(tmp_path):
    """Once with a capture that waits for something else, and always what the slow loop keeps."""
    run = play(tmp_path, [
        (0.03, "scope signals i_q,speed,fault,vbus,time,sequence,gate,state"), (0.1, "on"), (0.32, "speed 500"),
        (0.34, "scope before 500"), (0.36, "scope trigger speed above 30000"), (0.38, "scope arm"),
        (0.45, {"event": "sto", "args": ["A", "1"]}), (0.48, "scope"), (0.49, "scope read"), (0.57, "scope fault")], 0.65)
    assert "done by a fault" in run.console
    fast, heading = record(run.console, "scope read")
    assert heading["trigger"] == 500 and heading["samples"] == CAPACITY
    assert not fast["fault"][:500].any() and fast["fault"][500:].all(), "the sample in which it was found is the trigger's"
    assert np.array_equal(np.diff(fast["sequence"]), np.ones(CAPACITY - 1))
    slow, heading = record(run.console, "scope fault")
    assert heading["samples"] == 64 and not slow["fault"][:63].any() and slow["fault"][63] == fast["fault"][-1]
    assert np.array_equal(np.diff(slow["time"]), np.ones(63)) and np.abs(slow["speed"][:63]).max() > 0
    before = fast["sequence"][500]
    assert 0 <= slow["sequence"][63] - before <= 20, "the last one is the first millisecond that shows it"
