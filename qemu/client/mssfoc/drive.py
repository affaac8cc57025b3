# SPDX-License-Identifier: MIT
"""What every line can do with a drive. console.py and bus.py say how.

Names of parameters and of their units are the drive's own (docs/reference.md). Speeds are in rpm, torque is the q current in
peak amperes, positions are encoder counts from the zero. Nothing here is for several threads at once.
"""
import contextlib
import difflib
import time
from dataclasses import dataclass, replace

from .errors import Error, Faulted, Refused, Silent
from .settings import OF_THE_LINE, read_settings, written_settings
from .watch import NAME as TIMEOUT
from .watch import Watch, ending_by_signal

PATIENCE_S = 60.0  # for a start, which aligns the rotor, and for a move
ANSWER_S = 20.0    # the longest, a whole capture, takes 3 s at 115200 baud; a slow simulation takes longer
LOOK_S = 0.05      # between two looks at the state
ATTEMPTS = 3       # to switch off on a line that is disturbed
OFF = "switch on disabled"
OPERATES, STOPS, REACTS = "operation enabled", "quick stop active", "fault reaction active"
BRAKING = (OPERATES, STOPS, REACTS)
AXES = (1, 2)


@dataclass(frozen=True)
class Status:
    state: str  # of CiA 402, or of a start or a commissioning, in lower case
    speed_rpm: float
    speed_ref_rpm: float
    position_counts: int
    i_d_a: float
    i_q_a: float
    bus_v: float


@dataclass(frozen=True)
class Fault:
    name: str
    record: dict  # {what: value or text} of the instant at which it came


