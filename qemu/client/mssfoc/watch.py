# SPDX-License-Identifier: MIT
"""What stops the motor when the program that turns it is gone: the drive's own watch, and the end of the block.

A program that is killed, crashes or loses its cable can send nothing more: then the drive itself stops, `command_timeout_ms`
after the last word. Where that is 0, a client lends it a limit, speaks to the drive from a thread as long as the program
lives, and puts the 0 back at the end. A program that is asked to end (SIGTERM of systemd, docker or timeout; SIGHUP of a
terminal that was closed) leaves its block as by Ctrl-C, so that the motor brakes first.
"""
import contextlib
import signal
import threading

from .errors import Error, Refused

NAME = "command_timeout_ms"
TIMEOUT_MS = 5000  # longer than the longest answer, a whole capture: 3 s at 115200 baud
LEAST_MS, MOST_MS = 1000, 60000
FEEDS = 8          # words within the limit, of which some may come late
SOONEST_S = 0.02   # between two of them


class Watch:
    """Over the drives at one line, one for each axis."""

    def __init__(self, limit_ms):
        if limit_ms and not LEAST_MS <= limit_ms <= MOST_MS:
            raise Refused(f"{NAME} is 0 (nobody is watched) or {LEAST_MS}...{MOST_MS} ms, not {limit_ms}")
        self._limit_ms, self._drives, self._lent, self._theirs = limit_ms, [], [], []
        self._over, self._thread = threading.Event(), None
        self._each_s = limit_ms / 1000 / FEEDS

    def add(self, drive):
        if self._limit_ms:
            self._drives.append(drive)
            self.lend(drive)
            if self._thread is None:
                self._thread = threading.Thread(target=self._feed, daemon=True)
                self._thread.start()

    def lend(self, drive):
        """Where the drive has no limit of its own, and while it is off, for then alone parameters change."""
        if drive in self._drives and drive not in self._theirs:
            with contextlib.suppress(Refused, KeyError):  # it is on, or of a firmware that has none
                own_ms = drive.parameters([NAME])[NAME].value
                self._keep_to(own_ms)
                if own_ms == 0:
                    drive._set(NAME, self._limit_ms)
                    if drive not in self._lent:
                        self._lent.append(drive)

    def is_lent(self, drive):
        return drive in self._lent

    def forget(self, drive, own_ms):
        """The program sets the limit itself."""
        self._keep_to(own_ms)
        self._theirs.append(drive)
        if drive in self._lent:
            self._lent.remove(drive)

    def _keep_to(self, own_ms):
        if own_ms:
            self._each_s = max(SOONEST_S, min(self._each_s, own_ms / 1000 / FEEDS))

    @contextlib.contextmanager
    def own(self, drive):
        """The drive's own limit while it is kept for the next power-on."""
        lent = self.is_lent(drive)
        if lent:
            self._put_back(drive)
        try:
            yield
        finally:
            if lent:
                self.lend(drive)

    def _put_back(self, drive):
        self._lent.remove(drive)
        drive._set(NAME, 0)

    def end(self):
        self._over.set()
        for drive in self._lent[:]:
            with contextlib.suppress(Error):  # it turns, or does not hear: then the limit is right where it is
                self._put_back(drive)

    def _feed(self):
        while not self._over.wait(self._each_s):
            for drive in self._drives:
                with contextlib.suppress(Exception):  # who uses the line finds out, too, or has just closed it
                    drive._feed()


@contextlib.contextmanager
def ending_by_signal():
    """SIGTERM and SIGHUP raise SystemExit, where the program has not said otherwise; only the main thread can say."""
    before = {}
    if threading.current_thread() is threading.main_thread():
        for name in ("SIGTERM", "SIGHUP"):
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is signal.SIG_DFL:
                before[number] = signal.signal(number, _leave)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _leave(number, _frame):
    raise SystemExit(128 + number)
