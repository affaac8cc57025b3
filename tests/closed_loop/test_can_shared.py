# SPDX-License-Identifier: MIT
"""Twins on one CAN bus, as `make console CAN=tcp:PORT` and `CAN=join:PORT` start them; one of them ends, others go on."""
import contextlib
import os
import re
import socket
import subprocess
import sys
import threading
import time
import tty

import pytest
from launcher.can_bus import can_chardev
from launcher.paths import REPO, build_dir
from eds import eds

from closed_loop.client_venv import environment
from closed_loop.live import PATIENCE_S, free_port, live_can, until

CLIENT = REPO / "tests/closed_loop/canopen_two.py"
TYPED = """title = "a node"
end_s = 1
preamble_s = 0.05
step = [{{t_s = 0.3, console = "set can_heartbeat_ms 100"}}, {{t_s = 0.35, console = "set can_node {}"}}]
"""


@pytest.fixture
def folder(tmp_path):
    """A build folder whose console/ is no other test's."""
    for name in ("mssfoc.hex", "mssfoc.elf", "qemu"):
        (tmp_path / name).symlink_to(build_dir().resolve() / name)
    return tmp_path


@contextlib.contextmanager
def consoles(folder):
    """start(node, CAN) and a process that ends when the test does."""
    started = []

    def start(node, can):
        plan = folder / f"node{node}.toml"
        plan.write_text(TYPED.format(node), encoding="utf-8")
        with open(folder / f"node{node}.txt", "ab") as said:
            line = [sys.executable, REPO / "qemu/run.py", "console", "--build", folder, "--scenario", plan, "--can", can,
                    "--console", f"tcp:{free_port()}"]
            started.append(subprocess.Popen(line, stdin=subprocess.DEVNULL, stdout=said, stderr=said, cwd=REPO))
        return started[-1]
    try:
        yield start
    finally:
        for process in started:
            process.kill()
            process.wait()


def listening(port):
    with socket.socket() as one:
        return one.connect_ex(("127.0.0.1", port)) == 0


