# SPDX-License-Identifier: MIT
"""Where frames begin and end: whatever the line tears, joins or adds, requests are answered, and nothing else is obeyed. Noise,
mutated requests and the traffic of others: tests/fuzz."""
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigs.modbus_line import Line, crc, frame, framed, read, words, write, write_one

LONG_MS = 60  # longer than the patience with a frame that does not go on


def test_the_check_sum(c):
    """Against one that is worked out bit by bit; MODBUS over Serial Line has the second as an example."""
    assert c.crc16(buffer(c, b""), 0) == 0xFFFF
    for body in (b"\x02\x07", bytes(range(256)), b"123456789"):
        assert c.crc16(buffer(c, body), len(body)).to_bytes(2, "little") == crc(body)
    assert c.crc16(buffer(c, b"\x02\x07"), 2) == 0x1241
    assert c.crc16(buffer(c, b"123456789"), 9) == 0x4B37


def buffer(c, body):
    c.host_bus_heard[0:len(body)] = list(body)
    return c.host_bus_heard


@given(data=st.binary(max_size=250))
def test_any_check_sum(c, data):
    assert c.crc16(buffer(c, data), len(data)).to_bytes(2, "little") == crc(data)


REQUESTS = [read(0x10, 8), read(0x1000, 10, function=4), frame(1, 0x2B, 0x0E, 1, 0), write(0x0002, words(0, 300)),
            write_one(0x0001, 3), frame(1, 0x16, 0, 0, 0xFF, 0xFF, 0, 0), frame(1, 0x17, 0, 0x10, 0, 1, 0, 1, 0, 1, 2, 0, 3)]


@given(request=st.sampled_from(REQUESTS), cuts=st.sets(st.integers(1, 20)), gaps=st.lists(st.integers(0, 40), min_size=21,
                                                                                        max_size=21))
def test_a_request_may_come_in_any_pieces(c, request, cuts, gaps):
    """A USB adapter's: silences of up to 40 ms anywhere in it."""
    line, sent, before = Line(c), b"", 0
    for number, cut in enumerate(sorted(cut for cut in cuts if cut < len(request)) + [len(request)]):
        sent += line.say(request[before:cut], then_ms=gaps[number] if cut < len(request) else 0)
        before = cut
    assert sent[:1] == b"\x01" and crc(sent[:-2]) == sent[-2:] and sent[1] < 0x80


def test_a_request_that_stops_is_forgotten(c):
    line, request = Line(c), read(0x10, 1)
    assert line.say(request[:5], then_ms=LONG_MS) == b""
    assert line.say(request[5:], then_ms=LONG_MS) == b""
    assert line.say(request)


@pytest.mark.parametrize("silence_ms", (5, 10, 45))
def test_the_next_request_behind_a_torn_one_is_answered(c, silence_ms):
    """The master gave up and asks again, sooner than the patience lasts."""
    line, request = Line(c), read(0x10, 1)
    assert line.say(request[:5], then_ms=silence_ms) == b""
    assert line.say(request)


FOREIGN = st.sampled_from([2, 5, 17, 247])


@pytest.mark.parametrize("head", (b"\3", b"\x2b\x0e\1\x82\0\0\2\0\3abc\1"), ids=("registers", "identification"))
@given(unit=FOREIGN, lead=st.integers(0, 20), gap=st.integers(0, 40), tail=st.integers(0, 20), torn=st.integers(0, 17))
def test_a_request_inside_another_slaves_reply_is_not_one(c, head, unit, lead, gap, tail, torn):
    """Even where a silence comes just in front of it, or anywhere before."""
    line, order = Line(c), write(0x0002, words(0, 300))
    before = line.everything()
    data = bytes(lead) + order + bytes(tail)
    reply = framed(unit, head + bytes([len(data)]) + data)
    parts = sorted({min(torn, len(head)), len(head) + 2 + lead})
    for first, last in zip([0, *parts], [*parts, len(reply)]):
        assert line.say(reply[first:last], then_ms=gap if last < len(reply) else LONG_MS) == b""
    assert line.everything() == before


def test_a_lost_character_ends_the_frame(c):
    line = Line(c)
    c.host_bus_marks.value = c.host_bus_loss_mark.value
    assert line.say(read(0x10, 1)) == b""
    assert line.wait(10) == b"" and line.say(read(0x10, 1))


def test_only_a_request_that_is_the_newest_is_found_behind_noise(c):
    """Two requests that waited behind a frame that never was: the first is too old to be obeyed."""
    line = Line(c)
    torn = bytes([9, 3, 200])  # promises 205 bytes
    line.say(torn, then_ms=10)
    stale, fresh = write_one(0x0001, 4), read(0x0001, 1)
    line.say(stale)
    answers = [line.say(fresh) for _ in range(26)]
    first = answers.index(next(filter(None, answers)))
    assert 8 * first > 180 and all(answers[first:]), "silent up to the promised length, and then one reply a request"
    assert all(len(answer) == 7 for answer in answers[first:])
    assert line.registers(1, 1) == [3], "the stale one was not obeyed"


def test_a_request_that_came_while_the_thread_was_busy_is_answered(c):
    """As while `on` works out its tables: the reply has left, the next request is there when the thread is back."""
    line, request = Line(c), write_one(0x0001, 4)
    for _ in range(2):
        c.host_bus_heard[0:len(request)] = list(request)
        c.host_bus_heard_bytes.value, c.host_bus_heard_taken.value = len(request), 0
        line.rs485.driving = False
        c.modbus_poll(line.modbus)
    assert bytes(c.host_bus_sent)[:c.host_bus_sent_bytes.value] == 2 * request


@pytest.mark.parametrize("baud, silence_ms", ((9600, 6), (19200, 4), (115200, 3), (921600, 3)))
def test_the_silence_of_a_rate(c, baud, silence_ms):
    """3.5 characters of 11 bits, 1.75 ms at least, and one tick of the clock."""
    line = Line(c)
    line.axis.params.modbus_baud = baud
    line.wait(1)
    assert c.host_bus_baud.value == baud and line.modbus.silence_ms == silence_ms


@pytest.mark.parametrize("parity, form", ((0, "MMUART_8N2"), (1, "MMUART_8O1"), (2, "MMUART_8E1")))
def test_format_and_address_follow_the_parameters_behind_the_reply(c, parity, form):
    line = Line(c)
    opened = c.host_bus_opened.value
    at = line.param("modbus_address")
    assert line.say(write(at, words(0, 9, 0, 38400 & 0xFFFF, 0, parity)))[:1] == b"\x01", "still as it was asked"
    line.wait(1)
    assert c.host_bus_opened.value == opened + 1 and c.host_bus_format.value == getattr(c, form)
    assert line.say(read(0x10, 1)) == b"" and line.say(read(0x10, 1, unit=9))


def test_address_0_is_deaf(c):
    line = Line(c)
    line.axis.params.modbus_address = 0
    line.wait(1)
    before = line.everything()
    assert line.say(write_one(1, 4, unit=0)) == b"" and line.everything() == before
