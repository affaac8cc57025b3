# SPDX-License-Identifier: MIT
"""The Python client at a drive with two axes, by each line; what it says and when it stops, without a drive."""
import threading
from types import SimpleNamespace

import mssfoc
import pytest
from mssfoc import Refused, Silent
from mssfoc.bus import BusDrive
from mssfoc.can import CanLine
from mssfoc.drive import Drive
from mssfoc.modbus import ModbusLine
from mssfoc.registers import Registers

from rigs.firmware import ROOT
from tools.client import register_list
from rows import param_rows

COUNT = len(param_rows(ROOT))
STATUS = ("state: operation enabled\nspeed: -12.5 rpm, reference -13 rpm\nmode: pp, position: -7\n"
          "current: d -0.5 A, q 1.2 A\nbus: 24.0 V\n")


class Port:
    """A console's: `axes` motors, what was said to it in `lines`."""

    def __init__(self, axes):
        self.axes, self.lines, self.rest, self.out, self.chosen, self.closed = axes, [], "", "", 1, False

    in_waiting = property(lambda self: len(self.out))

    def write(self, data):
        *lines, self.rest = (self.rest + data.decode()).split("\r")
        for line in filter(None, lines):
            self.lines.append(line)
            self.out += self._answer(line.split()) + ".\n"

    def _answer(self, words):
        if words[0] == "axis":
            if self.axes == 1:
                return "error: unknown command 'axis'\n"
            if len(words) == 2:
                self.chosen = int(words[1])
            words = words[2:] or ["ok"]
        return {"status": STATUS, "fault": "fault: none\n"}.get(words[0], "ok\n")

    def read(self, count):
        assert count > 0, "who asks for nothing does not wait, and takes all of the processor"
        data, self.out = self.out[:count], self.out[count:]
        return data.encode()

    def close(self):
        self.closed = True


@pytest.fixture
def console(monkeypatch):
    """A drive by the console of a device with so many axes."""
    def made(axes):
        port = Port(axes)
        monkeypatch.setattr("serial.serial_for_url", lambda *_, **__: port)
        return port, mssfoc.connect("socket://x:1", command_timeout_ms=0)
    return made


def test_each_line_names_its_axis_where_there_are_two(console):
    port, drive = console(2)
    port.lines.clear()
    second = drive.axis(2)
    drive.speed(100)
    second.speed(200)
    second.ask("get all")
    assert port.lines == ["axis 1 speed 100", "axis 2 speed 200", "axis 2 get all"]
    assert drive.axis(2) is second and second.axis(1) is drive and drive.axis(1) is drive and port.chosen == 1
    second.close()
    assert not port.closed
    drive.close()
    assert port.closed and port.lines[-1] == "machine off"


def test_status_of_the_console(console):
    _, drive = console(1)
    assert drive.status() == mssfoc.Status("operation enabled", -12.5, -13.0, -7, -0.5, 1.2, 24.0)


def test_where_there_is_one_no_line_names_it(console):
    port, drive = console(1)
    port.lines.clear()
    drive.speed(100)
    assert port.lines == ["speed 100"]
    for number, said in ((2, "this drive has no axis 2"), (3, "axes are 1 and 2, not 3"), (0, "not 0")):
        with pytest.raises(Refused, match=said):
            drive.axis(number)


def test_the_scope_goes_to_whom_it_is_for(console):
    port, drive = console(2)
    drive.axis(2).arm(["i_q"])
    assert port.chosen == 2 and port.lines[-1] == "axis 2 scope arm"
    drive.arm(["i_q"])
    assert port.chosen == 1 and port.lines[-1] == "axis 1 scope arm"


def test_a_move_ends_with_its_own_axis_line(console):
    port, drive = console(2)
    second = drive.axis(2)
    drive._command("pp", 5)  # pylint: disable=protected-access
    second._command("pp", 6)  # pylint: disable=protected-access
    port.out += "done: axis 2: in position\n"
    second.state()
    assert [one._arrived() for one in (drive, second)] == [False, True]  # pylint: disable=protected-access
    port.out += "done: axis 1: in position\n"
    drive.state()
    second._command("pp", 7)  # pylint: disable=protected-access
    assert [one._arrived() for one in (drive, second)] == [True, False]  # pylint: disable=protected-access


