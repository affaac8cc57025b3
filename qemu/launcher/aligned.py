# SPDX-License-Identifier: MIT
"""A drive that knows where its rotor stands, as behind the encoder's index: what tests of anything but the start begin with.

The firmware's own start would find the offset. Here the twin writes it into memory, from where the plant's rotor stands, while
the firmware measures its sensors' zeros. All the rest of the start is as ever.

Without an encoder there is no offset to know, and the start is the one that it always is. The firmware cannot be in the state
that would be written: what it knows of an encoder, it forgets with `angle_source`.
"""
import re

from .errors import LauncherError
from .probes import code_of

ON_TIME_S = 0.25  # the sensors' zeros take 0.13 s, and `on` may wait for the parameters to be typed
KNOWN_AT_S = 0.1  # after SWITCHED_ON: while they are measured
KNOWN, NEXT = "axes[0].start.aligned", "axes[0].start.rescaled"
_SOURCE = re.compile(r"\s*set\s+angle_source\s+(\d+)\s*")
_ENCODER = 0  # of angle_source; initially, too


def has_encoder(lines):
    """Whether the drive is switched on with an encoder for the first time, by the lines that are typed, in their order."""
    source = _ENCODER
    for line in lines:
        if line.strip() == "on":
            break
        told = _SOURCE.fullmatch(line)
        source = int(told[1]) if told else source
    return source == _ENCODER


def lines(symbols, enums):
    """The twin's events that tell the firmware its offset, before the sensors' zeros are known."""
    when = f"after state={code_of(enums['state'], 'SWITCHED_ON')} {KNOWN_AT_S:g}"
    known, rescaled = symbols.address(KNOWN), symbols.address(NEXT)
    if known % 4 or rescaled != known + 1:  # a word is written: what was rescaled is done with by then, no index is known
        raise LauncherError(f"{KNOWN} and what follows it do not begin a word")
    offset, angle = (symbols.address(f"axes[0].loop.{name}") for name in ("angle_offset_q32", "pll.angle_q32"))
    return [f"{when} poke_offset 0x{offset:08x} 0x{angle:08x}", f"{when} poke 0x{known:08x} 1"]
