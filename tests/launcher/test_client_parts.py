# SPDX-License-Identifier: MIT
"""The Python client without a drive: what half done things leave, and lists of registers that are none."""
import sys
import threading
from types import SimpleNamespace

import mssfoc
import pytest
from mssfoc import Error, Refused, Silent, bus
from mssfoc import drive as drive_of_all
from mssfoc.answers import Answers
from mssfoc.bus import BusDrive
from mssfoc.drive import Drive
from mssfoc.modbus import ModbusLine
from mssfoc.registers import Registers
from mssfoc.texts import Parameter, Signal, accepted, capture, parameters, signals
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
    drive._watch._thread.join(60)
    assert not drive._watch._thread.is_alive(), "and no longer than the line is open"


@pytest.mark.parametrize("own_ms, each_s", [(0, 1.0), (4000, 0.5), (80, 0.02), (16000, 1.0)])
def test_the_thread_speaks_eight_times_within_the_shorter_limit(own_ms, each_s):
    """Not more often than fifty times a second."""
    drive = Limited(own_ms).watched(Watch(8000))
    assert drive._watch._each_s == each_s
    drive.close()


def test_settings_are_read_from_lines_of_the_console(tmp_path):
    drive, path = Stubborn(), tmp_path / "settings"
    drive.values |= {"can_node": 5}
    path.write_text("# a machine\nset a 7  # rpm\n\nset can_node 9\nset c -3\n")
    with pytest.raises(Refused, match="c is a whole number, 0...60000, not -3"):
        drive.read_settings(path)
    path.write_text("set a 7\nset can_node 9\nset b 60000\n")
    drive.read_settings(path)
    assert drive.values == {"a": 7, "b": 60000, "c": 3, "can_node": 5}
    for text, said in (("set a 7\nset a 8\n", "line 2: a is set twice"), ("set a\n", "line 1: 'set a' is not of the form"),
                       ("# nothing\n", "sets nothing")):
        path.write_text(text)
        with pytest.raises(Refused, match=said):
            drive.read_settings(path)
    for value in (60001, -1, 1.0, True, "5"):
        with pytest.raises(Refused, match="a is a whole number, 0...60000"):
            drive["a"] = value


@pytest.mark.parametrize("place, options, told", [
    ("modbus:/dev/x", {"address": 7}, ("modbus", ("/dev/x",), {"address": 7})), ("/dev/x", {}, ("console", ("/dev/x",), {})),
    ("socket://h:1", {}, ("console", ("socket://h:1",), {})),
    ("can:socketcan:can0", {"node": 5, "bitrate": 1}, ("can", ("socketcan", "can0", 5), {"bitrate": 1}))])
def test_a_place_says_by_which_line(monkeypatch, place, options, told):
    found = []
    for name, kind in (("modbus", "ModbusLine"), ("can", "CanLine"), ("console", "ConsoleDrive")):
        monkeypatch.setattr(f"mssfoc.{name}.{kind}",
                            lambda *place, kind=name, **more: found.append((kind, place, more)) or Stubborn())
    monkeypatch.setattr("mssfoc.bus.BusDrive", lambda line, _: line)
    assert isinstance(mssfoc.connect(place, 0, **options), Stubborn) and found == [told]


@pytest.mark.parametrize("place, options", [("can:socketcan", {"node": 5}), ("can:socketcan:can0", {}), ("can:", {"node": 1})])
def test_on_can_a_channel_and_a_node_are_needed(place, options):
    with pytest.raises(Refused, match="can:INTERFACE:CHANNEL, with node=1...127"):
        mssfoc.connect(place, 0, **options)


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


def test_a_signals_step_is_thousandths_of_milli():
    found = signals(["i_q A 23571/32768: current across the field", "speed %_of_bus -1000/16: no speed", "ok"])
    assert found == {"i_q": Signal("A", 23.571 / 32768, "current across the field"),
                     "speed": Signal("% of bus", -1 / 16, "no speed")}
    with pytest.raises(Refused, match="has no scope"):
        signals(["ok"])


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
    for name, least, most in (("target_torque", -32768, 32767), ("control_word", 0, 65535),
                              ("target_position", -2**31, 2**31 - 1)):
        drive = BusDrive(Cia402(), path)
        for value in (least - 1, most + 1, 0.5):
            with pytest.raises(Refused, match=rf"{name} is a whole number, {least}\.\.\.{most}, not {value}"):
                drive._write(name, value)  # pylint: disable=protected-access
        drive._write(name, least), drive._write(name, most)  # pylint: disable=protected-access
        assert drive._line.heard == [(name, least), (name, most)]  # pylint: disable=protected-access


