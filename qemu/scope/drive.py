# SPDX-License-Identifier: MIT
"""A drive by its console: one line at a time, each with its answer, while samples go on coming."""
import asyncio
import re

from .line import Sample, Splitter

END = b".\r\n"      # behind each answer in the console's mode for programs (docs/console.md)
ANSWER_S = 8.0    # the longest answer, a whole capture, takes 3 s at 115200 baud
KEEP_UP_S = 1.0   # an empty line this often: the stream ends 3 s after the last line (operate/stream.h)
STREAM_BAUD = 921600


class DriveError(Exception):
    """What keeps a command from being answered, in one line."""


class Drive:
    """`far` is the line's other end: async read(), write(bytes), set_baud(rate), close()."""

    def __init__(self, far, on_samples, on_said):
        self.far, self.damaged = far, 0
        self._on_samples, self._on_said = on_samples, on_said
        self._splitter, self._text = Splitter(), bytearray()
        self._ended, self._busy = asyncio.Event(), asyncio.Lock()
        self._asked = False
        self._tasks = []

    def start(self):
        self._tasks = [asyncio.ensure_future(self._listen())]

    async def close(self):
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self.far.close()

    async def _listen(self):
        while data := await self.far.read():
            samples = []
            for piece in self._splitter.take(data):
                if isinstance(piece, Sample):
                    samples.append(piece)
                else:
                    self._hear(piece)
            self.damaged = self._splitter.damaged
            if samples:
                self._on_samples(samples)
        self._on_said("the line has ended")

    def _hear(self, text):
        """Lines of an answer, or what comes while none is due: a fault, a warning, a greeting after a reset."""
        self._text += text
        if self._asked:
            if self._text == END or self._text.endswith(b"\n" + END):
                self._ended.set()
        elif self._text.endswith(b"\n"):
            said = self._text.decode("ascii", "replace").replace("\r", "").strip()
            self._text.clear()
            if said:
                self._on_said(said)

    async def program_mode(self):
        """From a person's console to the mode for programs; a drive that is in it already answers as well."""
        async with self._busy:
            await self.far.write(b"\rmachine on\r\r")
            end = asyncio.get_running_loop().time() + ANSWER_S
            while not self._text.endswith(b"\n" + END):
                if asyncio.get_running_loop().time() > end:
                    raise DriveError("the drive does not answer: is the line connected, is its console at 115200 baud?")
                self._asked = True  # what comes now is for nobody
                await asyncio.sleep(0.02)
            self._asked = False
            self._text.clear()

    async def ask(self, line):
        """The lines of the answer. Raises DriveError when there is none."""
        async with self._busy:
            self._text.clear()
            self._ended.clear()
            self._asked = True
            try:
                await self.far.write(line.encode("ascii", "replace") + b"\r")
                await asyncio.wait_for(self._ended.wait(), ANSWER_S)
            except asyncio.TimeoutError:
                raise DriveError(f"no answer to '{line}' within {ANSWER_S:g} s: is the line connected?") from None
            finally:
                self._asked = False
            text = self._text.removesuffix(END).decode("ascii", "replace").replace("\r", "")
            self._text.clear()
        return [one for one in text.split("\n") if one]

    async def stream(self, every_ms):
        """Samples come every so many milliseconds, until keep_up() is not called for 3 s."""
        answer = await self.ask(f"stream {every_ms} {STREAM_BAUD}")
        if answer != ["ok"]:
            raise DriveError(f"the drive does not stream: {' '.join(answer)}")
        await self.far.set_baud(STREAM_BAUD)

    async def signals(self):
        """{name: (unit, value of a step, text)}"""
        found = {}
        for line in await self.ask("scope list"):
            match = re.fullmatch(r"(\w+) (\S+) (-?\d+)/(\d+): (.*)", line)
            if match:
                name, unit, milli, per, text = match.groups()
                found[name] = ({"none": "", "%_of_bus": "% of bus"}.get(unit, unit), int(milli) / int(per) / 1000, text)
        if not found:
            raise DriveError("the drive has no scope: is its firmware older than this page?")
        return found

    async def chosen(self):
        line = (await self.ask("scope"))[0]
        return re.match(r"signals: (\S+), every", line).group(1).split(",")

    async def capture(self, what="read"):
        """{"names", "rows" of raw values, "trigger", "per_ms"} of the last capture, or of what the last fault left."""
        lines = await self.ask(f"scope {what}")
        if len(lines) < 4:
            raise DriveError(" ".join(lines))
        heading = dict(item.split(": ") for item in lines[0].split(", "))
        return {"names": lines[1].split(), "rows": [[int(v) for v in line.split()] for line in lines[3:-1]],
                "trigger": int(heading["trigger"]), "per_ms": int(heading["a millisecond has"]) / int(heading["every"])}

    async def parameters(self):
        """[{"name", "value", "least", "most", "unit"}]"""
        form = re.compile(r"(\w+) = (-?\d+)(?: (\S.*?))?  \((-?\d+)\.\.\.(-?\d+)\)")
        rows = [form.fullmatch(line) for line in await self.ask("get all")]
        return [{"name": row[1], "value": int(row[2]), "least": int(row[4]), "most": int(row[5]), "unit": row[3] or ""}
                for row in rows if row]

