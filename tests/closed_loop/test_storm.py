# SPDX-License-Identifier: MIT
"""Both UARTs at once, lines and frames without a pause, noise and mutations among them, while the motor turns: the image goes
on as if it had been asked for nothing but what the right ones asked.

The lines and frames are those of the storms on the host (tests/rigs/console_lines.py, bus_frames.py); here it is the image, its
interrupts and its time that stand the test. `make storm N=20000` plays so many frames, and lines in proportion, piece by piece.
"""
import os
import random
import re

import numpy as np
import pytest
from launcher import simulate
from launcher.load import CURRENT_LOOP, load_irqlog
from launcher.paths import build_dir
from launcher.probes import Symbols

from closed_loop.bus import load_bus
from rigs.bus_frames import some_frame
from rigs.console_lines import command_of, some_line, table
from rigs.firmware import built
from rigs.modbus_line import US, crc, long, read, write, write_one
from unit.cinterface import Library

FRAMES, LINES = 1500, 300  # of a piece; frames and lines that would move the motor are left out of it
PIECES = max(1, -(-int(os.environ.get("STORM_FRAMES") or FRAMES) // FRAMES))
BAUD, CHARACTER_S, REPLY_S = 921600, 11 / 921600, 2e-3
BEGIN_S, LINE_S, CALM_S = 0.65, 9e-3, 0.3
SLOW_RPM, FAST_RPM, LAST_RPM = 800, 1200, 1000
TARGET = 2
WORDS = 0x20  # below it stand the registers of control word, mode and targets
# whatever they are given, they change nothing while the drive is on; what a long list takes would be the time of the others
HARMLESS = {None, "get", "set", "status", "version", "fault", "reaction", "clear", "load", "defaults", "on", "identify",
            "scope"}
LONG = (b"get all", b"scope list", b"reaction\r")


def moves_nothing(data):
    """Whether a right frame can only read, or write what a drive that is on refuses."""
    function, at = data[1], int.from_bytes(data[2:4], "big")
    written = int.from_bytes(data[6:8], "big") if function == 0x17 else at
    return function in (3, 4, 0x2B) or written >= WORDS


def storm_on_the_bus(draw):
    """(steps, seconds at which it ends): frames behind one another, every twentieth a new target, to this drive or to all."""
    t_s, steps = BEGIN_S, []
    for n in range(FRAMES):
        kind, data = some_frame(draw)
        if n % 20 == 0:
            kind, data = "target", write(TARGET, long(draw.randrange(SLOW_RPM, FAST_RPM)), unit=draw.choice((0, US)))
        if data and (kind != "right" or moves_nothing(data)):
            steps.append(bus(t_s, data))
            # a request is answered in peace; noise is followed at once
            t_s += (len(data) + 2) * CHARACTER_S + draw.choice((0, 1e-4, 5e-4, 3e-3) if kind == "right" else (0, 1e-4, 6e-4))
    return steps, t_s


def good_for(kind, data, rows):
    """The command that a line may be. Keys change it in ways that only the console knows: what it begins as says that."""
    if kind != "keys":
        return command_of(data, rows)
    begins = re.match(b"[a-z_]*", data)[0].decode()
    return begins if begins in dict(rows) else None


def storm_at_the_console(draw, rows):
    t_s, steps = BEGIN_S, []
    for _ in range(LINES):
        kind, data = some_line(draw, rows)
        if good_for(kind, data, rows) in HARMLESS and not (data + b"\r").startswith(LONG):
            steps.append({"t_s": round(t_s, 7), "event": "keys", "args": [(data + b"\r").hex()]})
            t_s += LINE_S
    return steps, t_s


def bus(t_s, data):
    return {"t_s": round(t_s, 7), "event": "bus", "args": [bytes(data).hex()]}


def play(tmp_path, storm, begin_s):
    """The motor is switched on and turned over the bus, with the storm from begin_s on and a last target behind it."""
    axis = Symbols(build_dir() / "mssfoc.elf")
    params, size = axis.address("axes[0].params"), axis.address("axes[0].tuning") - axis.address("axes[0].params")
    steps = [{"t_s": 0.1, "console": f"set modbus_baud {BAUD}"}, *(bus(0.12 + 0.005 * n, write_one(0, word))
                                                                    for n, word in enumerate((6, 7, 15))),
             bus(0.4, write(TARGET, long(LAST_RPM))), *storm, *(bus(begin_s + 0.06 + 0.02 * n, data) for n, data in enumerate(
                 (write(TARGET, long(LAST_RPM)), read(0x10, 8)))), {"t_s": begin_s + 0.02, "event": "keys", "args": ["030d"]},
             {"t_s": begin_s + CALM_S - 0.05, "console": "status"}]
    result = simulate({"key": "storm", "end_s": begin_s + CALM_S, "preamble_s": 0.05, "expect_refusal": ".*",
                       "step": sorted(steps, key=lambda step: step["t_s"])}, out_dir=tmp_path, aligned=True,
                      dumps={"params": (params, size)})
    return result, load_bus(result.out_dir / "bus.txt"), (result.out_dir / "params").read_bytes()


@pytest.fixture(scope="module", params=range(1, PIECES + 1))
def stormed(tmp_path_factory, request):
    draw, rows = random.Random(request.param), table(Library(built("firmware.so")))
    on_bus, bus_s = storm_on_the_bus(draw)
    at_console, console_s = storm_at_the_console(draw, rows)
    storm = [*on_bus, *at_console]
    return (*play(tmp_path_factory.mktemp("storm"), storm, max(bus_s, console_s)), len(on_bus), len(at_console))


@pytest.fixture(scope="module")
def calm(tmp_path_factory):
    return play(tmp_path_factory.mktemp("calm"), [], BEGIN_S)


def test_it_lives_and_does_what_it_was_asked_last(stormed):
    result, line, _, frames, lines = stormed
    print(f"{frames} frames and {lines} lines in {result.trace['t_s'][-1] - BEGIN_S - CALM_S:.1f} s; "
          f"{len(line.exchanges)} answered, {result.console.count('error: ')} lines refused")
    assert result.console.count("'help' lists the commands") == 1, "one life"
    assert "state: operation enabled" in result.console[-600:] and "see 'fault', then 'clear'" not in result.console
    status, error = (int.from_bytes(line.exchanges[-1].reply[at:at + 2], "big") for at in (3, 17))
    assert status & 0x6F == 0x27 and error == 0
    speed = result.trace.between(result.trace["t_s"][-1] - 0.05, result.trace["t_s"][-1])["speed_rad_s"] * 30 / np.pi
    assert np.abs(speed - LAST_RPM).max() < 20


def test_nothing_but_a_right_request_does_anything(stormed, calm):
    result, _, params, *_ = stormed
    assert params == calm[2], "no parameter has changed"
    while_on = result.trace.between(BEGIN_S, result.trace["t_s"][-1])
    assert set(while_on["fault"]) == {0} and len(set(while_on["state"])) == 1
    speed = while_on["speed_rad_s"] * 30 / np.pi
    assert SLOW_RPM - 50 < speed.min() and speed.max() < FAST_RPM + 50
    assert np.ptp(speed) > 100, "targets have been followed"


def test_what_is_answered_is_answered_in_time(stormed):
    _, line, _, frames, _ = stormed
    assert len(line.exchanges) > frames / 20
    assert all(crc(e.reply[:-2]) == e.reply[-2:] and e.reply[0] == US for e in line.exchanges)
    first = max(e.on_s - e.asked_s for e in line.exchanges)
    short = max(e.answered_s - e.asked_s for e in line.exchanges if len(e.reply) <= 64)
    print(f"first bit at most {first * 1e3:.2f} ms behind the request, last bit of up to 64 bytes {short * 1e3:.2f}")
    assert first <= REPLY_S / 2 and short <= REPLY_S, "the thread keeps up with the line, whatever comes"


def test_no_interrupt_is_late(stormed, calm):
    busy, quiet = (current_loop(run[0], BEGIN_S) for run in (stormed, calm))
    assert busy["cycles"].max() <= quiet["cycles"].max()
    late_ns = busy["start_pwm_ns"].max() - quiet["start_pwm_ns"].max()
    print(f"the current loop begins at most {late_ns:.0f} ns later than in calm")
    assert late_ns <= 250, "an instruction's time, and no more: nothing masks it"
    assert np.diff(busy["t_s"]).max() < 1.01 * np.median(np.diff(quiet["t_s"])), "none is left out"


def current_loop(result, from_s):
    log = load_irqlog(result.irqlog)
    ours = (log["exception"] == CURRENT_LOOP) & (log["t_s"] > from_s)
    return {name: column[ours] for name, column in log.items()}