class Cia402(Line):
    """A drive of so many milliampere rated, by its words: what is written stays and is noted; it has no ramps."""
    owner = 2

    def __init__(self, word=0x1227, **values):
        super().__init__(0x00020192)
        self.values |= {"status_word": word, "rated_current": 4000, "owner": 0, "mode": 0, "mode_display": 0, **values}
        self.heard, self.rests_after = [], 0

    def read(self, entry):
        if entry.name == "status_word" and self.rests_after > 0:  # so many looks
            self.rests_after -= 1
            if self.rests_after == 0:
                self.values["status_word"] = self.then
        return super().read(entry)

    def write(self, entry, value):
        self.heard.append((entry.name, value))
        self.values[entry.name] = value
        if entry.name == "mode":
            self.values["mode_display"] = value
        if entry.name == "control_word":
            self.obey(value)

    def obey(self, word):
        before = self.values["status_word"] & 0x6F
        stops = word == 2 and before == 0x27
        self.rests_after, self.then = (3, 0x1240) if stops else (0, None)
        enabled = 0x27 if word & 15 == 15 and before in (0x23, 0x27) else 0x40
        after = {6: 0x21, 7: 0x23, 2: 0x07 if stops else 0x40}.get(word, enabled)
        self.values["status_word"] = (0x08 if before == 0x08 and word != 0x80 else after) | 0x0600 | 0x1000 * bool(word & 16)


@pytest.fixture
def driven(tmp_path, monkeypatch):
    """Makes a BusDrive that does not wait, and what it has heard."""
    for module in (drive_of_all, bus):
        monkeypatch.setattr(module, "LOOK_S", 0)
    (tmp_path / "list.csv").write_text(register_list())

    def made(*arguments, **values):
        line = Cia402(*arguments, **values)
        return BusDrive(line, tmp_path / "list.csv"), line
    return made


def words(*values):
    return [("control_word", value) for value in values]


SAVE_WORD = int.from_bytes(b"save", "little")


@pytest.mark.parametrize("does, heard", [
    (lambda d: d.speed(-100), [("target_velocity", -100), ("mode", 3)]),
    (lambda d: (d.speed(5), d.speed(7)), [("target_velocity", 5), ("mode", 3), ("target_velocity", 7)]),
    *((lambda d, ampere=ampere: d.torque(ampere), [("target_torque", thousandths), ("mode", 4)])
      for ampere, thousandths in ((4.0, 1000), (-1.0, -250), (0.01, 2))),
    (lambda d: d.move(-9), [("target_position", -9), ("mode", 1), *words(0x0F, 0x1F, 0x0F)]),
    (lambda d: d.move(9, by=True), [("target_position", 9), ("mode", 1), *words(0x0F, 0x5F, 0x4F)]),
    *((lambda d, method=method: d.home(method), [("homing_method", number), ("mode", 6), *words(0x0F, 0x1F)])
      for method, number in (("index", 34), ("block", -1))),
    (lambda d: (d.cyclic_position(5), d.cyclic_position(6)), [("target_position", 5), ("mode", 8), ("target_position", 6)]),
    (lambda d: (d.cyclic_speed(5), d.cyclic_torque(-2)), [
        ("target_velocity", 5), ("mode", 9), ("target_torque", -500), ("mode", 10)]),
    (lambda d: (d.cyclic_speed(5), d.speed(6), d.cyclic_speed(7)), [
        ("target_velocity", 5), ("mode", 9), ("target_velocity", 6), ("mode", 3), ("target_velocity", 7), ("mode", 9)]),
    (lambda d: d.off(), words(0)), (lambda d: d.stop(), words(2, 0)), (lambda d: d.take(), [("owner", 2)]),
    (lambda d: d.save(), [("store", SAVE_WORD)])])
def test_what_a_bus_hears_of_a_drive_in_operation(driven, does, heard):
    drive, line = driven()
    does(drive)
    assert line.heard == heard


@pytest.mark.parametrize("word, heard", [
    (0x40, words(6, 7, 15)), (0x21, words(6, 7, 15)), (0x23, words(6, 7, 15))])
def test_a_drive_is_switched_on_at_rest(driven, word, heard):
    drive, line = driven(word, mode=9)
    drive.on()
    assert line.heard == [("target_velocity", 0), ("mode", 3), *heard] and drive.state() == "operation enabled"
    with pytest.raises(Refused, match="on already"):
        drive.on()


@pytest.mark.parametrize("does", [lambda d: d.speed(1), lambda d: d.torque(1), lambda d: d.move(1), lambda d: d.home(),
                                  lambda d: d.cyclic_speed(1)])
def test_a_drive_that_is_off_takes_no_target(driven, does):
    drive, line = driven(0x23)
    with pytest.raises(Refused, match="not in operation"):
        does(drive)
    assert line.heard == []


@pytest.mark.parametrize("word, state", [
    (0x0000, "not ready"), (0x0250, "switch on disabled"), (0x0231, "ready to switch on"), (0x0233, "switched on"),
    (0x1237, "operation enabled"), (0x0217, "quick stop active"), (0x023F, "fault reaction active"), (0x0238, "fault")])
