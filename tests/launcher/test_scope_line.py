# SPDX-License-Identifier: MIT
"""A board at a serial line, played by a thread at a pseudo terminal: its cable is pulled and comes back, answers come late."""
import asyncio
import os
import threading
import time
import tty
from types import SimpleNamespace
from unittest.mock import patch

import pytest

pytest.importorskip("serial")

from launcher import LauncherError  # noqa: E402  (skipped without pyserial)
from scope import drive, session  # noqa: E402
from scope.board import Board  # noqa: E402
from scope.jog import HELD_S, Jog  # noqa: E402
from scope.session import Session  # noqa: E402

PATIENCE_S = 60
SHOWN_S = 1.0   # at the latest a page shows that a drive is silent
PAGE_S = 0.05   # of it for the way to the page
ANSWERS = {"": "", "machine on": "ok\r\n", "scope list": "i_q A 1/1: q current\r\n", "stream 1 921600": "ok\r\n",
           "scope": "signals: i_q, every 1\r\ncapture: off\r\n", "status": "state: operation enabled\r\nfault: none\r\n",
           "machine off": "ok\r\n", "speed 5": "ok\r\n", "quickstop": "ok\r\n", "off": "ok\r\n",
           "get a": "a = 1\r\n", "get b": "b = 2\r\n"}

UNKNOWN = "error: unknown\r\n"


class Played:
    """A drive at the far end of `path`. `deaf`: lines are kept, and answered when it hears again."""

    def __init__(self, path):
        self.path, self.heard = path, []
        self.deaf = threading.Event()
        self.plug()

    def plug(self):
        self.master, slave = os.openpty()
        tty.setraw(slave)
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(os.ttyname(slave))
        self.thread = threading.Thread(target=self._answer, args=(self.master,), daemon=True)
        self.thread.start()
        self.slave = slave

    def pull(self):
        os.close(self.slave)
        os.close(self.master)
        self.path.unlink()

    def _answer(self, master):
        rest = b""
        while True:
            try:
                rest += os.read(master, 4096)
                while self.deaf.is_set():
                    threading.Event().wait(0.01)
                *lines, rest = rest.split(b"\r")
                for line in lines:
                    self.heard.append(line.decode())
                    prompt = "> " if line == b"machine off" else ""
                    os.write(master, f"{ANSWERS.get(line.decode(), UNKNOWN)}.\r\n{prompt}".encode())
            except OSError:
                return


@pytest.fixture(autouse=True)
def patience(request, monkeypatch):
    """The drive played here sends no samples: on a busy machine its answers alone would come too seldom."""
    if "clock" not in request.fixturenames:
        monkeypatch.setattr("scope.drive.SILENT_S", 2.0)


@pytest.fixture
def clock(monkeypatch):
    """Of drive.py and jog.py, in a list."""
    now = [100.0]
    for module in ("drive", "jog"):
        monkeypatch.setattr(f"scope.{module}.time", SimpleNamespace(monotonic=lambda: now[0]))
    return now


async def until(holds):
    async with asyncio.timeout(PATIENCE_S):
        while not holds():
            await asyncio.sleep(0.02)


def play(tmp_path, scene):
    """scene(drive, session, messages) with a session that is open and a page that keeps what it is sent."""
    played = Played(tmp_path / "port")

    async def run():
        held, messages = Session(Board(str(tmp_path / "port"))), []
        await held.open()
        held.join("page", messages.append)
        await until(lambda: "status" in kinds(messages))
        try:
            await scene(played, held, messages)
        finally:
            played.deaf.clear()
            await held.close()

    asyncio.run(run())


def at_the_board(scene):
    """A test that plays it and nothing else."""
    return lambda tmp_path: play(tmp_path, scene)


def kinds(messages):
    return [message["kind"] for message in messages]


def answers(messages):
    return {message["line"]: message["lines"] for message in messages if message["kind"] == "answer"}


