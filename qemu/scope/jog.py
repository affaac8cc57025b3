# SPDX-License-Identifier: MIT
"""Turning by hand: as long as a page says that its button is held. When it does not say so, the shaft is stopped, whatever has
become of the page."""
import time

HELD_S = 0.6  # without a word the button counts as released; a page says it every 0.2 s


class Jog:
    def __init__(self, ask):
        self._ask, self._rpm, self._until_s = ask, 0, 0.0

    async def hold(self, rpm):
        """The drive's answer to a new speed; None while the same one goes on. 0 releases."""
        self._until_s = time.monotonic() + HELD_S
        if rpm == self._rpm:
            return None
        self._rpm = rpm  # also if it is refused: that is told once
        return await self._ask(f"speed {rpm}")

    async def mind(self):
        """To be called often."""
        if self._rpm and time.monotonic() > self._until_s:
            await self._ask("speed 0")
            self._rpm = 0
