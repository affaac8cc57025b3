# SPDX-License-Identifier: MIT
"""Whatever is typed, listed or read while the motor turns, the bridge and the shaft know nothing of it, and the thread is never
away for long; a thread that does not come back ends in a controlled stop.

The lines are made from the table of commands itself, as 'help' prints it: what is added there is typed here.
"""
import random
import re

import numpy as np
import pytest
from launcher import probes, simulate
from rates.builds import OWN_HZ, build_of

from closed_loop.bus import load_bus
from rigs.modbus_line import PARAM_BASE, read
from rows import param_rows

FIRST, SECOND = "teknic_m2310p", "maxon_ec22"
PARAMETER_LINES = 60
LINE_CHARACTERS, CHARACTERS_S = 80, 11520
ON_S, TURN_S, TYPE_S, RPM = 0.4, 0.8, 1.3, 1000
AWAY_MS = 10  # at most: the slow loop bears 100
NEAR_RPM = 10  # the second motor's encoder has few counts
ACTS = {"off", "quickstop"}  # alone on a line they do what they say
NAMES = {"PARAM": list(param_rows()), "TOPIC": list(param_rows()), "SIGNAL": ["i_q_ref", "speed_ref", "position"],
         "FAULT": ["voltage_limit", "following_error", "thread_stopped"]}
NONSENSE = ("brake", "99999999999999999999", "--5", "1.2345", "-", "Q" * 40)
LISTS = ("help", "get all", "get --changed", "scope list", "reaction", "status", "fault", "sweep read")
TABS = ("he\t", "help \t\t", "get \t\t", "reaction \t\t", "scope trigger \t\t", "\t\t", "set current_\t\t")


@pytest.fixture(autouse=True)
def thread_in_trace(monkeypatch):
    """What the twin shall read from the image's memory with each period besides."""
    more = [(name, f"axes[0].{name}", 1.0, True) for name in ("time_ms", "thread_ms")]
    monkeypatch.setattr(probes, "WATCH", [*probes.WATCH, *more])


def run(out_dir, steps, end_s, two):
    """Both motors at the same speed, if there are two; what the steps are is done beside."""
    plan = {"key": "typing", "end_s": end_s, "preamble_s": 0.05, "expect_refusal": ".*"}
    turn = [{"t_s": ON_S, "console": "on"}, {"t_s": TURN_S, "console": f"speed {RPM}"}]
    more = {"second": {"motor": SECOND, "scenario": {**plan, "step": turn}}, "build": two} if two else {}
    steps = sorted([*turn, *steps], key=lambda step: step["t_s"])
    return simulate({**plan, "step": steps}, FIRST, out_dir=out_dir, plant="ideal", spread=0, aligned=True, **more)


def console(out_dir):
    return re.sub("[\r\x11\x13]", "", (out_dir / "console.txt").read_text(encoding="ascii", errors="replace"))


def table(out_dir, two):
    """(name, words of arguments) of each row."""
    run(out_dir, [{"t_s": 1, "console": "help"}], 1.8, two)
    said = console(out_dir)
    rows = re.findall(r"^([a-z]+)((?: [^:\n]+)?): ", said[said.index("> help\n"):], re.MULTILINE)
    assert len(rows) > 30, said
    return [(name, words.split()) for name, words in rows]


def misspelt(draw, word):
    for _ in range(draw.choice((1, 1, 2, 3))):
        at, letter = draw.randrange(len(word)), draw.choice("aeinz_")
        before, behind = word[:at], word[at + 1:]
        word = draw.choice((before + letter + word[at:], before + behind, before + letter + behind)) or "z"
    return word


def right(draw, kind):
    if kind in NAMES:
        return draw.choice(NAMES[kind])
    return re.split(r"\W", kind)[0] if kind[0].islower() else "1"