def test_a_cable_that_is_pulled_and_comes_back(tmp_path, capsys):
    async def scene(drive, session, messages):
        drive.pull()
        await until(lambda: "silent" in kinds(messages))
        why = next(message for message in messages if message["kind"] == "silent")["why"]
        assert "the line is broken" in why or "the line has ended" in why
        await session.take("page", {"kind": "line", "line": "get a"})
        assert answers(messages)["get a"][0].startswith("error: the drive is silent: ")
        drive.plug()
        await until(lambda: "awake" in kinds(messages))
        await session.take("page", {"kind": "line", "line": "get b"})
        assert answers(messages)["get b"] == ["b = 2"]

    play(tmp_path, scene)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2 and lines[0].startswith("mssfoc: the drive is silent since ") and lines[1].endswith("answers again")


def test_a_silent_drive_is_shown_within_a_second(clock):
    """QEMU that has ended at once; one that is stopped, or a cable, so early that there is time for a look and the way."""
    far = SimpleNamespace(ended=lambda: None, at_work=lambda: False)
    silent = drive.Drive(far, None, None).silent
    clock[0] += SHOWN_S - session.LOOK_S - PAGE_S
    assert silent() == "no answer for 1 s"
    far.at_work = lambda: True
    assert not silent(), "slow is not silent"
    clock[0] += drive.AT_WORK_S
    assert silent(), "but it may hang"
    far.ended = lambda: "gone"
    assert drive.Drive(far, None, None).silent() == "gone"


def test_a_button_counts_as_released_when_nobody_says_that_it_is_held(clock):
    asked = []

    async def ask(line):
        asked.append(line)
        return ["ok"]

    async def scene():
        jog = Jog(ask)
        for _ in range(10):
            await jog.hold(60)
            clock[0] += HELD_S - 0.01
            await jog.mind()
        assert asked == ["speed 60"], "held, and asked once"
        clock[0] += 0.02
        await jog.mind(), await jog.mind()
        assert asked == ["speed 60", "speed 0"], "the page has gone: stopped, once"
        await jog.hold(-60), await jog.hold(0)
        clock[0] += 2 * HELD_S
        await jog.mind()
        assert asked[2:] == ["speed -60", "speed 0"], "released"

    asyncio.run(scene())


@at_the_board
async def test_an_answer_that_comes_late_is_nobodys(drive, session, messages):
    drive.deaf.set()
    await session.take("page", {"kind": "line", "line": "get a"})
    assert "no answer for" in answers(messages)["get a"][0]
    await until(lambda: "silent" in kinds(messages))
    drive.deaf.clear()
    await until(lambda: "awake" in kinds(messages))
    for _ in range(5):
        await session.take("page", {"kind": "line", "line": "get b"})
        assert answers(messages)["get b"] == ["b = 2"]


@pytest.mark.parametrize("unasked", ("done: in position", "fault: stall; see 'fault', then 'clear'"))
@pytest.mark.parametrize("pieces", (
    ("a = 1\r\n.\r\ndone: in position\r\n",), ("a = 1\r\n.\r\ndone: in", " position\r\n"),
    ("done: in position\r\na = 1\r\n.\r\n",), ("a = 1\r\n", "done: in position\r\n.\r", "\n"),
    ("a = 1\r\n.\r\n", "done: in position\r\n")))
def test_what_the_drive_says_by_itself_is_no_part_of_an_answer_however_the_line_is_cut(pieces, unasked):
    """In one piece with an answer's end is what a command that ends just then says."""
    async def scene():
        said, came = [], asyncio.Queue()

        async def write(data):
            for piece in pieces if data == b"get a\r" else ("b = 2\r\n.\r\n",):
                await came.put(piece.replace("done: in", unasked[:8]).replace(" position", unasked[8:]).encode())

        async def close():
            pass

        held = drive.Drive(SimpleNamespace(ended=lambda: None, at_work=lambda: True, read=came.get, write=write, close=close),
                           None, said.append)
        held.start()
        await came.put(b"warning: w")
        try:
            await until(came.empty)
            await came.put(b"arm\r\n")  # behind the question
            assert await held.ask("get a") == ["a = 1"]
            assert await held.ask("get b") == ["b = 2"]
            assert said == ["warning: warm", unasked]
        finally:
            await held.close()

    asyncio.run(scene())


