# SPDX-License-Identifier: MIT
"""Text to and from the console, against Python's own numbers."""
import ctypes
from decimal import Decimal

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

INT32 = st.integers(-2**31, 2**31 - 1)


def said(c, put, *args):
    c.host_said_bytes.value = 0
    put(c.text(), *args)
    return bytes(c.host_said)[:c.host_said_bytes.value].decode()


def parsed(function, text):
    value = ctypes.c_int32(-77)
    ok = function(text.encode(), ctypes.byref(value))
    assert ok or value.value == -77, "a number that is refused changes nothing"
    return value.value if ok else None


@given(INT32)
@example(-2**31)
@example(0)
def test_whole_numbers_out(c, value):
    assert said(c, c.text_print, b"%d", value) == str(value)


@given(INT32)
@example(-2**31)
@example(-1)
@example(999)
def test_thousandths_out(c, value):
    assert said(c, c.text_print, b"%.3d", value) == ("-" if value < 0 else "") + f"{abs(value) // 1000}.{abs(value) % 1000:03}"


@given(st.integers(0, 2**32 - 1))
def test_hexadecimal_out(c, value):
    assert said(c, c.text_print, b"0x%08x", ctypes.c_uint32(value)) == f"0x{value:08x}"


@given(INT32)
def test_whole_numbers_in(c, value):
    inside = abs(value) < 2**31
    assert parsed(c.text_parse_int, str(value)) == (value if inside else None)
    if value >= 0:
        assert parsed(c.text_parse_int, f"+{value}") == value


@given(st.decimals(-2000000, 2000000, places=3))
def test_thousandths_in(c, value):
    assert parsed(c.text_parse_milli, str(value)) == int(value * 1000)
    assert parsed(c.text_parse_int, f"{value:.3f}") is None


@pytest.mark.parametrize("text, milli", [("1", 1000), ("1.5", 1500), (".5", 500), ("-.25", -250), ("2147483.647", 2**31 - 1),
                                         ("-2147483.647", 1 - 2**31), ("1.", 1000)])
def test_forms_of_a_decimal(c, text, milli):
    assert parsed(c.text_parse_milli, text) == milli
    assert Decimal(milli) / 1000 == Decimal(text)


@pytest.mark.parametrize("text", ["", "-", "+", ".", "--1", "1-", "0x10", "1e3", " 1", "1 ", "1.2.3", "1.2345", "a", "1,5",
                                  "2147483648", "-2147483649", "99999999999"])
def test_what_is_no_number(c, text):
    assert parsed(c.text_parse_int, text) is None
    assert parsed(c.text_parse_milli, text) is None


@pytest.mark.parametrize("text", ["2147484", "-2147484", "3000000.", "214748365", "2147483.648"])
def test_what_thousandths_cannot_hold(c, text):
    """Also where the zeros that are not written make it too large."""
    assert parsed(c.text_parse_milli, text) is None


@given(st.text("ab", max_size=4), st.text("ab", max_size=4))
def test_equal(c, one, other):
    assert c.text_equal(one.encode(), other.encode()) == (one == other)


class Line:
    """A transmitter with a clock: `room` characters, and a millisecond a wait; `alive`: each wait makes room for one."""
    def __init__(self, c, room, alive):
        self.c, self.alive, self.ms = c, alive, ctypes.c_uint32(2**32 - 5)
        self.sleeps = ctypes.c_uint32.in_dll(c._library, "host_sleeps")
        self.idle = c.structs["idle"]()
        self.idle.time_ms = ctypes.pointer(self.ms)
        self.text = c.structs["text"]()
        self.text.idle = ctypes.pointer(self.idle)
        c.host_said_bytes.value = len(c.host_said) - room
        self.sleeps.value = c.host_watchdog_served.value = 0
        self.hook = ctypes.CFUNCTYPE(None)(self.wait)
        ctypes.c_void_p.in_dll(c._library, "host_on_sleep").value = ctypes.cast(self.hook, ctypes.c_void_p).value

    def wait(self):
        self.ms.value += 1
        if self.alive:
            self.c.host_said_bytes.value -= 1

    def put(self, text):
        before = self.sleeps.value
        self.c.text_put(self.text, text)
        return self.sleeps.value - before


@pytest.fixture
def line(c):
    yield lambda room, alive: Line(c, room, alive)
    ctypes.c_void_p.in_dll(c._library, "host_on_sleep").value = None


def test_output_waits_for_a_transmitter_that_lives(c, line):
    t = line(3, alive=True)
    assert t.put(b"hello") == 2 and bytes(c.host_said)[-1:] == b"o"
    assert not t.text.lost and c.host_watchdog_served.value == 2, "each room that came is a sign of life"


def test_output_gives_up_a_transmitter_that_is_dead(c, line):
    t = line(0, alive=False)
    waited = t.put(b"hello")
    assert 20 <= waited <= 22, "one patience for the first character, none for the rest"
    assert t.text.lost and c.host_watchdog_served.value == 0, "waiting is no sign of life"
    assert t.put(b"again") == 0
    c.host_said_bytes.value -= 8
    assert t.put(b"back") == 0 and bytes(c.host_said)[-8:-4] == b"back", "where there is room, it goes on"
    assert t.put(b"more") == 0 and 20 <= t.put(b"!") <= 22, "and has patience again"


@given(st.integers(0, 2**32 * 1000 - 1))
@example(2**32)
@example(999)
def test_seconds_out(c, ms):
    assert said(c, c.text_print, b"%.3llu", ctypes.c_uint64(ms)) == f"{ms // 1000}.{ms % 1000:03}"
