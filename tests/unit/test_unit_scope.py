# SPDX-License-Identifier: MIT
"""The scope but for its trigger: signals and their units, frames, what a fault leaves, the vector, the console's commands."""
import ctypes
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mssfoc.frames import Sample, Splitter

from rigs.scoped import ENTRY, LOOP, SLOTS, Scoped, decoded

INT32 = st.integers(-2**31, 2**31 - 1)


# ---- signals ----

def test_every_signal_has_a_name_and_a_text_of_its_own(c):
    table = (c.signal_info * ctypes.c_size_t.in_dll(c._library, "signal_count").value).in_dll(c._library, "signal_table")
    names = [info.name.decode() for info in table]
    texts = [c.signal_text(info.name).decode() for info in table]
    assert len(set(names)) == len(names) >= 24 and "unknown" not in texts
    assert all(re.fullmatch(r"[a-z][a-z_]{1,9}", name) for name in names)
    longest = sum(sorted(map(len, names))[-8:]) + 7
    assert len("scope signals ") + longest <= 80, "any eight fit a line"
    for place, name in enumerate(names):
        assert c.signal_find(name.encode() + b",x", len(name)) == place
        assert c.signal_find(name.encode(), len(name) - 1) == len(names) or name[:-1] in names


@given(raw=INT32, milli=INT32, form=st.integers(0, 9), i_range=st.integers(100, 2000000), directed=st.booleans(),
       direction=st.integers(0, 1))