@pytest.mark.parametrize("gone", (5, 6))
def test_canopen_moves_two_drives_and_one_of_them_ends(gone, folder):
    """The one that has opened the bus, and the one that has joined it: killed with its launcher, and back later."""
    programs = environment()
    if programs is None:
        pytest.skip("canopen cannot be had from PyPI: no network?")
    sheet, port = folder / "mssfoc.eds", free_port()
    sheet.write_text(eds(), encoding="utf-8")
    with consoles(folder) as start:
        twins = {5: start(5, f"tcp:{port}")}
        until(lambda: listening(port), "the bus is there")
        twins[6] = start(6, f"join:{port}")
        with subprocess.Popen([programs / "python", CLIENT, str(port), sheet, str(gone)], stdin=subprocess.PIPE,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as client:
            for told, then in (("moving", twins[gone].kill), ("alone", lambda: start(gone, f"join:{port}"))):
                assert client.stdout.readline().strip() == told, client.stderr.read()[-2000:]
                then()
                print("go on", file=client.stdin, flush=True)
            assert client.stdout.read().strip() == "done", client.stderr.read()[-2000:]
    until(lambda: not listening(port), "the bus ends with its last twin")


def read(terminal):
    with contextlib.suppress(BlockingIOError):
        return os.read(terminal, 4096)
    return b""


def test_one_program_has_the_bus_at_a_terminal(folder):
    """By slcan: what it sends acts, and it is told the drive's frames."""
    with consoles(folder) as start:
        start(5, "pty")
        said = folder / "node5.txt"
        until(lambda: "(label can)" in said.read_text(), "QEMU names a terminal")
        terminal = os.open(re.search(r"redirected to (\S+) \(label can\)", said.read_text()).group(1), os.O_RDWR | os.O_NOCTTY)
        tty.setraw(terminal)
        os.write(terminal, b"C\rS6\rO\r")
        os.set_blocking(terminal, False)
        until(lambda: b"t70517F" in read(terminal), "its heartbeat, pre-operational")
        os.write(terminal, b"t00020105\r")
        until(lambda: b"t705105" in read(terminal), "operational")
        os.close(terminal)


class Program:
    """A program at socketcand's port, without python-can."""

    def __init__(self, port):
        self._socket, self._rest = socket.create_connection(("127.0.0.1", port), PATIENCE_S), ""
        for asked, answer in (("", "< hi >"), ("< open can0 >", "< ok >"), ("< rawmode >", "< ok >")):
            self._socket.sendall(asked.encode())
            assert self._socket.recv(256).decode() == answer

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._socket.close()

    def send(self, text):
        self._socket.sendall(f"< send {text} >".encode())

    def hears(self, identifier):
        """How many frames of that identifier are among what has come since the last call."""
        self._socket.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while more := self._socket.recv(65536):
                self._rest += more.decode()
        *whole, self._rest = self._rest.split(">")
        return sum(frame.split()[2:3] == [identifier] for frame in whole)


def test_drives_of_different_rates_destroy_each_other_s_frames_and_say_so(tmp_path):
    """Until one of them is off the bus, as on a real one."""
    slow = ("set can_kbit 250", "set can_heartbeat_ms 20", "set can_node 6")
    with live_can(tmp_path / "a", "set can_heartbeat_ms 20", "set can_node 5") as (port, first), Program(port) as program:
        until(lambda: program.hears("705"), "the first drive's heartbeat")
        with live_can(tmp_path / "b", *slow, join=port) as (_, second):
            logs = [(tmp_path / name / "qemu.log") for name in "ab"]
            until(lambda: all("another can_kbit" in log.read_text() for log in logs), "both say so")
            told = lambda: "".join(files["can_log"].read_text() for files in (first, second))  # noqa: E731
            for what in (" off\n", " broken ", " noise\n"):  # the other one hears of it as soon as it comes to that
                until(lambda what=what: what in told(), f"one of them says{what}")
            assert len(re.findall("another can_kbit", logs[0].read_text())) == 1, "said once"


def test_a_flood_comes_through_whole_at_two_twins_and_two_programs(tmp_path):
    """More than the twins have room for, so that it goes at the pace of the slower one."""
    count = 8000
    with live_can(tmp_path / "a", "set can_node 5") as (port, first), Program(port) as sender, Program(port) as hearer:
        with live_can(tmp_path / "b", "set can_node 6", join=port) as (_, second):
            for n in range(count):
                sender.send(f"7ff 4 {n & 255:x} {n >> 8:x} 0 0")
            for files in (first, second):
                until(lambda files=files: files["can_log"].read_text().count("rx 7ff") == count, "every frame at each twin")
            assert hearer.hears("7FF") == count
        sender.send("7fe 0 ")
        until(lambda: "rx 7fe" in first["can_log"].read_text(), "the other one goes on")


BAD = ("tcp:0", "join", "join:x", "join:70000", "joined:5")


def refused(folder, command, can):
    said = subprocess.run([sys.executable, REPO / "qemu/run.py", command, "--build", folder, "--can", can], cwd=REPO,
                          stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert said.returncode not in (0, None) and said.stderr.startswith("mssfoc: CAN ") and said.stderr.count("\n") == 1
    return said.stderr


def test_what_cannot_be_is_refused_in_one_line(folder):
    for can in BAD:
        assert "neither pty nor tcp:PORT" in refused(folder, "console", can)
    port = free_port()
    assert "nobody listens there" in refused(folder, "console", f"join:{port}")
    assert "make console" in refused(folder, "run", f"join:{port}")
    with socket.create_server(("127.0.0.1", port)) as stranger:
        assert f"CAN=join:{port}" in refused(folder, "console", f"tcp:{port}")
        stranger.settimeout(0)
        assert "no twin's bus" in refused(folder, "console", f"join:{port}")
    assert not (folder / "console-2").exists(), "nothing is left of it"


def test_a_bus_whose_twin_never_came_does_not_stay(folder):
    port = free_port()
    done = subprocess.run([sys.executable, "-c", "import sys; sys.path.insert(0, 'qemu'); from launcher.can_bus import *;"
                           f"can_chardev('tcp:{port}'); print(socket.create_connection(('127.0.0.1', {port})).recv(9))"],
                          env={**os.environ, "BUILD": str(folder)}, cwd=REPO, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "b'< hi >'", done.stderr
    until(lambda: not listening(port), "it ends with whoever has opened it")


@contextlib.contextmanager
def bare_bus():
    """connect(what it says at first) to a bus, whose process is `bus`, without a twin of QEMU's."""
    with socket.create_server(("127.0.0.1", 0)) as listener, contextlib.ExitStack() as ends:
        bus = subprocess.Popen([build_dir() / "qemu/canbus", str(listener.fileno())], stdin=subprocess.PIPE,
                               pass_fds=[listener.fileno()])
        port = listener.getsockname()[1]

        def connect(text="", greeting=b"< hi >"):
            one = ends.enter_context(socket.create_connection(("127.0.0.1", port), PATIENCE_S))
            assert one.recv(256) == greeting
            one.sendall(text.encode())
            return one
        try:
            yield bus, port, connect
        finally:
            bus.kill()
            bus.communicate()


def test_a_twin_that_has_not_begun_keeps_the_bus():
    """One halted at its reset vector, as in `make debug`, or one that still loads, when the only other one ends."""
    with bare_bus() as (bus, _, connect):
        first, halted = connect("< node 2000 0 >"), connect()
        watcher = connect("< twins >")
        assert watcher.recv(256) == b"< twins 1 >"
        first.close()
        until(lambda: watcher.sendall(b"< twins >") or watcher.recv(256) == b"< twins 0 >", "the bus is still there, empty")
        halted.sendall(b"< node 2000 0 >")
        until(lambda: watcher.sendall(b"< twins >") or watcher.recv(256) == b"< twins 1 >", "it has begun")
        halted.close()
        until(lambda: bus.poll() == 0, "and was the last")


def test_a_full_bus_says_so_and_has_room_again_later(folder):
    with bare_bus() as (_, port, connect):
        ends = [connect("< node 2000 0 >") for _ in range(64)]
        connect(greeting=b"< error full >")
        assert "has room for no further" in refused(folder, "console", f"join:{port}")
        ends[7].close()
        can_chardev(f"join:{port}")


def test_a_stranger_that_talks_without_an_end_is_no_bus(folder):
    with socket.create_server(("127.0.0.1", 0)) as stranger:
        def talk():
            with stranger.accept()[0] as one, contextlib.suppress(OSError):
                while True:
                    one.sendall(b"x" * 64)
                    time.sleep(0.05)
        threading.Thread(target=talk, daemon=True).start()
        assert "no twin's bus" in refused(folder, "console", f"join:{stranger.getsockname()[1]}")