def refused(draw, name, kinds, known):
    """Each way in which a line of this row is none; `known`: all names, with whether there is a row without arguments."""
    other = misspelt(draw, name)
    while other in known:
        other = misspelt(draw, name)
    yield other + "".join(f" {right(draw, kind)}" for kind in kinds)
    yield f"{name} 1 2 3 4 5"
    yield f"{name} ".ljust(LINE_CHARACTERS, "x")
    yield f"{name} ".ljust(LINE_CHARACTERS + 20, "x")
    if not known[name]:
        yield name
    for n, kind in enumerate(kinds):
        before = "".join(f" {right(draw, each)}" for each in kinds[:n])
        after = "".join(f" {right(draw, each)}" for each in kinds[n + 1:])
        for wrong in (*NONSENSE, misspelt(draw, right(draw, kind)) + "z"):
            yield f"{name}{before} {wrong}{after}"[:LINE_CHARACTERS]


def lines_of(rows, draw):
    known = {name: any(not kinds for other, kinds in rows if other == name) for name, _ in rows}
    lines = [line for name, kinds in rows for line in refused(draw, name, kinds, known)]
    lines += [*LISTS, *(f"help {name}" for name in known), *(name for name in known if known[name] and name not in ACTS)]
    lines += [f"{draw.choice(('get', 'set', 'help'))} {misspelt(draw, draw.choice(NAMES['PARAM']))}{draw.choice(('', ' 1'))}"
              for _ in range(PARAMETER_LINES)]
    draw.shuffle(lines)
    return lines


def on_the_buses(from_s, to_s):
    """Long reads over Modbus with noise in between, and the data sheet over CAN, all along."""
    draw = random.Random(7)
    reads = [{"t_s": t_s, "event": "bus", "args": [read(PARAM_BASE + 2 * (n % 40), 125).hex()]}
             for n, t_s in enumerate(np.arange(from_s, to_s, 0.02).round(7))]
    reads += [{"t_s": round(step["t_s"] + 0.01, 7), "event": "bus", "args": [draw.randbytes(draw.randint(1, 80)).hex()]}
              for step in reads]
    asks = ["4021100000000000", *("6000000000000000", "7000000000000000") * 10000]
    segments = [{"t_s": t_s, "event": "can", "args": [f"605#{ask}"]}
                for t_s, ask in zip(np.arange(from_s, to_s, 0.005).round(7), asks)]
    opened = [{"t_s": 0.3, "console": "set can_node 5"}, {"t_s": 0.32, "console": "set modbus_baud 921600"}]
    return [*opened, *reads, *segments]


