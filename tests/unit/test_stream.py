# SPDX-License-Identifier: MIT
"""The stream between the console's lines: its rate changes behind what was said, it ends when nobody is there."""
import ctypes

import pytest

from rigs.scoped import Scoped, decoded


class Streamed(Scoped):
    """The transmitter is out of work after so many milliseconds; sleeping lets one pass."""

    def __init__(self, c, busy_ms):
        super().__init__(c)
        self.busy_ms, self.slept = busy_ms, 0
        self._hook = ctypes.CFUNCTYPE(None)(self._sleep)
        self._slot = ctypes.c_void_p.in_dll(c._library, "host_on_sleep")

    def _sleep(self):
        self.clock.value, self.slept = self.clock.value + 1, self.slept + 1
        self.c.host_line_busy.value = self.slept < self.busy_ms

    def poll(self):
        """The milliseconds that it slept."""
        self.slept, self.c.host_line_busy.value = 0, self.busy_ms > 0
        self._slot.value = ctypes.cast(self._hook, ctypes.c_void_p).value
        self.c.stream_poll(self.console.session.stream, self.console.session.out, self.scope)
        self._slot.value, self.c.host_line_busy.value = None, False
        return self.slept

    def frames(self):
        """Numbers of the samples that a poll sends."""
        self.c.host_said_bytes.value = 0
        self.poll()
        said = bytes(self.c.host_said)[:self.c.host_said_bytes.value]
        return [decoded(frame + b"\0")[0] for frame in said.split(b"\0")[:-1]]

    def record(self, count=1):
        for _ in range(count):
            self.axis.time_ms += 1
            self.c.scope_step(self.scope)


def begun(c, every_ms=2, busy_ms=0):
    streamed = Streamed(c, busy_ms)
    streamed.choose("time")
    c.host_baud.value = 0
    c.stream_begin(streamed.console.session.stream, streamed.scope, every_ms, 921600)
    return streamed


@pytest.mark.parametrize("start_ms", (0, 2**32 - 50))
@pytest.mark.parametrize("busy_ms", (0, 1, 90, 199))
def test_stream_changes_the_rate_behind_all_that_was_said(c, start_ms, busy_ms):
    streamed = begun(c, busy_ms=busy_ms)
    streamed.clock.value = start_ms
    assert streamed.poll() == busy_ms and c.host_baud.value == 921600
    c.host_baud.value = 0
    assert streamed.poll() == 0 and c.host_baud.value == 0, "once"


def test_stream_waits_no_longer_than_200_ms_for_a_line_that_is_stuck(c):
    streamed = begun(c, busy_ms=10**6)
    assert streamed.poll() == 200 and c.host_baud.value == 921600


@pytest.mark.parametrize("every_ms", (1, 2, 7))
def test_stream_sends_each_so_many_milliseconds_what_is_new(c, every_ms):
    streamed = begun(c, every_ms)
    first = streamed.scope.recorder.count
    assert streamed.frames() == []
    streamed.record(20)
    assert streamed.frames() == [first + n for n in range(0, 20, every_ms)]
    assert streamed.frames() == []
    streamed.record(every_ms)
    assert len(streamed.frames()) == 1


def test_stream_goes_on_with_the_newest_where_the_recorder_has_forgotten(c):
    streamed = begun(c, 1)
    streamed.record(64)
    assert len(streamed.frames()) >= 63
    streamed.record(65)
    assert streamed.frames() == [streamed.scope.recorder.count - 1]


def test_stream_ends_by_itself_three_seconds_after_the_last_line(c):
    streamed = begun(c)
    stream = streamed.console.session.stream
    streamed.poll()
    streamed.axis.time_ms += 3000
    streamed.poll()
    assert stream.every_ms == 2
    streamed.axis.time_ms += 1
    streamed.poll()
    assert stream.every_ms == 0 and c.host_baud.value == 115200
    c.host_baud.value = 0
    c.stream_end(stream)
    streamed.poll()
    assert c.host_baud.value == 0, "what has ended changes no rate again"
