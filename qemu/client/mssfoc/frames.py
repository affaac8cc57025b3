# SPDX-License-Identifier: MIT
"""What comes over the console's line: text, and frames of samples between it (firmware/operate/stream.h)."""
from dataclasses import dataclass

BEGIN, END, SAMPLE = 0x01, 0x00, 0x50
LONGEST = 64  # bytes; what goes on longer is no frame


@dataclass(frozen=True)
class Sample:
    number: int  # milliseconds, modulo 2^16
    values: tuple


class Splitter:
    """Bytes in, pieces of text (bytes) and Samples out, in order; `damaged` counts frames that did not come whole."""

    def __init__(self):
        self.damaged = 0
        self._frame = None

    def take(self, data):
        text = bytearray()
        for byte in data:
            if self._frame is None:
                if byte == BEGIN:
                    self._frame = bytearray()
                elif byte != END:
                    text.append(byte)
            elif byte == END:
                sample = unpack(bytes(self._frame))
                self._frame = None
                if sample is None:
                    self.damaged += 1
                    continue
                if text:
                    yield bytes(text)
                    text.clear()
                yield sample
            else:
                self._frame.append(byte)
                if len(self._frame) > LONGEST:
                    self._frame, self.damaged = None, self.damaged + 1
        if text:
            yield bytes(text)


def unpack(body):
    """A Sample from what stands between BEGIN and END, or None."""
    plain = unstuffed(body)
    if plain is None or len(plain) < 6 or crc(plain[:-2]) != int.from_bytes(plain[-2:], "little"):
        return None
    values = varints(plain[3:-2])
    if values is None or len(values) != plain[0] - SAMPLE:
        return None
    return Sample(int.from_bytes(plain[1:3], "little"), tuple(values))


def unstuffed(body):
    """COBS, of less than 254 bytes."""
    plain, at = bytearray(), 0
    while at < len(body):
        distance = body[at]
        if distance == 0 or at + distance > len(body):
            return None
        plain += body[at + 1:at + distance]
        at += distance
        if at < len(body):
            plain.append(0)
    return bytes(plain)


def varints(data):
    values, value, shift = [], 0, 0
    for byte in data:
        value |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            values.append((value >> 1) ^ -(value & 1))
            value = shift = 0
    return None if shift else values


def crc(data):
    """CRC-16 of Modbus."""
    found = 0xFFFF
    for byte in data:
        found ^= byte
        for _ in range(8):
            found = found >> 1 ^ (0xA001 if found & 1 else 0)
    return found
