# SPDX-License-Identifier: MIT
"""The Python client without a drive: what half done things leave, and lists of registers that are none."""
import pytest

from mssfoc import Error, Refused, Silent
from mssfoc.answers import Answers
from mssfoc.bus import BusDrive
from mssfoc.drive import Drive
from mssfoc.registers import Registers
from mssfoc.texts import Parameter, accepted, capture, parameters
from tools.client import register_list


class Stubborn(Drive):
    """A drive that refuses 13."""

    def __init__(self):
        self.values = {"a": 1, "b": 2, "c": 3}

    def parameters(self, names=None):
        return {name: Parameter(name, value, "", 0, 100) for name, value in self.values.items()}

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

    def __init__(self, value, parameters=75):
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
    with pytest.raises(Refused, match="the drive has 74 parameters and the list 75: it is of another version"):
        BusDrive(Line(0x00020192, 74), path)
    with pytest.raises(Refused, match=r"target_torque is a whole number, -32768...32767, not 40000"):
        BusDrive(Line(0x00020192), path)._write("target_torque", 40000)  # pylint: disable=protected-access
