# SPDX-License-Identifier: MIT
"""The Python client against a running drive: the page's examples, installed by pip; what is refused; the block for a PLC."""
import re
import subprocess
import sys

import mssfoc
import pytest
from launcher.paths import build_dir
from launcher.qemu import progress_s

from closed_loop import live
from closed_loop.client_venv import installed_in
from closed_loop.live import free_port, live_everything
from rigs.firmware import ROOT
from rows import param_rows

PAGE = (ROOT / "docs/client.md").read_text(encoding="utf-8")
PLC = re.search(r"```iecst\n(.*?)```", (ROOT / "docs/modbus.md").read_text(encoding="utf-8"), re.S).group(1)
COMMAND_TIMEOUT_MS = 4096 + 2 * list(param_rows(ROOT)).index("command_timeout_ms")
CANNOT_FOLLOW = {"following_mturn": 1, "profile_rpm_s": 1000000}  # a move ends in the fault, at some speed, 4 counts off
EXAMPLES = dict(re.findall(r"<!-- example: (\w+) -->\n```python\n(.*?)```", PAGE, re.S))


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    """{port in the page: port of the running drive}, and the file with its simulated time"""
    ports = {page: free_port() for page in ("5021", "5022", "29536")}
    with live_everything(tmp_path_factory.mktemp("live"), *ports.values(), "set can_node 5") as files:
        yield ports, files["progress"]


@pytest.fixture(scope="module")
def places(running):
    return running[0]


