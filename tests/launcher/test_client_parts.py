# SPDX-License-Identifier: MIT
"""The Python client without a drive: what half done things leave, and lists of registers that are none."""
import threading

import pytest
from mssfoc import Error, Refused, Silent
from mssfoc.answers import Answers
from mssfoc.bus import BusDrive
from mssfoc.drive import Drive
from mssfoc.registers import Registers
from mssfoc.texts import Parameter, accepted, capture, parameters
from mssfoc.watch import Watch
from mssfoc.watch import NAME as TIMEOUT

from rigs.firmware import ROOT
from tools.client import register_list
from rows import param_rows

COUNT = len(param_rows(ROOT))


class Stubborn(Drive):
    """A drive that refuses 13."""

    def __init__(self):
        self.values = {"a": 1, "b": 2, "c": 3}

    def parameters(self, names=None):
        return {name: Parameter(name, value, "", 0, 60000) for name, value in self.values.items()}

    def _set(self, name, value):
        if value == 13:
            raise Refused("13")
        self.values[name] = value


def test_parameters_are_set_all_or_none():
    drive = Stubborn()
    drive.set({"a": 5, "c": 6})
    with pytest.raises(Refused, match="13"):
        drive.set({"a": 7, "b": 8, "c": 13})
    assert drive.values == {"a": 5, "b": 2, "c": 6}


class Silenced(Stubborn):
    """The line falls silent at a value of 13, and for the next so many values."""

    def _set(self, name, value):
        if value == 13 or self.quiet > 0:
            self.quiet = 1 if value == 13 else self.quiet - 1
            raise Silent("nobody")
        self.values[name] = value


def test_what_cannot_be_put_back_is_named():
    drive = Silenced()
    drive.quiet = 0
    with pytest.raises(Silent, match="^nobody; not put back: c$"):
        drive.set({"a": 7, "b": 8, "c": 13})
    assert drive.values == {"a": 1, "b": 2, "c": 3}


class Limited(Stubborn):
    """A drive with a limit of its own for its master's silence; `on`: it takes no parameters."""

    def __init__(self, own_ms):
        self.values, self.on_, self.kept, self.fed = {TIMEOUT: own_ms, "a": 1}, False, None, threading.Event()

    def _set(self, name, value):
        if self.on_:
            raise Refused("while off")
        self.values[name] = value

    def _save(self):
        self.kept = dict(self.values)

    def _feed(self):
        self.fed.set()

    def close(self):
        self._watch.end()


@pytest.mark.parametrize("own_ms, asked_ms, then_ms", [(0, 5000, 5000), (0, 0, 0), (300, 5000, 300)])
def test_a_drive_without_a_limit_is_lent_one(own_ms, asked_ms, then_ms, tmp_path):
    drive = Limited(own_ms).watched(Watch(asked_ms))
    assert drive.values[TIMEOUT] == then_ms
    drive.save()
    drive.write_settings(tmp_path / "settings")
    assert drive.kept[TIMEOUT] == own_ms and f"set {TIMEOUT} {own_ms}\n" in (tmp_path / "settings").read_text()
    drive.read_settings(tmp_path / "settings")
    assert drive.values[TIMEOUT] == then_ms, "what is kept is the drive's own, and what holds is lent"
    drive.close()
    assert drive.values[TIMEOUT] == own_ms
    with pytest.raises(Refused, match="1000...60000 ms, not 50"):
        Watch(50)


def test_what_the_program_sets_itself_stays():
    drive = Limited(0).watched(Watch(5000))
    drive[TIMEOUT] = 0
    drive._watch.lend(drive)
    drive.close()
    assert drive.values[TIMEOUT] == 0
    drive = Limited(0).watched(Watch(5000))
    drive[TIMEOUT] = 700
    drive.save()
    drive.close()
    assert drive.values[TIMEOUT] == drive.kept[TIMEOUT] == 700


def test_a_drive_that_is_on_is_lent_it_when_it_is_switched_on_again():
    drive = Limited(0)
    drive.on_ = True
    drive.watched(Watch(5000))
    assert drive.values[TIMEOUT] == 0
    drive.on_ = False
    drive._watch.lend(drive)
    assert drive.values[TIMEOUT] == 5000
    drive.values[TIMEOUT] = 0  # as by `load`
    drive._watch.lend(drive)
    assert drive.values[TIMEOUT] == 5000
    drive.on_ = True
    drive.close()
    assert drive.values[TIMEOUT] == 5000, "left turning, it is watched"


def test_who_lives_is_heard():
    drive = Limited(1000).watched(Watch(1000))
    assert drive.fed.wait(60), "the thread speaks where the program does not"
    drive.close()


class Turning(Drive):
    """A drive that turns, at a line that fails at some words, each time or once."""

    def __init__(self, *fails, state="operation enabled"):
        self.fails, self.at, self.heard, self._started, self.closed = list(fails), state, [], True, False

    def state(self):
        return self.at

    def close(self):
        self.closed = True

    def _command(self, word, _=None):
        self.heard.append(word)
        if word in self.fails:
            self.fails.remove(word)
            raise Silent(word)
        self.at = "switch on disabled"


