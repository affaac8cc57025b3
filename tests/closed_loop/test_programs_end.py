# SPDX-License-Identifier: MIT
"""A program that turns the motor ends: asked to, or killed. The shaft comes to rest; who is asked to end brakes first."""
import json
import re
import signal
import subprocess
import sys
import time

import mssfoc
import pytest
from launcher.qemu import progress_s
from mssfoc.watch import TIMEOUT_MS

from closed_loop.live import free_port, live_everything
from rigs.firmware import ROOT

aiohttp = pytest.importorskip("aiohttp")

PATIENCE_S = 120
STOPS_S = 1.0  # simulated: from 800 rpm to rest
CLIENT = """
import sys, time, mssfoc
with mssfoc.connect(sys.argv[1]) as drive:
    drive.on()
    drive.speed(800)
    drive.wait(lambda: abs(drive.status().speed_rpm - 800) < 10, "800 rpm")
    print("turns", flush=True)
    time.sleep(600)
"""
SERVER = """
import sys
from scope.board import Board
from scope.web import serve
class Socket(Board):
    async def open(self):
        import serial
        self._serial = serial.serial_for_url(self.port, 115200, timeout=0.02)
sys.exit(serve(Socket(sys.argv[1]), browser=False))
"""
ENV = {"PYTHONPATH": f"{ROOT}/qemu:{ROOT}/qemu/client", "PYTHONUNBUFFERED": "1", "PATH": "/usr/bin:/bin"}


class Place(str):
    """Where the drive is, and the file that says how far it is."""
    def __new__(cls, place, progress):
        one = super().__new__(cls, place)
        one.progress = progress
        return one


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    port = free_port()
    with live_everything(tmp_path_factory.mktemp("live"), port, free_port(), free_port()) as files:
        yield Place(f"socket://127.0.0.1:{port}", files["progress"])


def started(program, place):
    def hears():  # also below nohup, whose programs pass over a terminal's end
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
    return subprocess.Popen([sys.executable, "-c", program, place], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                            env=ENV, preexec_fn=hears)


def came_to_rest(place, faults):
    """Whoever asks next finds the drive at rest; it says what has ended operation. Until its limit nobody speaks to it."""
    until_s = time.monotonic() + PATIENCE_S
    if faults:
        begun_s = progress_s(place.progress)
        while progress_s(place.progress) < begun_s + TIMEOUT_MS / 1000 + STOPS_S:
            assert time.monotonic() < until_s, "the simulation stands"
            time.sleep(0.1)
    while time.monotonic() < until_s:
        try:
            with mssfoc.connect(place, command_timeout_ms=0) as drive:
                drive.wait(lambda: drive.state() in ("switch on disabled", "fault"), "it goes on", PATIENCE_S, faults=False)
                drive.wait(lambda: abs(drive.status().speed_rpm) < 5, "it turns on", PATIENCE_S, faults=False)
                fault = drive.fault()
                if fault:
                    drive.clear()
                drive["command_timeout_ms"] = 0
                return (fault and fault.name) == faults
        except mssfoc.Silent:
            time.sleep(0.2)  # the line is still another's
    return False


ENDS = [("SIGTERM", None), ("SIGHUP", None), ("SIGKILL", "command time-out")]


@pytest.mark.parametrize("name, fault", ENDS)
def test_a_client_that_ends(name, fault, place):
    with started(CLIENT, place) as program:
        assert program.stdout.readline() == "turns\n"
        program.send_signal(getattr(signal, name))
        program.communicate(timeout=PATIENCE_S)
        assert program.returncode != 0
    assert came_to_rest(place, fault)


async def page_turns_the_motor(address):
    """As a person at the page would; returns when it turns, and the page is gone."""
    async with aiohttp.ClientSession() as web, web.ws_connect(address + "socket") as page:
        async def until(holds):
            while True:
                await page.send_json({"kind": "here"})
                message = json.loads((await page.receive(timeout=PATIENCE_S)).data)
                if message["kind"] == "status" and holds(" ".join(message["lines"])):
                    return
        await page.send_json({"kind": "line", "line": "on"})
        await until(lambda text: "operation enabled" in text)
        await page.send_json({"kind": "line", "line": "speed 800"})
        await until(lambda text: re.search(r"speed: (79\d|80\d)\.", text))


@pytest.mark.parametrize("name, fault", ENDS)
def test_a_page_whose_server_ends(name, fault, place):
    import asyncio
    with started(SERVER, place) as server:
        address = next(line.strip() for line in server.stdout if line.startswith("http://"))

        async def scene():
            await page_turns_the_motor(address)
            server.send_signal(getattr(signal, name))
        asyncio.run(scene())
        server.communicate(timeout=PATIENCE_S)
    assert came_to_rest(place, fault)
