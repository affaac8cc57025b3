# SPDX-License-Identifier: MIT
"""The drive's own watch over the session (command_timeout_ms): where it has none it is lent one, for a server that is killed,
or whose cable is pulled, stops no motor. The session's own looks at the drive keep it content."""
import contextlib
import re

from .drive import DriveError

NAME = "command_timeout_ms"
LENT_MS = 2000
TAKES_IT_AWAY = ("load", "defaults", "identify")  # they set parameters; `identify` and `on` also need it


class Limit:
    def __init__(self, ask):
        self._ask, self._axes, self._lent, self._theirs = ask, (), [], False

    async def lend(self, axes=None):
        """Where there is none, and while the drive is off: only then parameters change."""
        self._axes = axes or self._axes
        for axis in () if self._theirs else self._axes:
            found = re.match(rf"{NAME} = (\d+)", " ".join(await self._ask(f"{axis}get {NAME}")))
            none = found and found[1] == "0"
            if none and await self._ask(f"{axis}set {NAME} {LENT_MS}") == ["ok"] and axis not in self._lent:
                self._lent.append(axis)

    async def put_back(self):
        for axis in self._lent[:]:
            if await self._ask(f"{axis}set {NAME} 0") == ["ok"]:
                self._lent.remove(axis)

    def see(self, name):
        """A page sets a parameter; if it is the limit, it is the page's from now on."""
        if name == NAME:
            self._lent, self._theirs = [], True

    @contextlib.asynccontextmanager
    async def around(self, word):
        """A line of the page: what is kept over power-off is the drive's own limit, and what turns the motor has one."""
        if word == "save":
            await self.put_back()
        elif word in ("on", "identify"):
            await self.lend()
        try:
            yield
        finally:
            if word == "save" or word in TAKES_IT_AWAY:
                with contextlib.suppress(DriveError):
                    await self.lend()
