# SPDX-License-Identifier: MIT
"""Frames for the storms on the bus: noise, torn and mutated requests, traffic of others with requests inside, and requests that
are right."""
import itertools

from rigs.modbus_line import US, framed, remainders, words

KINDS = ("right", "mutated", "foreign", "noise")
STARTS = (0, 1, 2, 4, 6, 7, 8, 16, 18, 43, 64, 128, 192, 0x400, 0x408, 0x1000, 0x1002, 0x1020, 0x1060)


def _register(draw):
    if draw.randrange(8) == 0:
        return draw.randrange(65536)
    return draw.choice(STARTS) + (draw.randrange(8) if draw.randrange(3) == 0 else 0)


def _data(draw, count):
    return bytes(draw.randrange(256) if draw.randrange(2) else 0 for _ in range(count))


def request(draw, unit):
    """One of the functions that there are."""
    function, at = draw.choice((3, 4, 6, 16, 22, 23, 0x2B)), words(_register(draw))
    count = draw.randint(1, 118 if draw.randrange(4) == 0 else 8)
    written = words(count) + bytes([2 * count]) + _data(draw, 2 * count)
    rest = {6: words(draw.randrange(65536)), 16: written, 22: _data(draw, 4),
            23: words(draw.randint(1, 8), _register(draw)) + written}
    if function == 0x2B:
        return framed(unit, bytes([function, 14, draw.randrange(6), draw.randrange(9)]))
    asked = words(draw.randrange(65536) if draw.randrange(16) == 0 else count)
    return framed(unit, bytes([function]) + at + rest.get(function, asked))


def _foreign(draw):
    """Traffic of others: requests, replies and exceptions of all public functions; half of it what another slave answers with a
    whole request to this drive inside."""
    unit, data = draw.choice((*range(2, 201), 247)), _data(draw, 2 * draw.randint(1, 30))
    inside = _data(draw, draw.randrange(8)) + request(draw, draw.choice((0, US, US)))[:240]
    count = bytes([len(data)])
    kinds = (bytes([draw.randint(1, 6)]) + (data * 2)[:4], bytes([draw.choice((1, 2, 3, 4, 0x17))]) + count + data,
             bytes([16, 0, 1, 0, len(data) // 2]) + count + data, bytes([16, 0, 1, 0, 5]),
             bytes([0x80 | draw.randint(1, 0x2B), draw.randint(1, 11)]), bytes([0x2B, 14, 1, 0x82, 0, 0, 1, 0]) + count + data,
             bytes([0x17, 0, 1, 0, 2, 0, 3, 0, len(data) // 2]) + count + data)
    return framed(unit, draw.choice(kinds) if draw.randrange(2) else bytes([draw.randint(3, 4), len(inside)]) + inside)


def _mutated(draw, frame):
    at, what = draw.randrange(len(frame)), draw.randrange(4)
    if what == 0:
        return frame[:at]
    if what < 3:
        return frame + bytes([draw.randrange(256)]) if what == 1 else frame[:at] + frame[at + 1:]
    changed = bytearray(frame)
    for _ in range(draw.randint(1, 5)):
        changed[draw.randrange(len(frame))] ^= 1 << draw.randrange(8)
    return bytes(changed)


def begins_with_a_frame(heard):
    """Whether some of its first bytes end in their own check sum: the remainder of all of them is then 0."""
    return 0 in itertools.islice(remainders(heard), 3, None)


def some_frame(draw):
    """(kind, bytes); none where a check sum of 16 bits fits by chance, which would be a request like others."""
    kind, frame = draw.choice(KINDS), request(draw, draw.choice((0, US, US, US)))
    if kind == "right":
        return kind, frame
    frame = {"mutated": _mutated, "foreign": lambda d, _: _foreign(d),
             "noise": lambda d, _: d.randbytes(d.randint(1, 300))}[kind](draw, frame)
    heard = frame[:-1] if kind == "foreign" else frame if frame[:1] in (b"\0", bytes([US])) else b""
    return some_frame(draw) if begins_with_a_frame(heard) else (kind, frame)