class Turning(Drive):
    """An axis that turns; `failing` cannot brake."""

    def __init__(self, heard, name, failing=()):
        self.heard, self.name, self.failing, self.at = heard, name, failing, "operation enabled"
        self._started = True

    def state(self):
        return self.at

    def close(self):
        self.heard.append(f"{self.name} closes")

    def _command(self, word, _=None):
        self.heard.append(f"{self.name} {word}")
        if (self.name, word) in self.failing:
            raise mssfoc.Error(word)
        self.at = "switch on disabled"

    def _make_second(self):
        return Turning(self.heard, "second", self.failing)


@pytest.mark.parametrize("failing", [(), [("first", "quickstop")], [("second", "quickstop")]])
def test_at_the_end_both_stop_and_brake_at_once(failing):
    heard = []
    drive = Turning(heard, "first", failing)
    with pytest.raises(ZeroDivisionError), drive:
        drive.axis(2).state()
        _ = 1 / 0
    assert heard[:2] == ["first quickstop", "second quickstop"]
    assert {"first off", "second off"} <= set(heard) and heard[-1] == "first closes" and "second closes" not in heard


def test_a_second_axis_of_its_own_ends_without_the_line():
    heard = []
    with Turning(heard, "first").axis(2):
        pass
    assert heard == ["second quickstop", "second off", "second closes"]


class Bus:
    """What answers by numbers: (address or index, subindex or None) asked."""

    def __init__(self, values):
        self.values, self.asked, self.serial, self.address = values, [], SimpleNamespace(), 1

    def upload(self, index, subindex):
        self.asked.append(index)
        return self.values.get(index, COUNT).to_bytes(4, "little")

    def download(self, index, subindex, data):
        self.asked.append(index)


@pytest.fixture
def sheet(tmp_path):
    path = tmp_path / "list.csv"
    path.write_text(register_list())
    return path


def can_line(bus):
    line = CanLine.__new__(CanLine)
    line._sdo, line._offset = bus, 0  # pylint: disable=protected-access
    line._network = SimpleNamespace(disconnect=lambda: bus.asked.append("disconnected"))  # pylint: disable=protected-access
    line._errors = SimpleNamespace(SdoAbortedError=KeyError, SdoCommunicationError=IOError)  # pylint: disable=protected-access
    line._can_error, line._one_at_a_time = OSError, threading.RLock()  # pylint: disable=protected-access
    line._late = threading.Event()  # pylint: disable=protected-access
    return line


def test_on_can_the_second_axis_is_0x800_further(sheet):
    bus = Bus({0x1000: 0xFFFF0192})
    drive = BusDrive(can_line(bus), sheet)
    second = drive.axis(2)
    bus.asked.clear()
    for one in (drive, second):
        one.read("velocity")
        one._set("pole_pairs", 4)  # pylint: disable=protected-access
        one.save()
    assert bus.asked == [0x606C, 0x3000, 0x1010, 0x686C, 0x3800, 0x1010]
    second.close()
    drive.close()
    assert bus.asked[-1] == "disconnected" and bus.asked.count("disconnected") == 1


def test_an_answer_that_came_too_late_is_not_the_next_ones(sheet):
    """The first request gets none in time; its answer meets the second, which is asked again."""
    bus = Bus({0x1000: 0xFFFF0192})
    drive = BusDrive(can_line(bus), sheet)
    upload, silent = bus.upload, [True, True, False, True]
    bus.upload = lambda *where: (_ for _ in ()).throw(OSError("none")) if silent.pop(0) else upload(*where)
    with pytest.raises(Silent, match="^velocity: none$"):
        drive.read("velocity")
    assert drive.read("velocity") and silent == [True]
    with pytest.raises(Silent):
        drive.read("velocity")


class Aborted(Exception):
    code = 0x06020000


def test_a_node_without_a_second_axis_says_so(sheet):
    bus = Bus({0x1000: 0x00020192})
    line = can_line(bus)
    line._errors.SdoAbortedError = Aborted  # pylint: disable=protected-access
    drive = BusDrive(line, sheet)

    def absent(index, subindex):
        if index & 0x800:
            raise Aborted
        return Bus.upload(bus, index, subindex)

    bus.upload = absent
    with pytest.raises(Refused, match="^this drive has no axis 2$"):
        drive.axis(2)
    assert "disconnected" not in bus.asked and drive.read("velocity")