def test_states_of_the_status_word(driven, word, state):
    assert driven(word)[0].state() == state


def test_a_fault_is_cleared_once_a_stop_has_ended(driven):
    drive, line = driven(0x0F)
    line.rests_after, line.then = 3, 0x08
    drive.clear()
    assert line.heard == words(0, 0x80, 0) and drive.state() == "switch on disabled"


def test_what_is_refused_is_said_with_its_number_and_who_commands(driven):
    drive, line = driven(0x1327, refusal=100, refusal_value=3)
    drive._registers.refusals.update({100: "& commands", 7: "at most @ rpm"})  # pylint: disable=protected-access
    for refusal, value, said in ((100, 3, "CAN commands"), (100, 1, "the console commands"), (100, 9, "another line commands"),
                                 (7, -5, "at most -5 rpm"), (999, 0, "refusal 999")):
        line.values |= {"refusal": refusal, "refusal_value": value}
        with pytest.raises(Refused, match=f"^{said}$"):
            drive.speed(5)
    with pytest.raises(Refused, match="there is no object 'speed'"):
        drive.read("speed")
    with pytest.raises(Refused, match="homing is to index or block, not end"):
        drive.home("end")


@pytest.mark.parametrize("word, mode, arrived", [
    (0x0627, 1, True), (0x0227, 1, False), (0x1227, 1, False), (0x1627, 6, True), (0x0627, 6, False), (0x1227, 6, False)])
def test_a_move_has_arrived_and_a_homing_is_done(driven, word, mode, arrived):
    assert driven(word, mode_display=mode)[0]._arrived() == arrived  # pylint: disable=protected-access


def test_a_move_that_ends_otherwise(driven):
    drive, line = driven(0x0640)
    with pytest.raises(Error, match="ended in another state: switch on disabled"):
        drive._arrived()  # pylint: disable=protected-access
    line.values |= {"fault": 42, "fault_velocity": -1500}
    assert drive._arrived(), "wait() says which"  # pylint: disable=protected-access
    found = drive.fault()
    assert found.name == "following error" and found.record["velocity"] == -1.5 and "fault" not in found.record


def test_values_in_a_persons_units(driven):
    drive, _ = driven(0x1237, velocity=-1500, velocity_demand=1600000, position=-7, current_d=-250, current_q=1500,
                      bus_voltage=24125)
    now = drive.status()
    assert (now.state, now.speed_rpm, now.speed_ref_rpm, now.position_counts) == ("operation enabled", -1.5, 1600, -7)
    assert (now.i_d_a, now.i_q_a, now.bus_v) == pytest.approx((-0.25, 1.5, 24.125))


def test_the_line_ends_with_the_first_axis_and_the_watch_before_it(driven):
    drive, line = driven()
    ended = []
    drive._watch = SimpleNamespace(end=lambda: ended.append(line.closed))  # pylint: disable=protected-access
    drive.close()
    assert ended == [False] and line.closed


@pytest.mark.parametrize("up, passed", [
    ([10.0, 10.4, 10.8], [0.5, 1.0, 1.4, 1.8]), ([None, None, None], [0.5, 1.0, 2.0, 3.0]),
    ([10.0, 0.2, 0.9], [0.5, 1.0, 2.0, 2.7])])
def test_time_is_the_drives_where_it_has_one(monkeypatch, up, passed):
    """Asked once a second; one that began anew says nothing of the time before."""
    now, shown = [100.0], iter(up)
    monkeypatch.setattr(drive_of_all.time, "monotonic", lambda: now[0])
    clock = drive_of_all._Clock(lambda: next(shown))  # pylint: disable=protected-access
    for later_s, expected in zip((0.5, 1.0, 2.0, 3.0), passed):
        now[0] = 100.0 + later_s
        assert clock.passed_s() == pytest.approx(expected), later_s


@pytest.mark.parametrize("options, told", [({}, (19200, "E", 1)), ({"baud": 9600, "parity": "N"}, (9600, "N", 2)),
                                           ({"parity": "O", "address": 9}, (19200, "O", 1))])
def test_a_modbus_line_has_eleven_bits_a_character(monkeypatch, options, told):
    """Two stop bits where there is no parity."""
    opened = []
    monkeypatch.setitem(sys.modules, "minimalmodbus", SimpleNamespace(Instrument=lambda port, address: (port, address)))
    monkeypatch.setattr("serial.serial_for_url", lambda place, baud, parity, stopbits, timeout: opened.append(
        (place, (baud, parity, stopbits))) or "port")
    line = ModbusLine("/dev/x", **options)
    assert opened == [("/dev/x", told)]
    assert line._slave == ("port", options.get("address", 1))  # pylint: disable=protected-access
    with pytest.raises(Refused, match="parity is one of N, O, E, not M"):
        ModbusLine("/dev/x", parity="M")