def test_units_against_exact_arithmetic(c, raw, milli, form, i_range, directed, direction):
    axis = c.axis()
    axis.params.i_range_ma, axis.params.v_range_mv, axis.loop.loops_per_slow = i_range, i_range, 20
    axis.params.direction = direction
    sign = -1 if directed and direction else 1
    scale = c.signal_scale(c.signal_info(format=form, directed=directed), axis)

    def nearest(top, by):
        top, by = (top, by) if by > 0 else (-top, -by)
        return max(-2**31, min(2**31 - 1, (abs(top) + by // 2) // by * (1 if top >= 0 else -1)))
    assert c.signal_milli(scale, raw) == nearest(raw * scale.milli, scale.per)
    assert c.signal_raw(scale, milli) == nearest(milli * scale.per, scale.milli)
    expected = {c.SIGNAL_CURRENT: (i_range, 2**15), c.SIGNAL_VOLTAGE: (i_range, 2**15), c.SIGNAL_ANGLE: (360000, 2**32),
                c.SIGNAL_FREQUENCY: (20000 * 1000, 2**32), c.SIGNAL_RPM_Q4: (1000, 16), c.SIGNAL_RPM_Q16: (1000, 65536)}
    if form in expected:
        milli_per_step, steps = expected[form]
        assert scale.milli * steps == sign * milli_per_step * scale.per


def test_a_sum_of_two_words_wraps(scoped):
    scoped.choose("angle", "i_q")
    scoped.axis.loop.pll.angle_q32, scoped.axis.loop.angle_offset_q32 = 0xC0000000, 0x80000001
    scoped.axis.loop.i_q_q15 = -7
    scoped("scope arm"), scoped("scope fire")
    scoped.tick()
    assert list(scoped.scope.memory[:2]) == [0x40000001, -7]


# ---- frames ----

def frame_of(c, number, values):
    to = (ctypes.c_uint8 * 64)(*[0xEE] * 64)
    length = c.frame_sample(to, number, (ctypes.c_int32 * 8)(*values), len(values))
    assert length <= 49 and set(to[49:]) == {0xEE}, "FRAME_BYTES_MAX holds"
    return bytes(to[:length])


@given(number=st.integers(0, 2**32 - 1), values=st.lists(INT32 | st.integers(-70, 70), min_size=1, max_size=8))
def test_frames_come_back(c, number, values):
    assert decoded(frame_of(c, number, values)) == (number & 0xFFFF, values)


@given(number=st.integers(0, 2**32 - 1), values=st.lists(INT32, min_size=1, max_size=8), text=st.binary(max_size=9))
def test_the_host_reads_them_between_text(c, number, values, text):
    text = bytes(byte | 32 for byte in text)
    got = list(Splitter().take(text + frame_of(c, number, values) + text))
    assert [one for one in got if isinstance(one, Sample)] == [Sample(number & 0xFFFF, tuple(values))]
    assert b"".join(pieces := [one for one in got if isinstance(one, bytes)]) == text + text and all(pieces)


@given(values=st.lists(INT32, min_size=1, max_size=8), at=st.integers(0, 400), data=st.data())
def test_a_wrong_bit_is_noticed(c, values, at, data):
    frame = bytearray(frame_of(c, 77, values))
    place = 1 + at % (len(frame) - 2)
    frame[place] ^= 1 << data.draw(st.integers(0, 7))
    assert decoded(bytes(frame)) is None


# ---- captures: the vector, the divider, what is dropped ----

def test_the_entry_is_in_the_vector_while_a_capture_is_under_way(scoped):
    assert scoped.vector.value == LOOP
    assert scoped("scope arm") == ["ok"] and scoped.vector.value == ENTRY
    assert scoped("scope off") == ["ok"] and scoped.vector.value == LOOP and not scoped.axis.loop.diverted
    scoped("scope before 0"), scoped("scope arm"), scoped("scope fire")
    scoped.tick(SLOTS * 8)
    assert scoped.scope.capture.state == scoped.c.CAPTURE_DONE and scoped.vector.value == ENTRY
    scoped.c.scope_step(scoped.scope)
    assert scoped.vector.value == LOOP, "the slow loop's next step takes it out"


def test_another_handler_may_be_chosen_meanwhile(scoped):
    scoped.handlers.handler[1] = 0x3333
    scoped("scope arm")
    assert scoped.c.current_loop_select(scoped.axis.loop, scoped.fabric, 1)
    assert scoped.vector.value == ENTRY and scoped.scope.entry.handler == 0x3333
    scoped("scope off")
    assert scoped.vector.value == 0x3333


@pytest.mark.parametrize("every", (1, 2, 7))
def test_every_so_many_ticks(scoped, every):
    scoped.choose("sequence")
    scoped(f"scope every {every}"), scoped("scope before 0"), scoped("scope arm"), scoped("scope fire")
    scoped.tick(5 * every)
    assert list(scoped.scope.memory[:5]) == [1 + every * k for k in range(5)] and scoped.scope.late == 0


def test_a_sample_that_a_tick_came_into_is_dropped(scoped):
    """The tick counts in the middle of the copy: here, in the read of a word that the sampler finds at the counter itself."""
    scoped.choose("i_q")
    scoped("scope before 0"), scoped("scope arm"), scoped("scope fire")
    scoped.tick()
    assert scoped.scope.capture.filled == 1
    Tearing(scoped).sample()
    assert (scoped.scope.capture.filled, scoped.scope.dropped) == (1, 1)
    scoped.c.scope_sample(scoped.scope)  # the entry has raised it again
    assert (scoped.scope.capture.filled, scoped.scope.late) == (2, 1), "and the record says that one is missing"


def test_a_record_begins_with_nothing_dropped_and_nothing_late(c, scoped):
    """What the capture before has counted is forgotten with it; its due tick, its memory and its rate are the new one's."""
    scope = scoped.scope
    scope.dropped, scope.late, scope.rate_of, scope.entry.ticks, scope.due = 3, 4, 5, 1000, 7
    scoped.axis.loop.loops_per_slow = 20
    assert scoped("scope arm") == ["ok"]
    assert (scope.dropped, scope.late, scope.rate_of, scope.due) == (0, 0, 20, 1001)
    assert (scope.capture.words, scope.capture.samples, scope.capture.filled) == (8, 512, 0)


class Tearing:
    """Lets the counter change while the sampler copies: its memory slot is the counter."""

    def __init__(self, scoped):
        self.scoped = scoped

    def sample(self):
        scope = self.scoped.scope
        memory, scope.entry.ticks = scope.capture.memory, scope.entry.ticks + 1
        here = ctypes.addressof(scope) + type(scope).entry.offset + type(scope.entry).ticks.offset
        scope.capture.memory = ctypes.cast(here - 4 * scope.capture.next, type(scope.capture.memory))
        self.scoped.axis.loop.i_q_q15 = scope.entry.ticks + 1
        self.scoped.c.scope_sample(scope)
        scope.capture.memory = memory


# ---- what a fault leaves ----

def test_a_fault_leaves_the_milliseconds_before_it(scoped):
    scoped.choose("time", "fault")
    c, scope = scoped.c, scoped.scope

    def steps(count, fault=0):
        for _ in range(count):
            scoped.axis.time_ms += 1
            scoped.axis.faults.cause = fault
            c.scope_step(scope)
        scoped.type(b"")  # the console says that there is a fault

    steps(100)
    assert scoped("scope fault") == ["error: no fault has left samples yet"]
    steps(30, c.FAULT_STALL)
    answer = scoped("scope fault")
    assert answer[0].startswith("samples: 64, trigger: 63") and answer[1] == "time fault" and answer[-1] == "end: 64"
    rows = [tuple(map(int, line.split())) for line in answer[3:-1]]
    assert rows == [(t, 0) for t in range(38, 101)] + [(101, c.FAULT_STALL)]
    scoped.choose("i_q")
    assert scoped("scope fault") == answer, "another choice changes nothing of what was kept"
    steps(5)
    steps(1, c.FAULT_STO_A)
    assert scoped("scope fault")[0].startswith("samples: 6,"), "as many as there are since the last one"


@given(st.lists(st.sampled_from("ssssssssssfc"), max_size=200), st.integers(0, 250))
def test_samples_by_their_number(c, what, number):
    """A stream reads what is written: the newest, until they are overwritten, over faults and new choices."""
    recorder, fabric, word = c.recorder(), c.fabric(), ctypes.c_int32()
    nothing, source, choice = ctypes.c_int32(0), c.structs["signal_source"](), c.signal_choice()
    source.word, source.added, choice.count = ctypes.pointer(word), ctypes.pointer(nothing), 1
    begun = [0, 0]
    for one in what:
        if one == "c":
            c.recorder_restart(recorder)
            begun[1] = recorder.count
            continue
        word.value = 1000 + recorder.count
        c.recorder_step(recorder, choice, source, fabric, 1 if one == "f" else 0)
    values = (ctypes.c_int32 * 8)(-1)
    if c.recorder_get(recorder, number, 1, values):
        assert values[0] == 1000 + number < 1000 + recorder.count
    else:
        assert number >= recorder.count or recorder.count - number >= 64 or number < begun[1] or "f" in what


# ---- reading, as a protocol would ----

@given(first=st.integers(0, 5000), most=st.integers(0, 40))
def test_words_of_a_record(c, first, most):
    scoped = Scoped(c)
    scoped.choose("sequence", "i_q", "i_d")
    scoped("scope before 7"), scoped("scope arm")
    scoped.tick(20)
    scoped("scope fire")
    scoped.tick(2000)
    extent = c.scope_extent(scoped.scope, c.SCOPE_CAPTURE)
    assert (extent.samples, extent.words, extent.trigger) == (4096 // 3, 3, 7)
    words = (ctypes.c_int32 * 50)(*[-9] * 50)
    count = c.scope_read(scoped.scope, c.SCOPE_CAPTURE, first, words, most)
    assert count == max(0, min(most, 3 * extent.samples - first))
    for k in range(count):
        assert words[k] == (14 + (first + k) // 3 if (first + k) % 3 == 0 else 0)
    assert set(words[count:]) == {-9}


# ---- the console ----

@pytest.mark.parametrize("line, answer", [
    ("scope signals i_q,bogus", "error: bogus: no such signal; 'scope list' has them, separate them by commas only"),
    ("scope signals ,", "error: : no such signal; 'scope list' has them, separate them by commas only"),
    ("scope signals " + ",".join(["i_q"] * 9), "error: i_q: is one too many; 8 signals at most"),
    ("scope every 0", "error: must be 1...40000"), ("scope every x", "error: x: not a whole number"),
    ("scope before 512", "error: must be 0...511"), ("scope nothing", "error: nothing: not one of list, arm, fire, off, "
                                                     "read, fault"),
    ("scope trigger bogus above 1", "error: bogus: no such signal; 'scope list' has them"),
    ("scope trigger i_q near 1", "error: near: not one of above, below, rises, falls"),
    ("scope trigger i_q above x", "error: x: not a number with at most three decimals"),
    ("scope read", "error: no capture is done; 'scope' says how far it is"),
    ("scope fire", "error: no capture waits for its trigger; 'scope arm' begins one"),
    ("stream 0", "error: usage: stream MS BAUD"), ("stream x 115200", "error: x: not 1...1000 ms, or 0 to end it"),
    ("stream 1 12", "error: 12: not 9600...3000000 baud"),
])
def test_bad_input_gets_one_clear_line(scoped, line, answer):
    before = scoped("scope")
    assert scoped(line) == [answer] and scoped("scope") == before


def test_what_is_under_way_is_not_changed(scoped):
    scoped("scope arm")
    for line in ("scope every 2", "scope before 1", "scope signals i_d", "scope trigger i_q above 1", "scope arm"):
        assert scoped(line) == ["error: a capture is under way; wait for its end, or 'scope off'"]


def test_more_before_the_trigger_than_there_is(scoped):
    scoped("scope signals i_q"), scoped("scope before 4095"), scoped("scope signals i_q,i_d")
    assert scoped("scope arm") == ["error: with these signals at most 2047 samples stand before the trigger; "
                                   "'scope before' sets them"]


def test_the_stream_shares_the_line_with_text_and_ends_by_itself(scoped):
    c = scoped.c
    scoped.choose("time", "i_q")
    scoped.type(b"machine on\r")
    assert scoped.type(b"stream 2 921600\r") == "ok\r\n.\r\n" and c.host_baud.value == 921600
    heard = b""
    for _ in range(40):
        scoped.axis.time_ms += 1
        c.scope_step(scoped.scope)
        c.host_said_bytes.value = 0
        c.console_poll(scoped.console)
        c.console_poll(scoped.console)  # the thread comes by more than once a millisecond
        heard += bytes(c.host_said)[:c.host_said_bytes.value]
    frames = [decoded(frame + b"\0") for frame in heard.split(b"\0")[:-1]]
    assert [values[0] for _, values in frames] == list(range(1, 41, 2)), "one each second millisecond"
    assert scoped.type(b"version\r").startswith(scoped.greeting.split("\r\n")[1].split(",")[0]), "a command works as ever"
    scoped.axis.time_ms += 3001
    assert scoped.type(b"") == "" and not scoped.console.session.stream.every_ms
    assert c.host_baud.value == 115200, "nobody is there: the console's own rate again"