@pytest.mark.parametrize("fails, heard", [((), ["quickstop", "off"]), (("quickstop",), ["quickstop", "off"]),
                                          (("off", "off"), ["quickstop", "off", "off", "off"])])
def test_off_is_sent_whatever_fails_before(fails, heard):
    drive = Turning(*fails)
    with pytest.raises(ZeroDivisionError), drive:
        _ = 1 / 0
    assert drive.heard == heard and drive.closed


class Refusing(Turning):
    """A drive that another line commands, or takes over."""

    def __init__(self, commander, *fails):
        super().__init__(*fails, state="switched on")
        self.commander, self._started, self._watch = commander, False, Watch(0)
        self._line_name = "here"

    def _command(self, word, _=None):
        self.heard.append(word)
        if word in self.fails:
            raise Refused("CAN commands the drive")

    def fault(self):
        return None

    def _commander(self):
        return self.commander


def test_what_was_refused_is_not_ended_here():
    drive = Refusing("CAN", "on")
    with pytest.raises(Refused), drive:
        drive.on()
    assert drive.heard == ["on"] and drive.closed


@pytest.mark.parametrize("commander, heard", [("CAN", ["take"]), ("here", ["take", "off"]), (None, ["take", "off"])])
def test_what_another_line_has_taken_over_is_not_ended_here(commander, heard):
    drive = Refusing(commander)
    with drive:
        drive.take()
    assert drive.heard == heard and drive.closed


def test_a_stop_that_a_fault_began_goes_on():
    drive = Turning(state="quick stop active")
    drive.fault = lambda: None
    with pytest.raises(Error, match="does not come to rest"):
        drive.stop(patience_s=0.1)
    assert drive.heard == ["off"], "after it has had its time, and no sooner"


def test_a_wait_ends_with_what_was_not_reached():
    drive = Stubborn()
    drive.fault = lambda: None
    with pytest.raises(Error, match="no such thing, after 0 s"):
        drive.wait(lambda: False, "no such thing", 0)


def test_what_comes_unasked_is_no_part_of_an_answer():
    answers = Answers()
    assert answers.take(b"done: in pos") == []
    answers.expect()
    assert answers.take(b"ition\r\nok\r\nfault: encoder; see 'fault', then 'clear'\r\n") == [
        "done: in position", "fault: encoder; see 'fault', then 'clear'"]
    assert not answers.ended and answers.take(b".\r\nwarning: heat\r\n") == ["warning: heat"]
    assert answers.ended and answers.lines == ["ok"]


@pytest.mark.parametrize("answer", [["error: no capture is done; 'scope' says how far it is"], ["samples: 1"]])
def test_an_answer_without_a_capture_is_refused(answer):
    with pytest.raises(Refused):
        capture(accepted(answer))
    assert parameters(["ok", "a = 1 mA  (0...5)", "b = -1  (-2...5)"]) == {
        "a": Parameter("a", 1, "mA", 0, 5), "b": Parameter("b", -1, "", -2, 5)}


class Line:
    """A bus at which somebody has this device type, and so many parameters."""

    def __init__(self, value, parameters=COUNT):
        self.values, self.closed = {"device_type": value, "parameter_count": parameters}, False

    def read(self, entry):
        return self.values.get(entry.name, 0)

    def close(self):
        self.closed = True


def test_what_is_no_list_or_no_drive_is_refused_and_the_line_closed(tmp_path):
    path = tmp_path / "list.csv"
    for text, said in ((None, "is not there: a bus needs the list"), ("a,b\n1,2\n", "is no list of registers"),
                       (register_list().replace(",0x6040,", ",none,"), "is no list of registers")):
        line = Line(0)
        if text:
            path.write_text(text)
        with pytest.raises(Refused, match=said):
            BusDrive(line, path)
        assert line.closed
    path.write_text(register_list())
    with pytest.raises(Refused, match="no servo drive"):
        BusDrive(Line(0), path)
    assert Registers(path).faults[42] == "following error"
    with pytest.raises(Refused, match=f"the drive has {COUNT - 1} parameters and the list {COUNT}: it is of another"):
        BusDrive(Line(0x00020192, COUNT - 1), path)
    with pytest.raises(Refused, match=r"target_torque is a whole number, -32768...32767, not 40000"):
        BusDrive(Line(0x00020192), path)._write("target_torque", 40000)  # pylint: disable=protected-access


class Turned(Line):
    """A drive in operation, of so many milliampere rated; what is written stays."""

    def __init__(self):
        super().__init__(0x00020192)
        self.values |= {"status_word": 0x1227, "rated_current": 4000, "owner": 0}

    def write(self, entry, value):
        self.values[entry.name] = value


def test_torques_on_a_bus_are_thousandths_of_the_rated_current(tmp_path):
    (tmp_path / "list.csv").write_text(register_list())
    drive = BusDrive(Turned(), tmp_path / "list.csv")
    for ampere, thousandths in ((4.0, 1000), (-1.0, -250), (0.01, 2)):
        drive.torque(ampere)
        assert drive._line.values["target_torque"] == thousandths  # pylint: disable=protected-access
