# SPDX-License-Identifier: MIT
"""A drive by its console (docs/console.md): a serial port, or a TCP port that carries the same characters."""
import contextlib
import copy
import re
import threading
import time

import serial

from . import texts
from .answers import Answers
from .capture import Capture
from .drive import ANSWER_S, OFF, OPERATES, PATIENCE_S, Drive, Fault, Status
from .errors import Error, Refused, Silent
from .frames import Splitter

BAUD = 115200
DONE = re.compile(r"done: (?:axis (\d): )?(?:in position|homed|identify|learning|sweep)(?:;.*)?")
FEW = 4          # parameters that are sooner asked for by name: all of them take half a second
QUIET_S = 0.3    # without text: nothing of an earlier answer is still to come
PIECE_S = 0.02


class ConsoleDrive(Drive):
    """`place` is a serial port, or a URL of pyserial: socket://127.0.0.1:5021; `elf` the drive's image, whose variables have
    names then."""

    def __init__(self, place, elf=""):
        try:
            self._port = serial.serial_for_url(place, BAUD, timeout=PIECE_S, exclusive=True)
        except (serial.SerialException, ValueError, OSError) as error:
            taken = "exclusively" in str(error)  # pyserial's words where another program has locked it
            raise Silent(f"{place} is in use by another program" if taken else f"{place} cannot be opened: {error}") from error
        self._place, self._elf, self._image = place, elf, None
        self._names_of_signals = texts.Names(self.variables)
        self._answers, self._splitter, self._lost = Answers(), Splitter(), False
        self._console, self._number, self._prefix = self, 1, ""
        self._there = set()  # axes whose last command is done
        self._one_at_a_time = threading.RLock()  # the watch speaks, too
        self.said = []  # lines that came unasked, the oldest first
        try:
            self._enter_mode()
            self._see_axes()
        except BaseException:
            self._port.close()
            raise

    def close(self):
        """The console is for people again."""
        if self._console is not self:
            return
        self._watch.end()
        with contextlib.suppress(Error):  # it does not hear
            self._ask("machine off")
        self._port.close()

    def _see_axes(self):
        """With two each line names its own: which one is chosen is for people, and for the scope."""
        with contextlib.suppress(Refused):  # such a line is none where there is one
            self._ask("axis 1 status")
            self._prefix = "axis 1 "

    def _make_second(self):
        if not self._prefix:
            raise Refused("this drive has no axis 2")
        second = copy.copy(self)  # but for what its lines begin with, all is the console's
        second._number, second._prefix, second._started = 2, "axis 2 ", False
        return second

    # ---- lines ----

    def ask(self, line):
        """The lines of the answer to any line of the console. Raises Refused where the drive answers with an error."""
        if not line.isascii() or not line.isprintable():
            raise Refused("a line of the console has printable characters only")
        return self._console._ask(self._prefix + line)

    def _ask(self, line):
        with self._one_at_a_time:
            return self._asked(line)

    def _feed(self):
        self._console._ask("")

    def _asked(self, line):
        if self._lost:  # an answer may still be to come that is not this one's
            self._enter_mode()
        while self._port.in_waiting:
            self._hear()
        self._lost = True
        self._answers.expect()
        self._send(line.encode("ascii", "replace") + b"\r")
        end_s = time.monotonic() + ANSWER_S
        while not self._answers.ended:
            self._hear()
            if time.monotonic() > end_s:
                self._answers.give_up()
                raise Silent(f"no answer to '{line}' within {ANSWER_S:g} s")
        self._lost = False
        return texts.accepted([one for one in self._answers.lines if one])

    def _enter_mode(self):
        self._answers.expect_mode()
        self._send(b"\rmachine on\r\r")
        end_s, text_s = time.monotonic() + ANSWER_S, time.monotonic()
        while not (self._answers.mode_is_there() and time.monotonic() - text_s > QUIET_S):
            if self._hear():
                text_s = time.monotonic()
            if time.monotonic() > end_s:
                raise Silent(self._why_silent())
        self._answers.give_up()
        self._lost = False

    def _why_silent(self):
        """QEMU takes one program at a time at its port, and lets the next one wait."""
        if self._place.startswith("socket:"):
            return f"{self._place} is there and says nothing: another program is at it, or the drive has stopped"
        return "the drive does not answer: is the line connected, is its console at 115200 baud?"

    def _send(self, data):
        try:
            self._port.write(data)
        except (serial.SerialException, OSError) as error:
            raise Silent(f"the line is broken: {error}") from error

    def _hear(self):
        """Takes what has come; whether there was anything."""
        try:
            data = self._port.read(max(1, self._port.in_waiting))
        except (serial.SerialException, OSError) as error:
            raise Silent(f"the line is broken: {error}") from error
        for piece in self._splitter.take(data):
            for line in self._answers.take(piece) if isinstance(piece, bytes) else ():
                self.said.append(line)
                if found := DONE.fullmatch(line):
                    self._there.add(int(found[1] or 1))
        return bool(data)

    # ---- what drive.py asks for ----

    def _command(self, word, value=None):
        with self._one_at_a_time:
            while self._port.in_waiting:  # a line of what was asked before
                self._console._hear()
        self._there.discard(self._number)
        self.ask(word if value is None else f"{word} {value}")

    def _cyclic(self, word, value):
        self.ask(f"{word} {value}")

    def _arrived(self):
        """A move ends with a line of its own; one that ends otherwise has left operation."""
        state = self.state()
        there = self._number in self._there
        if not there and state != OPERATES and not self.fault():
            raise Error(f"it has ended in another state: {state}")
        return there

    def _up_s(self):
        return texts.number(self._fields().get("up", ""), "s")

    _line_name = "the console"

    def _commander(self):
        who = self._fields().get("commanded by", "nobody")
        return None if who == "nobody" else who

    # ---- what takes its time ----

    def _carried_out(self, word, told, patience_s, over=None):
        """Returns when the drive says that it is done; what ends otherwise, by a fault or another's word, is an exception."""
        with self._begins():
            self._command(word)
        self.wait(lambda: self._is_done(over), told, patience_s)

    def _is_done(self, over):
        state = self.state()  # a line that says so comes no later than this answer
        if self._number not in self._there and over is not None and state == over and not self.fault():
            self.state()
            if self._number not in self._there:
                raise Error("it was ended before it was done")
        return self._number in self._there

    def identify(self, patience_s=1200.0):
        """Measures the motor, off at its end; {quantity: what was found, its interval and unit, or why there is none}. `ask`
        "identify use" makes parameters of it."""
        self._carried_out("identify", "identify is not done", patience_s, OFF)
        self._started = False
        return texts.fields(self.ask("identify show"))

    def learn(self, what, patience_s=600.0):
        """`cogging`, in operation, or `hall`, off before and after: what `status` and the parameters then have."""
        self._carried_out(f"learn {what}", "it has not been learned", patience_s, OFF)

    def sweep(self, loop, ampere, patience_s=600.0):
        """The frequency response of a loop, d, q or speed, in operation: the lines of `sweep read`."""
        self._take_scope()
        self._carried_out(f"sweep {loop} {ampere}", "the sweep is not done", patience_s, OFF)
        return self.ask("sweep read")

    def _fields(self):
        found = texts.fields(self.ask("status"))
        if not {"state", "speed", "mode", "current", "bus"} <= set(found):
            raise Silent("what answers 'status' is no console of mssfoc, or another program asks there, too")
        return found

    def state(self):
        return self._fields()["state"]

    def status(self):
        found = self._fields()
        return Status(found["state"], texts.number(found["speed"], "rpm"),
                      texts.number(found["speed"].partition("reference")[2], "rpm"),
                      int(re.search(r"position: (-?\d+)", found["mode"])[1]), *texts.amperes(found["current"]),
                      texts.number(found["bus"], "V"))

    def fault(self):
        """What is latched, or None."""
        lines = self.ask("fault")
        name = texts.fault(lines)
        return name and Fault(name, texts.fields(lines))

    def parameters(self, names=None):
        """{name: Parameter}, all of them or those that are named."""
        if names is not None and len(names) <= FEW:
            every = {}
            for name in names:
                with contextlib.suppress(Refused):  # there is none of that name
                    every |= texts.parameters(self.ask(f"get {name}"))
        else:
            every = texts.parameters(self.ask("get all"))
        return {name: one for name, one in every.items() if names is None or name in names}

    def _names(self):
        return self.parameters()

    def _set(self, name, value):
        self.ask(f"set {name} {value}")

    def _save(self):
        self.ask("save")

    # ---- the scope, which is with one axis at a time ----

    def _take_scope(self):
        if self._prefix:
            self._console._ask(self._prefix.strip())

    def signals(self):
        """{name: Signal} that a capture can hold, without those by the names of variables."""
        return texts.signals(self.ask("scope list"))

    def variables(self):
        """The Variables of the drive's image."""
        if self._console._image is None:
            if not self._elf:
                raise Refused("names of variables are the image's: connect(..., elf='build/mssfoc.elf')")
            from .variables import Variables  # it reads the ELF by pyelftools

            self._console._image = Variables(self._elf, self.ask("version")[0])
        return self._console._image

    def watch(self, name):
        """A variable of the image as it is now, axes[0].speed.integral_q29: in its unit, by its name; of an enumeration
        `variables().find(name).enum` has the words."""
        one = self.variables().find(name)
        return one.of(*map(int, self.ask(f"scope values {one.words}")[2].split()))

    def arm(self, names, trigger="never", before=0, every=1):
        """A capture of those signals begins, each tick of the current loop or every so many; `captured` has it when whole.
        Variables of the image are signals, too.

        trigger   as the console has it, "speed rises 500"; a fault is one in any case. before: samples ahead of it
        """
        self._take_scope()
        for line in (f"signals {','.join(names)}", f"every {every}", f"before {before}", f"trigger {trigger}", "arm"):
            self.ask(self._names_of_signals.line(f"scope {line}"))

    def captured(self, patience_s=PATIENCE_S):
        """The Capture that `arm` began."""
        self.wait(lambda: texts.fields(self.ask("scope"))["capture"].startswith("done"), "the capture is not whole", patience_s,
                  faults=False)
        return self._recorded("read")

    def capture(self, names, every=1):
        """A Capture of what is now."""
        self.arm(names, every=every)
        self.ask("scope fire")
        return self.captured()

    def fault_capture(self):
        """What the last fault left: a Capture, or Refused, as if the scope was with the other axis."""
        return self._recorded("fault")

    def _recorded(self, what):
        raw = texts.capture(self.ask(f"scope {what}"))
        return Capture.of(raw, self._names_of_signals.heard(raw["names"], self.signals()))