@pytest.fixture
def console(places):
    with mssfoc.connect(f"socket://127.0.0.1:{places['5021']}") as drive:
        yield drive


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A Python that has the client from its wheel."""
    return installed_in(tmp_path_factory.mktemp("wheel"))


def at(places, text):
    return re.sub("|".join(places), lambda port: str(places[port[0]]), text)


def console_is_off(places):
    with mssfoc.connect(f"socket://127.0.0.1:{places['5021']}") as drive:
        return drive.state() == "switch on disabled"


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_of_the_page(name, installed, places, tmp_path):
    python, site = installed
    said = subprocess.run([python, "-c", at(places, EXAMPLES[name])], capture_output=True, text=True, timeout=300, cwd=tmp_path,
                          env={"PYTHONPATH": str(site)}, check=False)
    assert said.returncode == 0, said.stderr
    assert console_is_off(places)
    numbers = [float(number) for number in re.findall(r"-?\d+\.?\d*", said.stdout)]
    if name == "turn":
        assert re.search(r"speed_rpm=(9[89]\d|10[01]\d)\.", said.stdout), said.stdout
    elif name == "capture":
        assert numbers[0] == pytest.approx(-0.04) and 0.1 < numbers[1] < 10.65 and 500 < numbers[2] < 1100, said.stdout
    elif name == "modbus":
        assert numbers[0] - numbers[1] == pytest.approx(40000, abs=20), said.stdout
    else:
        assert (tmp_path / "motor.txt").read_text().startswith("set pole_pairs 4\n")


def test_every_variable_of_the_image_by_its_name(places):
    """As a number, and in a capture that one of them triggers; of another image, or without one, it says so."""
    place, elf = f"socket://127.0.0.1:{places['5021']}", build_dir() / "mssfoc.elf"
    with mssfoc.connect(place, elf=elf) as drive:
        assert drive.variables().find("axes[0].state").enum[drive.watch("axes[0].state")] == "switch on disabled"
        assert drive.watch("axes[0].motion.turns.counts") == drive.status().position_counts, "eight bytes"
        assert drive.watch("axes[0].params.i_max_ma") == drive["i_max_ma"]
        drive.on()
        names = ["axes[0].speed.integral_q29", "speed", "axes[0].speed.speed_rpm_q4", "axes[0].loop.i_q_q15"]
        drive.arm(names, trigger="axes[0].speed.speed_rpm_q4 rises 300.5", before=100, every=4)
        drive.speed(600)
        step = drive.captured()
        assert list(step.values) == names and step.units["axes[0].speed.speed_rpm_q4"] == "rpm"
        assert (step["speed"] == step["axes[0].speed.speed_rpm_q4"]).all() and step["speed"][99] < 300.5 <= step["speed"][100]
        integral = step["axes[0].speed.integral_q29"]
        assert len(set(integral)) > 10 and 0 < abs(integral).max() < 4
        drive.wait(lambda: abs(drive.watch("axes[0].speed.speed_rpm_q4") - 600) < 5, "600 rpm by the variable")
        with pytest.raises(mssfoc.Refused, match="is axes.0..speed.integral_q29 meant"):
            drive.watch("axes[0].speed.integrl_q29")
        with pytest.raises(mssfoc.Refused, match="@20000000: not in the RAM"):
            drive.ask("scope values @20000000")
    with mssfoc.connect(place) as drive:
        with pytest.raises(mssfoc.Refused, match="connect.*elf="):
            drive.watch("axes[0].state")


def test_it_turns_moves_and_stops(console):
    console.on()
    console.speed(500)
    console.wait(lambda: abs(console.status().speed_rpm - 500) < 5, "500 rpm")
    with pytest.raises(mssfoc.Refused, match="while"):
        console["ramp_rpm_s"] = 1000
    console.speed(0)
    console.wait(lambda: abs(console.status().speed_rpm) < 5, "standstill")
    console.move(8000, by=True)
    begun = console.status().position_counts
    console.move(8000, by=True)
    assert console.status().position_counts - begun == pytest.approx(8000, abs=4)
    console.stop()
    assert console.state() == "switch on disabled" and console.fault() is None


def test_what_is_refused_says_what_would_work_and_changes_nothing(console, tmp_path):
    before = console.parameters()
    for values, said in (({"ramp_rpm_s": 5, "ramp_rmp_s": 1}, "there is no parameter 'ramp_rmp_s'; is ramp_rpm_s meant?"),
                         ({"ramp_rpm_s": 5, "speed_bw_hz": 1000}, "speed_bw_hz is a whole number, 1...200 Hz, not 1000"),
                         ({"ramp_rpm_s": 5.5}, "whole number"), ({"ramp_rpm_s": True}, "whole number")):
        with pytest.raises(mssfoc.Refused, match=re.escape(said)):
            console.set(values)
    file = tmp_path / "settings"
    for text, said in (("set ramp_rpm_s 5\nset x\n", "line 2: 'set x' is not"), ("# nothing\n", "sets nothing"),
                       ("set ramp_rpm_s 5\nset ramp_rpm_s 6\n", "line 2: ramp_rpm_s is set twice")):
        file.write_text(text)
        with pytest.raises(mssfoc.Refused, match=re.escape(said)):
            console.read_settings(file)
    with pytest.raises(mssfoc.Refused, match="not in operation"):
        console.speed(100)
    with pytest.raises(mssfoc.Refused, match="unknown command"):
        console.ask("turn around")
    assert console.parameters() == before
    console.write_settings(file)
    console.set({"ramp_rpm_s": 1234})
    console.read_settings(file)
    assert console.parameters() == before


def test_a_fault_ends_what_is_waited_for_with_its_record(console):
    before = {name: console[name] for name in CANNOT_FOLLOW}
    console.set(CANNOT_FOLLOW)
    console.on()
    with pytest.raises(mssfoc.Faulted, match="following error") as told:
        console.move(100000, by=True)
    assert "speed" in told.value.fault.record["bus"] and console.fault().name == "following error"
    assert max(abs(console.fault_capture()["speed"])) > 10
    console.stop()
    console.clear()
    assert console.fault() is None
    console.set(before)


def test_an_answer_that_was_not_waited_for_is_nobody_elses(console):
    """As after Ctrl-C in the midst of a question."""
    console._send(b"get all\r")  # pylint: disable=protected-access
    console._lost = True  # pylint: disable=protected-access
    assert console.state() == "switch on disabled" and console["pole_pairs"] == 4
    with pytest.raises(mssfoc.Refused, match="printable"):
        console.ask("status\n")


def test_nobody_at_the_line_is_silence():
    with pytest.raises(mssfoc.Silent, match="cannot be opened"):
        mssfoc.connect(f"socket://127.0.0.1:{free_port()}")
    with pytest.raises(mssfoc.Refused, match="can:INTERFACE:CHANNEL, with node"):
        mssfoc.connect("can:can0")


def test_the_buses_say_the_same_as_the_console(installed, places):
    """Fault, refusal and their words, by both buses; in the environment that has their libraries."""
    python, site = installed
    program = """
import mssfoc, sys
with mssfoc.connect(sys.argv[1], **eval(sys.argv[2])) as drive:
    for do in (lambda: drive.speed(100), lambda: drive.set({"speed_bw_hz": 1000}), lambda: drive.set({"x": 1}),
               lambda: drive.home("north"), lambda: drive.read("x")):
        try:
            do()
        except mssfoc.Refused as error:
            print(error)
    before = drive.parameters(["following_mturn", "profile_rpm_s", "i_max_ma"])
    drive.set({"i_max_ma": 14900})
    try:
        drive.on()
    except mssfoc.Refused as error:
        print(error)
    drive.set({"i_max_ma": before["i_max_ma"].value, **eval(sys.argv[3])})
    drive.on()
    try:
        drive.move(100000, by=True)
    except mssfoc.Faulted as error:
        print(error.fault.name, abs(error.fault.record["detail_1"]) > 4)
    drive.stop()
    drive.clear()
    print(drive.state(), drive.fault())
    drive.set({name: one.value for name, one in before.items()})
