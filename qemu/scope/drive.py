# SPDX-License-Identifier: MIT
"""A drive by its console: one line at a time, each with its answer, while samples go on coming."""
import asyncio
import time

from launcher.errors import LauncherError
from mssfoc import texts
from mssfoc.answers import Answers
from mssfoc.errors import Refused
from mssfoc.frames import Sample, Splitter
from mssfoc.variables import Variables

ANSWER_S = 20.0   # the longest answer, a whole capture, takes 3 s at 115200 baud; a slow twin takes longer
SILENT_S = 0.8    # without a sample or an answer: it is silent; while it streams, something comes each millisecond
AT_WORK_S = 20.0   # the same where the other end is seen to go on, slowly: QEMU on a machine that is busy
REVIVE_S = 2.0    # for a drive that may be there again
QUIET_S = 0.3     # without text: nothing of an earlier answer is still to come
ENDS_S = 0.5      # a program that ends lets go of its line first, and then is found to have ended
AGAIN_S = 1.0     # between attempts to open a line that has ended
KEEP_UP_S = 1.0   # an empty line this often: the stream ends 3 s after the last line (operate/stream.h)
CONSOLE_BAUD, STREAM_BAUD = 115200, 921600
WORDS_A_LINE = 8


class DriveError(Exception):
    """What keeps a command from being answered, in one line."""