@at_the_board
async def test_a_stop_is_sent_to_a_drive_that_does_not_answer(drive, session, messages):
    drive.deaf.set()
    await until(lambda: "silent" in kinds(messages))
    await session.take("page", {"kind": "stop"})
    assert answers(messages)["quickstop"] == ["sent; the drive does not answer"]
    drive.deaf.clear()
    await until(lambda: "quickstop" in drive.heard)


@at_the_board
async def test_what_is_another_lines_is_not_stopped_when_the_page_is_closed(drive, session, messages):
    """What it refused was never begun here; what it has taken over since is no more."""
    for asked in ({"kind": "line", "line": "on"}, {"kind": "jog", "rpm": 7}):
        await session.take("page", asked)
        session.leave("page")
        await session._mind_pages()
        assert "quickstop" not in drive.heard and "off" not in drive.heard
    for commander, stopped in (("CAN", False), ("the console", True)):
        await session.take("page", {"kind": "line", "line": "speed 5"})
        with patch.dict(ANSWERS, status=f"state: switched on\r\nfault: none\r\ncommanded by: {commander}\r\n"):
            await session._mind_pages()
        assert ("quickstop" in drive.heard and "off" in drive.heard) == stopped


@at_the_board
async def test_a_fault_is_told_with_its_words_and_its_time_to_a_page_that_comes_later(drive, session, messages):
    """By the drive's own clock: it was there a minute before this session saw it."""
    words = ["fault: stall", "look at: the shaft", "at: 40.000 s, state operation enabled"]
    before, first, later = int(time.time()), [], []
    with patch.dict(ANSWERS, status="state: fault\r\nfault: stall\r\nup: 100.000 s\r\n", fault="\r\n".join([*words, ""])):
        session.join("first", first.append)
        await until(lambda: any(message.get("fault") == "stall" for message in first))
        seen = int(time.time())
        session.join("later", later.append)
        await until(lambda: "status" in kinds(later))
    told = [next(one for one in heard if one.get("fault") == "stall") for heard in (first, later)]
    assert told[0]["hint"] == told[1]["hint"] == words and told[0]["since"] == told[1]["since"]
    assert told[1]["since"] in [time.strftime("%H:%M:%S", time.localtime(at - 60)) for at in range(before - 1, seen + 2)]


@at_the_board
async def test_the_last_that_a_page_sent_before_it_was_closed_is_done(drive, session, messages):
    session.leave("page")
    await session.take("page", {"kind": "stop"})
    assert "quickstop" in drive.heard


def test_the_end_waits_for_an_answer_that_is_due_and_takes_it_for_no_others(tmp_path, monkeypatch):
    monkeypatch.setattr("scope.session.STOP_S", 0.1)
    got = []

    async def scene(drive, session, messages):
        ask = session.drive.ask

        async def recorded(line):
            got.append([line, None])
            mine = got[-1]
            mine[1] = await ask(line)
            return mine[1]

        session.drive.ask = recorded
        drive.deaf.set()
        await until(lambda: got and got[-1][1] is None)  # the session asks for the state again and again
        session.started = True
        asyncio.get_running_loop().call_later(0.3, drive.deaf.clear)
        async with asyncio.timeout(PATIENCE_S):
            await session.close()
        session.drive.ask = ask

    play(tmp_path, scene)
    assert [line for line, _ in got if line in ("quickstop", "off")] == ["quickstop", "off"]
    for line, answer in got:
        assert answer == ANSWERS.get(line, UNKNOWN).split("\r\n")[:-1], line


def test_a_port_that_is_none(tmp_path):
    with pytest.raises(LauncherError, match=r"PORT=.*none cannot be opened"):
        asyncio.run(Session(Board(str(tmp_path / "none"))).open())