"""
    said = []
    for place, options in ((f"modbus:socket://127.0.0.1:{places['5022']}", {"parity": "N"}),
                           ("can:socketcand:can0", {"host": "127.0.0.1", "port": places["29536"], "node": 5})):
        ran = subprocess.run([python, "-c", program, place, repr(options), repr(CANNOT_FOLLOW)], capture_output=True, text=True,
                             timeout=300, env={"PYTHONPATH": str(site)}, check=False)
        assert ran.returncode == 0, ran.stdout + ran.stderr
        said.append(ran.stdout.splitlines())
    assert said[0] == said[1] == [
        "the drive is not in operation; use on()", "speed_bw_hz is a whole number, 1...200 Hz, not 1000",
        "there is no parameter 'x'", "homing is to index or block, not north", "there is no object 'x'",
        "i_max_ma must be at most 85 % of i_trip_ma, 12750 mA, to leave room for overshoot", "following error True",
        "switch on disabled None"]


def python_of(block):
    """The block's body as Python: what it uses of Structured Text, line by line."""
    lines, depth = [], 1
    for line in block.partition("END_VAR\n\n")[2].partition("END_FUNCTION_BLOCK")[0].splitlines():
        text = re.sub(r"16#(\w+)", r"0x\1", line.strip().rstrip(";"))
        text = re.sub(r"(?<![:<>])=", "==", text).replace("<>", "!=").replace(":=", "=")
        for word, meant in (("AND", "&"), ("OR", "or"), ("NOT", "not"), ("ELSIF", "elif"), ("ELSE", "else:"), ("IF", "if"),
                            ("THEN", ":")):
            text = re.sub(rf"\b{word}\b", meant, text)
        depth -= text.startswith(("el", "END_if", "END_IF"))
        lines += [] if text.startswith("END_") else ["    " * depth + text]
        depth += text.endswith(":")
    names = "Enable, Reset, Velocity, Register16"
    return (f"def block({names}):\n" + "\n".join(lines)
            + "\n    return [Register0, Register1, Register2, Register3], Operates, Faulted, Refused\n")


def test_the_block_for_a_plc_turns_the_motor(installed, running, places, tmp_path):
    """A parser of others takes it; and cycle by cycle, as a PLC does, it starts, turns, survives a fault and stops."""
    file = tmp_path / "drive.st"
    file.write_text(PLC)
    parsed = subprocess.run([installed[0].with_name("blark"), "parse", file], capture_output=True, text=True, check=False)
    assert parsed.returncode == 0 and "rror" not in parsed.stderr, parsed.stderr
    functions = {"SHR": lambda value, by: value >> by, "DINT_TO_DWORD": lambda value: value & 0xFFFFFFFF,
                 "DWORD_TO_WORD": lambda value: value & 0xFFFF}
    exec(python_of(PLC), functions)  # pylint: disable=exec-used
    sys.path.append(str(next(installed[0].parents[1].glob("lib/python*/site-packages"))))
    try:
        import minimalmodbus
        import serial
    finally:
        sys.path.pop()
    port = serial.serial_for_url(f"socket://127.0.0.1:{places['5022']}", timeout=20)
    slave = minimalmodbus.Instrument(port, 1)

    def until(condition, **inputs):
        def cycle():
            status, _, high, low, *_ = slave.read_registers(16, 8)
            given = {"Enable": False, "Reset": False, "Velocity": 0, **inputs}
            registers, *flags = functions["block"](Register16=status, **given)
            slave.write_registers(0, registers)
            rpm = ((high << 16 | low) ^ 1 << 31) - (1 << 31)
            return condition(rpm / 1000, *flags)
        live.until(cycle, f"what the block shows with {inputs}")

    until(lambda rpm, operates, *_: operates and abs(rpm + 800) < 10, Enable=True, Velocity=-800)
    until(lambda rpm, operates, *_: operates and abs(rpm - 300) < 10, Enable=True, Velocity=300)
    until(lambda rpm, operates, *_: not operates and abs(rpm) < 10, Velocity=300)
    slave.write_registers(COMMAND_TIMEOUT_MS, [0, 3000])
    until(lambda _, operates, *__: operates, Enable=True)
    over_s = progress_s(running[1]) + 4
    live.until(lambda: progress_s(running[1]) > over_s, "the PLC's cable is out for 4 s of the drive's time")
    until(lambda _, operates, faulted, refused: faulted and not refused, Enable=True)
    until(lambda _, operates, *__: operates, Enable=True, Reset=True)
    until(lambda _, operates, *__: not operates)
    slave.write_registers(COMMAND_TIMEOUT_MS, [0, 0])
    port.close()
