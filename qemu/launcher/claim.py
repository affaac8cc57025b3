# SPDX-License-Identifier: MIT
"""A folder of results belongs to one process at a time: two runs that write the same files would each report the other's.

The system frees the lock when its holder ends, however that ends, so none is ever left over.
"""
import fcntl
import os
import weakref
from pathlib import Path

from .errors import LauncherError
from .paths import shown

LOCK = ".lock"
_mine = weakref.WeakValueDictionary()
_kept = []


class InUse(LauncherError):
    """Another process has the folder."""


class Claim:
    """Holds for as long as somebody keeps it. Its holder may claim the folder again."""

    def __init__(self, folder):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file = open(folder / LOCK, "a+", encoding="ascii")
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.seek(0)
            raise InUse(f"{shown(folder)} is in use by another run (process {self._file.read().strip() or '?'}): wait"
                                " until it has ended, or write elsewhere, with BUILD=build2 for example") from None
        except OSError as error:
            raise LauncherError(f"cannot write to {shown(folder)}: {error.strerror}") from error
        self._file.truncate(0)
        self._file.write(f"{os.getpid()}\n")
        self._file.flush()


def claim(folder):
    """A Claim of the folder, which is made if need be; refused in one line while another process has it."""
    folder = Path(folder).resolve()
    held = _mine.get(folder)
    if held is None:
        held = _mine[folder] = Claim(folder)
    return held


def keep(folder):
    """Claims it until this process ends."""
    _kept.append(claim(folder))