class Slave:
    """minimalmodbus's Instrument, at whatever address it is asked."""

    heard = []

    def __init__(self, address):
        self.address, self.serial = address, SimpleNamespace(close=lambda: self.heard.append("closed"))

    def read_registers(self, register, count):
        self.heard.append((self.address, register))
        return {0x80: [0x0002, 0x0192], 0x91: [COUNT]}.get(register, [0] * count)


def test_on_modbus_the_second_axis_has_the_next_address(sheet):
    Slave.heard = []
    line = ModbusLine.__new__(ModbusLine)
    line._slave, line._errors = Slave(7), SimpleNamespace(  # pylint: disable=protected-access
        SlaveReportedException=KeyError, ModbusException=IOError)
    line._one_at_a_time = threading.RLock()  # pylint: disable=protected-access
    drive = BusDrive(line, sheet)
    second = drive.axis(2)
    Slave.heard.clear()
    for one in (drive, second, drive):
        one.read("velocity")
    assert Slave.heard == [(7, 0x12), (8, 0x12), (7, 0x12)]
    second.close()
    assert "closed" not in Slave.heard
    line._slave.address = 247  # pylint: disable=protected-access
    with pytest.raises(Refused, match="behind address 247"):
        line.second()


# ---- what goes over the wire ----

VALUES = [*(("I16", "target_torque", value, wire)
            for value, wire in ((-32768, b"\x80\x00"), (-1, b"\xff\xff"), (300, b"\x01\x2c"))),
          ("U16", "status_word", 0x9234, b"\x92\x34"), ("I32", "target_position", -2, b"\xff\xff\xff\xfe"),
          ("I32", "target_position", 0x12345678, b"\x12\x34\x56\x78"), ("I32", "target_position", -2**31, b"\x80\x00\x00\x00"),
          ("U32", "store", 0xFEDCBA98, b"\xfe\xdc\xba\x98")]


@pytest.mark.parametrize("kind, name, value, wire", VALUES)
def test_values_of_each_type_on_both_buses(sheet, kind, name, value, wire):
    """By Modbus the high word first, by CAN the low byte; what is stored takes longer than a frame."""
    entry, sent = Registers(sheet).objects[name], []
    assert (entry.bits, entry.signed) == (int(kind[1:]), kind[0] == "I")
    words = [int.from_bytes(wire[at:at + 2], "big") for at in range(0, len(wire), 2)]
    line = ModbusLine.__new__(ModbusLine)
    slave = SimpleNamespace(serial=SimpleNamespace(timeout=0), read_registers=lambda at, count: {
        (entry.register, len(words)): words}[at, count])
    slave.write_registers = lambda *what: sent.append((*what, slave.serial.timeout))
    line._slave, line._errors = slave, SimpleNamespace(  # pylint: disable=protected-access
        SlaveReportedException=KeyError, ModbusException=IOError)
    line._one_at_a_time = threading.RLock()  # pylint: disable=protected-access
    assert line.read(entry) == value
    line.write(entry, value)
    assert sent == [(entry.register, words, 20 if name == "store" else 1)] and slave.serial.timeout == 1
    bus = SimpleNamespace(RESPONSE_TIMEOUT=0, upload=lambda *where: {(entry.index, entry.subindex): wire[::-1]}[where])
    bus.download = lambda *what: sent.append((*what, bus.RESPONSE_TIMEOUT))
    line = can_line(bus)
    assert line.read(entry) == value and bus.RESPONSE_TIMEOUT == (20 if name == "store" else 5)
    line.write(entry, value)
    assert sent[1:] == [(entry.index, entry.subindex, wire[::-1], 20 if name == "store" else 5)]


@pytest.mark.parametrize("fails, tries", [(0, 1), (2, 3), (3, 3)])
def test_a_frame_that_was_disturbed_is_asked_for_three_times(sheet, fails, tries):
    line, asked = ModbusLine.__new__(ModbusLine), []

    def read(*where):
        asked.append(where)
        if len(asked) <= fails:
            raise OSError("noise")
        return [7]
    line._slave, line._errors = SimpleNamespace(read_registers=read), SimpleNamespace(  # pylint: disable=protected-access
        SlaveReportedException=KeyError, ModbusException=IOError)
    line._one_at_a_time = threading.RLock()  # pylint: disable=protected-access
    entry = Registers(sheet).objects["status_word"]
    if fails == 3:
        with pytest.raises(Silent, match="^status_word: noise$"):
            line.read(entry)
    else:
        assert line.read(entry) == 7
    assert len(asked) == tries
