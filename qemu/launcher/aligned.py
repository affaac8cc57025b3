# SPDX-License-Identifier: MIT
"""A drive that knows where its rotor stands, as behind the encoder's index: what tests of anything but the start begin with.

The firmware's own start would find the offset. Here the twin writes it into memory, from where the plant's rotor stands, while
the firmware measures its sensors' zeros. All the rest of the start is as ever.
"""
from .errors import LauncherError
from .probes import code_of

ON_TIME_S = 0.25  # the sensors' zeros take 0.13 s, and `on` may wait for the parameters to be typed
KNOWN_AT_S = 0.1  # after SWITCHED_ON: while they are measured
KNOWN, NEXT = "axes[0].start.aligned", "axes[0].start.rescaled"


def lines(symbols, enums):
    """The twin's events that tell the firmware its offset, before the sensors' zeros are known."""
    when = f"after state={code_of(enums['state'], 'SWITCHED_ON')} {KNOWN_AT_S:g}"
    known, rescaled = symbols.address(KNOWN), symbols.address(NEXT)
    if known % 4 or rescaled != known + 1:  # a word is written: what was rescaled is done with by then, no index is known
        raise LauncherError(f"{KNOWN} and what follows it do not begin a word")
    offset, angle = (symbols.address(f"axes[0].loop.{name}") for name in ("angle_offset_q32", "pll.angle_q32"))
    return [f"{when} poke_offset 0x{offset:08x} 0x{angle:08x}", f"{when} poke 0x{known:08x} 1"]