class Drive:
    """`far` is the line's other end: async read(), write(bytes), set_baud(rate), reopen(), close(); ended() says why it has
    ended for good, or None; at_work(), that it is seen to go on."""

    def __init__(self, far, on_samples, on_said):
        self.far, self.damaged, self._broken, self._out_of_step = far, 0, "", ""
        self.heard_s = time.monotonic()  # a sample, or an answer
        self._on_samples, self._on_said = on_samples, on_said
        self._splitter, self._answers, self._text_s = Splitter(), Answers(), 0.0
        self._asked, self._ended, self._busy = False, asyncio.Event(), asyncio.Lock()
        self._tasks = []
        self.names, self._image = texts.Names(self.variables), None

    def start(self):
        self._tasks = [asyncio.ensure_future(self._listen())]

    async def close(self):
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self.far.close()

    def silent(self):
        """Why nothing comes, or an empty text."""
        if reason := self.far.ended() or self._broken:
            return reason
        quiet_s = time.monotonic() - self.heard_s
        limit_s = AT_WORK_S if self.far.at_work() else SILENT_S
        return f"no answer for {quiet_s:.0f} s" if quiet_s > limit_s else self._out_of_step

    async def _listen(self):
        while not self.far.ended():
            try:
                while data := await self.far.read():
                    self._take(data)
                await asyncio.sleep(ENDS_S)
                self._broken = "" if self.far.ended() else "the line has ended"
            except OSError as error:
                self._broken = f"the line is broken: {error}"
            await asyncio.sleep(AGAIN_S)
            if not self.far.ended():
                await self._reopen()

    async def _reopen(self):
        try:
            await self.far.reopen()
            self._broken, self._splitter = "", Splitter()
        except (OSError, LauncherError):
            pass  # again, later

    def _take(self, data):
        samples = []
        for piece in self._splitter.take(data):
            if isinstance(piece, Sample):
                samples.append(piece)
            else:
                self._hear(piece)
        self.damaged = self._splitter.damaged
        if samples:
            self.heard_s = time.monotonic()
            self._on_samples(samples)

    async def _send(self, data):
        if reason := self.far.ended() or self._broken:
            raise DriveError(reason)
        try:
            await self.far.write(data)
        except OSError as error:
            raise DriveError(f"the line is broken: {error}") from error

    async def shout(self, line):
        """Sends a line to a drive that may hear, though it does not answer."""
        await self._send(b"\r" + line.encode("ascii") + b"\r")

    def _hear(self, text):
        self._text_s = time.monotonic()
        if self._asked:
            self.heard_s = self._text_s  # a long answer takes the place of samples
        said = self._answers.take(text)
        if self._answers.ended:
            self._ended.set()
        if said:
            self._on_said("\n".join(said))

    async def program_mode(self, patience_s=ANSWER_S):
        """From a person's console to the mode for programs; a drive that is in it already answers as well."""
        async with self._busy:
            self._answers.expect_mode()
            self._asked = True
            try:
                await self._send(b"\rmachine on\r\r")
                end = time.monotonic() + patience_s
                while not (self._answers.mode_is_there() and time.monotonic() - self._text_s > QUIET_S):
                    if time.monotonic() > end or self.far.ended():
                        raise DriveError(self.far.ended() or "the drive does not answer: is the line connected, is its console"
                                         " at 115200 baud?")
                    await asyncio.sleep(0.02)
                self.heard_s, self._out_of_step = time.monotonic(), ""
            finally:
                self._asked = False
                self._answers.give_up()

    def variables(self):
        """The Variables of the image; raises Refused where there is no ELF of it."""
        if isinstance(self._image, Variables):
            return self._image
        raise self._image or Refused("the image's ELF has not been read")

    async def know_image(self, elf):
        version = " ".join(await self.ask("version"))
        try:
            self._image = await asyncio.to_thread(Variables, elf, version)
        except Refused as error:
            self._image = error

    async def ask(self, line):
        """The lines of the answer. Raises DriveError when there is none."""
        try:
            line = self.names.line(line)
        except Refused as error:
            raise DriveError(str(error)) from error
        async with self._busy:
            if reason := self.silent():
                raise DriveError(f"the drive is silent: {reason}")
            self._answers.expect()
            self._ended.clear()
            self._asked = True
            try:
                await self._send(line.encode("ascii", "replace") + b"\r")
                await self._answered(line)
            finally:
                self._asked = False
                self._answers.give_up()
            return [one for one in self._answers.lines if one]

    async def _answered(self, line):
        end = time.monotonic() + ANSWER_S
        while not self._ended.is_set():
            try:
                async with asyncio.timeout(SILENT_S / 10):  # wait_for() of Python 3.11 can swallow a cancellation
                    await self._ended.wait()
            except TimeoutError:
                reason = self.silent() or (time.monotonic() > end and f"no answer within {ANSWER_S:g} s")
                if reason:
                    self._out_of_step = reason  # the answer may come yet, and must not pass for another's
                    raise DriveError(f"'{line}': {reason}") from None

    async def revive(self):
        """From a line at any rate, in any mode, to where it was; raises DriveError when nobody answers."""
        await self.far.set_baud(CONSOLE_BAUD)
        await self.program_mode(REVIVE_S)

    async def stream(self, every_ms):
        """Samples come every so many milliseconds, until keep_up() is not called for 3 s."""
        answer = await self.ask(f"stream {every_ms} {STREAM_BAUD}")
        if answer != ["ok"]:
            raise DriveError(f"the drive does not stream: {' '.join(answer)}")
        await self.far.set_baud(STREAM_BAUD)
        self._answers.rest = ""  # what the line made of the change

    async def _parsed(self, line, of):
        try:
            return of(await self.ask(line))
        except Refused as error:
            raise DriveError(str(error)) from error

    async def signals(self):
        return await self._parsed("scope list", texts.signals)

    async def chosen(self):
        return await self._parsed("scope", texts.chosen)

    async def capture(self, what="read"):
        """{"names", "rows" of raw values, "trigger", "per_ms"} of the last capture, or of what the last fault left."""
        return await self._parsed(f"scope {what}", texts.capture)

    async def values(self, names):
        """{name: value now} of variables."""
        found = {}
        for at in range(0, len(names), WORDS_A_LINE // 2):  # one of eight bytes has two words
            some = {name: self.variables().find(name) for name in names[at:at + WORDS_A_LINE // 2]}
            lines = await self.ask(f"scope values {','.join(one.words for one in some.values())}")
            words = map(int, lines[2].split())
            found |= {name: one.of(*(next(words) for _ in one.words.split(","))) for name, one in some.items()}
        return found

    async def parameters(self):
        """[{"name", "value", "least", "most", "unit"}]"""
        return [vars(one) for one in (await self._parsed("get all", texts.parameters)).values()]