def typed(lines):
    """(steps, when the last is answered): as fast as the drive takes them."""
    t_s, steps = TYPE_S, []
    for n, line in enumerate(lines):
        steps.append({"t_s": round(t_s, 6), "console": line})
        t_s += (2 * len(line) + 60) / CHARACTERS_S
        if n % 70 == 0:
            keys = (TABS[n // 70 % len(TABS)] + "\x03").encode() + b"\x80\r"
            steps.append({"t_s": round(t_s, 6), "event": "keys", "args": [keys.hex()]})
    return steps, t_s + 1.5


def judge(result, ends_s, away_most_ms=AWAY_MS):
    trace = result.trace.between(TYPE_S, ends_s)
    away_ms = trace["time_ms"] - trace["thread_ms"]
    speed = trace["speed_rad_s"] * 30 / np.pi
    print(f"longest absence of the thread {away_ms.max():.0f} ms in {ends_s - TYPE_S:.1f} s, "
          f"shaft {speed.min():.2f} to {speed.max():.2f} rpm")
    assert not trace["fault"].any() and trace["gate_live"].all() and len(set(trace["state"])) == 1
    assert np.abs(speed - RPM).max() < NEAR_RPM
    assert away_ms.max() <= away_most_ms


@pytest.mark.parametrize("axes", (1, 2))
def test_lines_of_all_kinds_touch_neither_bridge_nor_shaft(tmp_path, axes):
    """Of two motors every second line is for the other one."""
    two = build_of(OWN_HZ, "mssfoc.elf", "mssfoc.hex", folder="two-axes", AXES=2) if axes == 2 else None
    lines = lines_of(table(tmp_path / "table", two), random.Random(42))
    if two:
        lines[1::2] = [f"axis 2 {line}" if len(line) < LINE_CHARACTERS - 6 else line for line in lines[1::2]]
    steps, ends_s = typed(lines)
    result = run(tmp_path, [*on_the_buses(TYPE_S, ends_s), *steps, {"t_s": ends_s, "console": "version"}], ends_s + 0.1, two)
    said = console(tmp_path)
    assert re.search(r"> version\nmssfoc [^\n]*\n> $", said), "all is answered: " + said[-300:]
    assert said.count("\nerror: ") > len(lines) // 2 and said.count("did you mean") > len(lines) // 20
    assert len(load_bus(tmp_path / "bus.txt").exchanges) > 100 and " tx 585 " in (tmp_path / "can.txt").read_text()
    for axis in filter(None, (result, result.second)):
        judge(axis, ends_s)


@pytest.mark.parametrize("hung_ms, stops", ((95, False), (200, True)))
def test_a_thread_that_hangs_is_borne_for_100_ms_and_then_stops_the_motor(tmp_path, hung_ms, stops):
    """Of both motors, since they have one thread; back again it says what has happened."""
    two, ends_s = build_of(OWN_HZ, "mssfoc.elf", "mssfoc.hex", folder="two-axes", AXES=2), TYPE_S + 0.4
    steps = [{"t_s": TYPE_S, "event": "poke_rom", "args": ["&idle", "0xE7FE"]},
             {"t_s": TYPE_S + hung_ms / 1000, "event": "poke_rom", "args": ["&idle", "*idle"]}]
    result = run(tmp_path, steps, ends_s + 0.1, two)
    if not stops:
        for axis in (result, result.second):
            judge(axis, ends_s, 100)
        return
    for axis in (result, result.second):
        trace = axis.trace.between(TYPE_S, ends_s)
        after_ms, speed = (trace["t_s"] - TYPE_S) * 1000, trace["speed_rad_s"] * 30 / np.pi
        off = np.flatnonzero(trace["gate_live"] == 0)[0]
        assert np.abs(speed[after_ms < 100] - RPM).max() < NEAR_RPM, "at its speed until then"
        assert np.abs(speed[off]) < 40 and 110 < after_ms[off] < 200, "braked to rest before the bridge goes off"
        assert not trace["gate_live"][off:].any()
        assert axis.enums["fault"][int(trace["fault"][-1])] == "FAULT_THREAD_STOPPED"
    assert len(re.findall(r"\nfault: axis [12]: thread stopped", console(tmp_path))) == 2


BESIDE = ("set pole_pairs 1", "get all", "load", "defaults", "save", "reaction stall warn", "help brake", "on", "off",
          "identify show", "identify use", "learn hall", "off", "load")


def test_what_is_done_to_a_motor_at_rest_leaves_the_other_alone(tmp_path):
    two = build_of(OWN_HZ, "mssfoc.elf", "mssfoc.hex", folder="two-axes", AXES=2)
    ends_s = TYPE_S + 0.15 * len(BESIDE)
    off = [{"t_s": 0.28, "console": "axis 2 save"}, {"t_s": TYPE_S - 0.3, "console": "axis 2 off"}]
    typed_beside = [{"t_s": round(TYPE_S + 0.15 * n, 3), "console": f"axis 2 {line}"} for n, line in enumerate(BESIDE)]
    judge(run(tmp_path, [*off, *typed_beside], ends_s + 0.1, two), ends_s)
    said = console(tmp_path)
    assert ", loaded\n" in said and "saving keeps the core from both motors" in said and "> axis 2 defaults\nok\n" in said
