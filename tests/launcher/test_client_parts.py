# SPDX-License-Identifier: MIT
"""The Python client without a drive: what half done things leave, and lists of registers that are none."""
import pytest

from mssfoc import Error, Refused
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
    """A bus on which everything reads so."""

    def __init__(self, value):
        self.value, self.closed = value, False

    def read(self, _):
        return self.value

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
    with pytest.raises(Refused, match=r"target_torque is a whole number, -32768...32767, not 40000"):
        BusDrive(Line(0x00020192), path)._write("target_torque", 40000)  # pylint: disable=protected-access
