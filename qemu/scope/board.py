# SPDX-License-Identifier: MIT
"""A board at the line's other end: the console's UART by a serial port of this machine."""
import asyncio

from launcher.errors import LauncherError
from launcher.paths import build_dir

from .drive import CONSOLE_BAUD

CHANGE_S = 0.05


class Board:
    name = "board"

    def __init__(self, port, build=None):
        self.elf = build_dir(build) / "mssfoc.elf"
        self.port, self.title, self.lines = port, f"board at {port}", []

    async def open(self):
        import serial

        try:
            self._serial = serial.Serial(self.port, CONSOLE_BAUD, timeout=0.02, exclusive=True)
        except (serial.SerialException, ValueError, OSError) as error:
            raise LauncherError(f"PORT={self.port} cannot be opened: {error}") from error

    async def reopen(self):
        self._serial.close()
        await self.open()

    def ended(self):
        """A cable that was pulled may come back."""
        return None

    def at_work(self):
        """Nothing but the line shows."""
        return False

    def last_words(self):
        return ""

    async def read(self):
        while True:
            data = await asyncio.to_thread(self._serial.read, 4096)
            if data:
                return data

    async def write(self, data):
        await asyncio.to_thread(self._serial.write, data)

    async def set_baud(self, rate):
        await asyncio.sleep(CHANGE_S / 2)  # the drive changes when its answer has left
        try:
            self._serial.baudrate = rate
        except OSError:
            pass  # a line that is broken, which reading finds out
        await asyncio.sleep(CHANGE_S / 2)

    async def disturb(self, name, arguments, axis=0):
        return "a board cannot be disturbed from here"

    async def close(self):
        self._serial.close()
