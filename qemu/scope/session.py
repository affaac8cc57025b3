# SPDX-License-Identifier: MIT
"""What goes on between the drive and the pages that are open: one session for all of them.

Pages get messages, dictionaries with a key "kind": hello, samples, status, said, capture, parameters, answer, applied, chosen,
signals; silent when the drive says nothing, with why, since when and its last words, and awake when it does again. They send
{"kind": "line", "line": ...}, {"kind": "stop"}, {"kind": "set", "values": {name: value}, "what": ...},
{"kind": "disturb", ...}, {"kind": "jog", "rpm": ...} as long as a button is held, {"kind": "capture"},
{"kind": "parameters"}, {"kind": "axis", "number": 2}, which is for all pages, and {"kind": "here"}; of variables of the image
{"kind": "find", "text": part of a name}, which is answered by "found", and {"kind": "watch", "names": [...]}, from when on
"values" come with each status.
All see what one commands; "own" is true for that one.
Whoever has started the motor from a page and goes away, by closing it or by falling silent, leaves it to the session, which
stops it. Of a session that is killed the drive itself finds out: limit.py.
"""
import asyncio
import contextlib
import re
import sys
import time

from mssfoc import texts
from mssfoc.errors import Refused

from . import words
from .drive import KEEP_UP_S, Drive, DriveError
from .jog import Jog
from .limit import Limit

STATUS_S = 0.4
LOOK_S = 0.1       # how often the line is looked at
SILENCE_S = 5.0    # a page that has not said "here" for so long is gone
STOP_S = 6.0       # from quick stop to off
EVERY_MS = 1
MOVES = ("on", "take", "identify", "speed", "torque", "pv", "pp", "hm", "csp", "csv", "cst", "learn", "sweep")
CHANGES = ("set", "load", "defaults")  # and `identify use`
MEANT_FOR_HERE = ("stream",)
HERE = "the console"
LINE_MOST = 400      # with names of variables, of which the drive gets the addresses
WATCHED_MOST = 24    # of a page: each four take a line more


def _age_s(status, fault):
    """Of a fault, by the drive's own clock: it may be older than this session."""
    up, at = (texts.number(texts.fields(lines).get(key, ""), "s") for lines, key in ((status, "up"), (fault, "at")))
    return 0.0 if up is None or at is None else max(0.0, up - at)


def _short(lines):
    """Of an axis that may not be the chosen one."""
    found = texts.fields(lines)
    return {"state": found.get("state", ""), "fault": found.get("fault", "none"), "owner": found.get("commanded by", "nobody"),
            "rpm": texts.number(found.get("speed", ""), "rpm")}


def _rounded(one):
    """From raw to what a page gets of a signal or a variable."""
    digits = 12 if hasattr(one, "enum") else 6
    return lambda word: round(one.of(word), digits)