class Drive:
    """A context manager: at its end, that by SIGTERM or SIGHUP included, the drive is stopped, if it was started from here and
    no other line has taken it over, and the line closed. The drive itself stops when it hears nothing more (watch.py).

    Of a drive with two axes it is the first; `axis(2)` is the other. They share the line, which ends with the first.
    """

    _started, _first, _second = False, None, None
    _watch, _signals = Watch(0), contextlib.nullcontext()

    def watched(self, watch):
        """This drive, from now on with a watch over it."""
        self._watch = watch
        watch.add(self)
        return self

    def __enter__(self):
        self._signals = ending_by_signal()
        self._signals.__enter__()
        return self

    def __exit__(self, kind, *_):
        started = [one for one in (self, self._second) if one and one._started and not one._is_taken()]
        with contextlib.ExitStack() as last_is_first:
            last_is_first.callback(self._signals.__exit__, None, None, None)
            last_is_first.callback(self.close)
            for one in started:
                last_is_first.callback(one._end, kind)
            for one in started[:-1]:  # it does not turn on until the other is at rest
                with contextlib.suppress(Error):
                    one._brake()

    def _is_taken(self):
        """Whether another line has taken it over since."""
        with contextlib.suppress(Error):
            return self._commander() not in (None, self._line_name)
        return False

    _line_name = "nobody"

    def _commander(self):
        """Who commands, None if nobody does or the drive does not tell."""

    def _end(self, kind):
        with contextlib.suppress(Error) if kind else contextlib.nullcontext():  # what ended the block says more
            self.stop()

    def axis(self, number):
        """The Drive of axis 1 or 2 of this drive. What was started through it stops with this one, too."""
        first = self._first or self
        if number not in AXES:
            raise Refused(f"axes are {AXES[0]} and {AXES[1]}, not {number!r}")
        if number == 2 and first._second is None:
            second = first._make_second()
            second._first, first._second = first, second
            second.watched(first._watch)
        return first if number == 1 else first._second

    # ---- states ----

    def on(self, patience_s=PATIENCE_S):
        """To operation enabled; returns when it is there."""
        if self.state() == OPERATES:
            raise Refused("the drive is on already")
        self._watch.lend(self)  # `load` and `defaults` have taken it away
        with self._begins():
            self._command("on")
        self.wait(lambda: self.state() == OPERATES, "operation is not enabled", patience_s)

    @contextlib.contextmanager
    def _begins(self):
        """What is begun here ends with the block, unless it was refused: then what goes on is another's."""
        before, self._started = self._started, True
        try:
            yield
        except Refused:
            self._started = before
            raise

    def stop(self, patience_s=PATIENCE_S):
        """Brakes to rest, then off, from whatever state; a stop that a fault began goes on. Whatever happens, off is sent."""
        try:
            self._brake()
            self.wait(lambda: self.state() not in BRAKING, "it does not come to rest", patience_s, faults=False)
        finally:
            self.off()

    def _brake(self):
        if self.state() == OPERATES:
            self._command("quickstop")

    def off(self):
        """The bridge off at once; the motor coasts."""
        for attempt in range(1, ATTEMPTS + 1):
            try:
                self._command("off")
                break
            except Silent:
                if attempt == ATTEMPTS:
                    raise
        self._started = False

    def clear(self):
        """Forgets a fault whose cause is gone."""
        self._command("clear")

    def wait(self, condition, told, patience_s=PATIENCE_S, faults=True):
        """Until the condition holds. Raises Faulted when a fault comes first, and Error with what is `told` when time is up: by
        the drive's clock, which in QEMU may be slower than this machine's."""
        clock = _Clock(self._up_s)
        while not condition():
            if faults:
                self._see_refusal()
                if fault := self.fault():
                    raise Faulted(fault)
            if clock.passed_s() > patience_s:
                raise Error(f"{told}, after {patience_s:g} s")
            time.sleep(LOOK_S)

    def _up_s(self):
        """Seconds since the drive's start, None where it does not tell."""

    def _see_refusal(self):
        """Raises Refused where a line says only later that a command was refused."""

    def take(self):
        """Takes over what another line commands: it goes on as it is, and this program commands it and ends it."""
        self._command("take")
        self._started = True

    # ---- modes ----

    def speed(self, rpm):
        """Profile velocity (pv): along the ramp; returns at once."""
        self._command("speed", rpm)

    def torque(self, ampere):
        """Torque (tq), at once."""
        self._command("torque", ampere)

    def move(self, counts, by=False, patience_s=PATIENCE_S):
        """Profile position (pp), to counts from the zero or by so many from the last target; returns when it is there."""
        self._command("pp by" if by else "pp", counts)
        self.wait(self._arrived, "it is not in position", patience_s)

    def home(self, method="index", patience_s=PATIENCE_S):
        """Homing (hm) to the encoder's index or to a block; returns when it is done."""
        self._command("hm", method)
        self.wait(self._arrived, "it is not homed", patience_s)

    def cyclic_position(self, counts):
        """csp: there in cyclic_ms, when the next set-point is due. A refusal shows at the next command."""
        self._cyclic("csp", counts)

    def cyclic_speed(self, rpm):
        """csv"""
        self._cyclic("csv", rpm)

    def cyclic_torque(self, ampere):
        """cst"""
        self._cyclic("cst", ampere)

    # ---- parameters ----

    def __getitem__(self, name):
        found = self.parameters([name])
        if name not in found:
            raise self._no_parameter(name)
        return found[name].value

    def __setitem__(self, name, value):
        self.set({name: value})

    def set(self, values):
        """Parameters, {name: whole number}, only while the drive is off: all, or as they were before.

        What a line that falls silent leaves half set, the exception names.
        """
        before = self.parameters(values)
        if unknown := [name for name in values if name not in before]:
            raise self._no_parameter(unknown[0])
        for name, value in values.items():
            check(value, before[name])
        if TIMEOUT in values:
            self._watch.forget(self, values[TIMEOUT])
        done = []
        try:
            for name, value in values.items():
                if before[name].value != value:
                    done.append(name)
                    self._set(name, value)
        except BaseException as error:
            if left := self._put_back(done, before):
                raise type(error)(f"{error}; not put back: {', '.join(left)}") if isinstance(error, Error) else error
            raise

    def _put_back(self, names, before):
        """The names of those that could not be."""
        left = []
        for name in reversed(names):
            try:
                self._set(name, before[name].value)
            except Error:
                left.append(name)
        return left

    def _no_parameter(self, name):
        near = difflib.get_close_matches(name, self._names(), 1)
        return Refused(f"there is no parameter '{name}'" + (f"; is {near[0]} meant?" if near else ""))

    def read_settings(self, path):
        """Sets what the file has, but for what the line itself depends on (settings.py); `save` keeps it in the drive."""
        own = {TIMEOUT: 0} if self._watch.is_lent(self) else {}
        self.set({name: value for name, value in read_settings(path).items()
                  if name not in OF_THE_LINE and own.get(name) != value})

    def write_settings(self, path):
        """All parameters but those of the line into a file that the console understands, too, line by line."""
        every = {name: one for name, one in self.parameters().items() if name not in OF_THE_LINE}
        if self._watch.is_lent(self):
            every[TIMEOUT] = replace(every[TIMEOUT], value=0)
        written_settings(path, every)

    def save(self):
        """Keeps parameters and reactions over power-off; while off and at rest."""
        with self._watch.own(self):
            self._save()


class _Clock:
    """Time that has passed, by the drive's clock where it has one; asked once a second."""

    def __init__(self, up_s):
        self._up_s, self._from_s, self._looked_s, self._passed_s = up_s, None, time.monotonic(), 0.0

    def passed_s(self):
        now_s = time.monotonic()
        if now_s - self._looked_s >= 1.0:
            up_s = self._up_s()
            if up_s is None or self._from_s is None or up_s < self._from_s:  # it has none, or has begun anew
                self._passed_s += now_s - self._looked_s
            else:
                self._passed_s += up_s - self._from_s
            self._from_s, self._looked_s = up_s, now_s
        return self._passed_s if self._passed_s else now_s - self._looked_s


def check(value, parameter):
    """Raises Refused where the value is outside the parameter's range."""
    name, least, most, unit = parameter.name, parameter.least, parameter.most, parameter.unit
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise Refused(f"{name} is a whole number, {least}...{most}{unit and ' ' + unit}, not {value!r}")
