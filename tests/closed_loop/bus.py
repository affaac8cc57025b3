# SPDX-License-Identifier: MIT
"""The twin's log of the RS-485 line (qemu/twin/serial_bus.h): who said what, and when."""
from dataclasses import dataclass, field


@dataclass
class Exchange:
    """What was heard between two silences of the drive, and what it sent then. Seconds."""
    request: bytes = b""
    asked_s: float = 0.0     # the last character of the request is over
    on_s: float = 0.0        # the transceiver drives
    reply: bytes = b""
    answered_s: float = 0.0  # the last character of the reply is over
    off_s: float = 0.0       # the transceiver has let go


@dataclass
class Bus:
    exchanges: list = field(default_factory=list)  # those that were answered
    unanswered: bytes = b""                        # what was heard behind the last of them
    lost: list = field(default_factory=list)       # (seconds, what) of characters that did not get through


def load_bus(path):
    bus, now = Bus(), Exchange()
    for line in path.read_text().splitlines():
        ns, what, *byte = line.split()
        at_s, byte = int(ns) * 1e-9, bytes.fromhex("".join(byte))
        if what == "rx":
            now.request, now.asked_s = now.request + byte, at_s
        elif what == "tx":
            now.reply, now.answered_s = now.reply + byte, at_s
        elif what == "on":
            now.on_s = at_s
        elif what == "off":
            now.off_s = at_s
            bus.exchanges.append(now)
            now = Exchange()
        else:
            bus.lost.append((at_s, what))
    bus.unanswered = now.request
    return bus