class Session:
    def __init__(self, far):
        self.far, self.pages, self.started = far, {}, False
        self.drive = Drive(far, self._samples, self._said)
        self._jog, self._limit, self._axes = Jog(self.drive.ask), Limit(self.drive.ask), ("",)
        self.signals, self.chosen, self.state = {}, {}, ""  # {name: Signal or Variable}
        self._watched = {}  # page: names of variables
        self._fault, self._hint, self._since = "none", [], ""
        self._silent, self._last_said = None, ""
        self._axis, self._states = 0, []  # the one that the console has chosen: lines without a number are for it
        self._ending, self._tasks = asyncio.Event(), []

    async def open(self):
        await self.far.open()
        self.drive.start()
        await self.drive.program_mode()
        for line in self.far.lines:
            answer = await self.drive.ask(line)
            if answer != ["ok"]:
                raise DriveError(f"'{line}': {' '.join(answer)}")
        if "state" in texts.fields(await self.drive.ask("axis 2 status")):
            self._axes = ("axis 1 ", "axis 2 ")
            await self.drive.ask("axis 1")
        await self._limit.lend(self._axes)
        await self.drive.know_image(self.far.elf)
        await self._read_signals()
        await self.drive.stream(EVERY_MS)
        self._tasks = [asyncio.ensure_future(self._watch()), asyncio.ensure_future(self._mind_line()),
                       asyncio.ensure_future(self._mind_jog())]

    async def close(self):
        self._ending.set()  # a task that waits for an answer gets it first: it must not pass for that of the stop below
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self._stop()
        try:
            await self._limit.put_back()
            await self.drive.ask("stream 0 115200")
            await self.far.set_baud(115200)
            await self.drive.ask("machine off")
        except DriveError:
            pass  # it ends by itself
        await self.drive.close()

    async def _read_signals(self):
        self.signals = await self.drive.signals()
        self.chosen = self.drive.names.heard(await self.drive.chosen(), self.signals)

    def _told_signals(self, *more):
        """{name: (unit, value of a step, text)} of all that a page may have to show."""
        return {name: (one.unit, one.step, one.text)
                for some in (self.signals, self.chosen, *more) for name, one in some.items()}

    def enumerations(self):
        return words.enumerations() | {name: one.enum for name, one in self.chosen.items() if getattr(one, "enum", None)}

    # ---- pages ----

    def join(self, page, send):
        self.pages[page] = [send, time.monotonic()]
        send({"kind": "hello", "title": self.far.title, "twin": self.far.name == "twin", "every_ms": EVERY_MS,
              "disturbances": getattr(self.far, "disturbances", {}), "signals": self._told_signals(),
              "chosen": list(self.chosen), "axis": self._axis + 1,
              "words": words.parameters(), "steps": words.identify_steps()})
        if self._silent:
            send(self._silent)

    def leave(self, page):
        self.pages.pop(page, None)
        self._watched.pop(page, None)

    def _tell(self, message):
        for send, _ in list(self.pages.values()):
            send(message)

    def _answer(self, page, line, lines):
        for other, (send, _) in list(self.pages.items()):
            send({"kind": "answer", "line": line, "lines": lines, "own": other is page})

    async def take(self, page, message):
        """What a page has sent, even if it has been closed since. Answers and news go to all."""
        if page in self.pages:
            self.pages[page][1] = time.monotonic()
        kind = message.get("kind")
        try:
            if kind == "line":
                await self._line(page, str(message.get("line", "")).strip())
            elif kind == "stop":
                await self._brake(page)
            elif kind == "set":
                await self._set(page, message.get("values"), str(message.get("what", kind)))
            elif kind == "jog":
                await self._turn(page, message.get("rpm"))
            elif kind == "capture":
                await self._tell_capture(message.get("of", "read"))
            elif kind == "find":
                self._find(page, str(message.get("text", "")))
            elif kind == "watch":
                await self._watch_variables(page, [str(name) for name in message.get("names", [])])
            elif kind == "axis":
                await self._choose(page, message.get("number"))
            elif kind == "parameters":
                await self._tell_parameters()
            elif kind == "disturb":
                asked = str(message.get("line", "")).split()
                wrong = await self.far.disturb(asked[0], asked[1:], self._axis) if asked else "what?"
                self._answer(page, f"twin: {' '.join(asked)}", [f"error: {wrong}" if wrong else "ok"])
        except DriveError as error:
            self._answer(page, str(message.get("line", kind)), [f"error: {error}"])

    async def _line(self, page, line):
        words_of = line.split()
        for_axis = words_of[:2] if words_of[:1] == ["axis"] and len(words_of) > 2 else []
        word, name, *_ = [*words_of[len(for_axis):], "", ""]
        if not line.isascii() or not line.isprintable() or len(line) > LINE_MOST:
            self._answer(page, line, [f"error: a line has at most {LINE_MOST} printable characters"])
            return
        if word in MEANT_FOR_HERE:
            self._answer(page, line, ["error: the page keeps the stream itself"])
            return
        if word == "set":
            self._limit.see(name)
        async with self._limit.around(word):
            asked = self.drive.ask(line)
            answer = await (self._begun(asked) if word in MOVES else asked)
        self._answer(page, line, answer)
        if line.startswith("scope signals ") and answer == ["ok"]:
            self.chosen = self.drive.names.heard(await self.drive.chosen(), self.signals)
            self._tell({"kind": "signals", "signals": self._told_signals()})
            self._tell({"kind": "chosen", "chosen": list(self.chosen)})
        elif (word in CHANGES or line == "identify use") and not " ".join(answer).startswith("error"):
            await self._tell_parameters()

    async def _begun(self, asked):
        """The answer. What is begun here is stopped when nobody is here any more; another line's is not."""
        try:
            answer = await asked
        except DriveError:
            self.started = True  # it may have heard
            raise
        self.started = self.started or (answer is not None and not " ".join(answer).startswith("error"))
        return answer

    async def _tell_capture(self, of):
        raw = await self.drive.capture("fault" if of == "fault" else "read")
        found = self.drive.names.heard(raw["names"], self.signals)
        self._tell({"kind": "signals", "signals": self._told_signals(found)})
        columns = [_rounded(one) for one in found.values()]
        rows = [[of(word) for of, word in zip(columns, row, strict=True)] for row in raw["rows"]]
        self._tell({"kind": "capture", "of": of, **raw, "names": list(found), "rows": rows})

    def _find(self, page, text):
        try:
            image = self.drive.variables()
            rows = [[one.name, one.type, one.unit] for one in map(image.find, image.like(text))] if text else []
            self.pages[page][0]({"kind": "found", "text": text, "rows": rows})
        except Refused as error:
            raise DriveError(str(error)) from error

    async def _watch_variables(self, page, names):
        try:
            found = {name: self.drive.variables().find(name) for name in names[:WATCHED_MOST]}
        except Refused as error:
            raise DriveError(str(error)) from error
        self._watched[page] = found
        self._tell({"kind": "signals", "signals": self._told_signals(found)})
        await self._tell_values()

    async def _tell_values(self):
        wanted = {name: one for some in self._watched.values() for name, one in some.items()}
        if wanted:
            values = await self.drive.values(list(wanted))
            self._tell({"kind": "values", "values": {name: [value, wanted[name].enum.get(value, "")]
                                                     for name, value in values.items()}})

    async def _tell_parameters(self):
        self.signals = await self.drive.signals()  # their ranges are parameters
        self._tell({"kind": "signals", "signals": self._told_signals()})
        self._tell({"kind": "parameters", "rows": await self.drive.parameters()})

    async def _set(self, page, values, what):
        """Many parameters, one after another; what is refused does not keep the others from being taken."""
        if not isinstance(values, dict) or not all(re.fullmatch(r"\w{1,40}", name) and isinstance(value, int)
                                                   for name, value in values.items()):
            self._answer(page, what, ["error: values are whole numbers, by their parameters' names"])
            return
        refusals = {}
        for name, value in values.items():
            self._limit.see(name)
            answer = await self.drive.ask(f"set {name} {value}")
            if answer != ["ok"]:
                refusals[name] = " ".join(answer)
        await self._tell_parameters()
        for other, (send, _) in list(self.pages.items()):
            send({"kind": "applied", "what": what, "taken": len(values) - len(refusals), "refusals": refusals,
                  "own": other is page})

    async def _turn(self, page, rpm):
        """As long as the page goes on saying so."""
        if not isinstance(rpm, int) or abs(rpm) > 100000:
            self._answer(page, "jog", ["error: a speed is a whole number of rpm"])
            return
        if (answer := await self._begun(self._jog.hold(rpm))) is not None:
            self._answer(page, f"speed {rpm}", answer)

    async def _choose(self, page, number):
        """The other axis, with all that is shown; the scope goes with it, or refuses."""
        if number not in range(1, len(self._axes) + 1):
            self._answer(page, f"axis {number}", ["error: there is no such axis"])
            return
        await self._jog.hold(0)
        answer = await self.drive.ask(f"axis {number}")
        self._answer(page, f"axis {number}", answer)
        if answer == ["ok"]:
            self._axis, self._fault = number - 1, ""
            self._tell({"kind": "axis", "number": number})
            await self._tell_parameters()
            self._tell({"kind": "chosen", "chosen": list(self.chosen)})
            await self._look()

    async def _brake(self, page):
        """Quick stop where there is operation to be stopped, off in every other state, of each axis. One that is silent may
        still hear."""
        for axis, state in zip(self._axes, self._states or [""] * len(self._axes)):
            if self._silent:
                line = f"{axis}quickstop" if state.startswith("operation enabled") else f"{axis}off"
                await self.drive.shout(line)
                self._answer(page, line, ["sent; the drive does not answer"])
                continue
            for line in (f"{axis}quickstop", f"{axis}off"):
                answer = await self.drive.ask(line)
                self._answer(page, line, answer)
                if answer == ["ok"]:
                    break

    # ---- the drive ----

    def _samples(self, samples):
        columns = [_rounded(self.signals.get(name, one)) for name, one in self.chosen.items()]
        rows = [[s.number] + [of(word) for of, word in zip(columns, s.values)] for s in samples
                if len(s.values) == len(columns)]
        if rows:
            self._tell({"kind": "samples", "rows": rows})

    def _said(self, text):
        self._last_said = text
        self._tell({"kind": "said", "text": text})

    async def _goes_on(self, seconds):
        """True after so long; False as soon as the session ends."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._ending.wait()
        return not self._ending.is_set()

    async def _watch(self):
        """The state, again and again, which keeps the stream up as well; and whether somebody is still there."""
        while await self._goes_on(min(STATUS_S, KEEP_UP_S)):
            for task in (self._revive if self._silent else self._look, self._mind_pages):
                with contextlib.suppress(DriveError):  # the line is minded below
                    await task()

    async def _mind_jog(self):
        while await self._goes_on(LOOK_S):
            with contextlib.suppress(DriveError):  # again, when the line is back
                await self._jog.mind()

    async def _revive(self):
        await self.drive.revive()
        await self._limit.lend()  # it may have been reset
        await self.drive.stream(EVERY_MS)
        await self._read_signals()
        self._silent = None
        print("mssfoc: the drive answers again", file=sys.stderr, flush=True)
        self._tell({"kind": "awake"})
        self._tell({"kind": "signals", "signals": self._told_signals()})
        self._tell({"kind": "chosen", "chosen": list(self.chosen)})

    async def _mind_line(self):
        """What pages show is stale from when the drive falls silent until it answers again."""
        while await self._goes_on(LOOK_S):
            if not (why := self.drive.silent()):
                continue
            if self._silent is None:
                quiet_s = time.monotonic() - self.drive.heard_s
                since = time.strftime("%H:%M:%S", time.localtime(time.time() - quiet_s))
                words = self.far.last_words() or self._last_said
                self._silent = {"kind": "silent", "since": since, "words": words}
                print(f"mssfoc: the drive is silent since {since}: {why}", file=sys.stderr, flush=True)
            if why != self._silent.get("why"):
                self._silent["why"] = why
                self._tell(dict(self._silent))

    async def _look(self):
        every, chosen = [await self.drive.ask(f"{axis}status") for axis in self._axes], self._axis
        told = [_short(lines) for lines in every]
        lines, fault = every[chosen], told[chosen]["fault"]
        if fault != self._fault:
            self._hint = await self.drive.ask(f"{self._axes[chosen]}fault") if fault != "none" else []
            self._since = time.strftime("%H:%M:%S", time.localtime(time.time() - _age_s(lines, self._hint)))
        self._states = [one["state"] for one in told]
        if chosen != self._axis:
            return  # another one since
        self._fault, self.state = fault, self._states[chosen]
        capture = next((line for line in await self.drive.ask("scope") if line.startswith("capture: ")), "")
        self._tell({"kind": "status", "axes": told, "lines": lines, "state": self.state, "fault": fault, "hint": self._hint,
                    "since": self._since, "capture": capture.removeprefix("capture: "), "damaged": self.drive.damaged})
        await self._tell_values()

    async def _mind_pages(self):
        now = time.monotonic()
        for page in [page for page, (_, heard) in self.pages.items() if now - heard > SILENCE_S]:
            self.leave(page)
        if not self.pages:
            await self._stop()

    async def _is_taken(self, axis):
        """Whether another line has taken it over since."""
        return texts.fields(await self.drive.ask(f"{axis}status")).get("commanded by", HERE) not in (HERE, "nobody")

    async def _stop(self):
        """A controlled stop, if the motor was started from a page: quick stop, and off when it takes too long or cannot be."""
        if not self.started:
            return
        self.started = False
        try:
            axes = [axis for axis in self._axes if not await self._is_taken(axis)]
            for axis in axes:
                await self.drive.ask(f"{axis}quickstop")
            end = time.monotonic() + STOP_S
            for axis in axes:
                while time.monotonic() < end:
                    lines = await self.drive.ask(f"{axis}status")
                    if not re.search(r"operation enabled|quick stop", lines[0]):
                        break
                    await asyncio.sleep(0.1)
                await self.drive.ask(f"{axis}off")
        except DriveError as error:
            print(f"mssfoc: the motor may still turn, {error}", file=sys.stderr, flush=True)
            with contextlib.suppress(DriveError):
                for axis in self._axes:
                    await self.drive.shout(f"{axis}quickstop")
