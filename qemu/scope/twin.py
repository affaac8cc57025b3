# SPDX-License-Identifier: MIT
"""The drive in QEMU at the line's other end, in real time, and what can be done to its motor and sensors."""
import array
import asyncio
import contextlib
import fcntl
import os
import re
import signal
import subprocess
import termios
import time
from pathlib import Path

from launcher.console import LEAD_S, PACE_S, prepared
from launcher.drive import preamble
from launcher.errors import LauncherError
from launcher.paths import build_dir
from launcher.qemu import progress_s, reason, start, tail

# what the page may do to the plant: names and arguments as in docs/motors.md, and what they are for people
DISTURBANCES = {
    "load_nm": "load torque, Nm", "lock": "rotor locked, 0 or 1", "supply_v": "supply, V", "sto": "safe torque off: A 1, A 0",
    "driver_fault": "gate driver's fault pin, 0 or 1", "encoder_cut": "encoder's cable cut, 0 or 1",
    "encoder_slip": "counts that the encoder loses", "phase_open": "wire of a phase: A 1, A 0",
    "temperature_c": "winding's sensor, degC or off",
}
CHANGE_S = 0.05
STILL_S = 0.5
PROC = Path("/proc")
TAKEN_S = 2.0  # for an event, which takes 10 ms of a drive that runs


class Twin:
    name = "twin"
    disturbances = DISTURBANCES

    def __init__(self, motors, seed, build=None, qemu=None, out_dir=None, modbus="", **plant):
        self._arguments = (motors, seed, build, qemu, out_dir, modbus, plant)
        self.elf = build_dir(build) / "mssfoc.elf"
        self.title, self._ticks, self._worked_s, self._held = "", [], 0.0, False

    async def open(self):
        motors, seed, build, qemu, out_dir, modbus, plant = self._arguments
        drives, line, environment, progress, self._pipe_path = prepared(
            motors[0], seed, build, qemu, None, plant, second="".join(motors[1:]),
            console="stdio,id=console,mux=off,signal=off", live=True, out_dir=out_dir, modbus=modbus)
        drives = [drive for drive in drives if drive]
        self.title = "; ".join(f"{drive.motor.name} on {drive.inverter.name}" for drive in drives) + ", in QEMU"
        self.lines = [f"axis {number} {line}" if len(drives) > 1 else line
                      for number, drive in enumerate(drives, 1) for line in preamble(drive)]
        self._log = progress.parent / "qemu.log"
        with open(self._log, "wb") as log:
            self._process = start(line, environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log)
        os.set_blocking(self._process.stdin.fileno(), False)  # a QEMU that is stopped takes nothing
        self._pipe = os.open(self._pipe_path, os.O_RDWR)  # both ways: it never has nobody who reads
        loop = asyncio.get_running_loop()
        self._reader = asyncio.StreamReader()
        await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(self._reader), self._process.stdout)
        self._pace = asyncio.ensure_future(self._keep_pace(progress))

    async def read(self):
        return await self._reader.read(65536)

    async def write(self, data):
        os.write(self._process.stdin.fileno(), data)

    async def reopen(self):
        raise LauncherError("its line ends with it")

    def ended(self):
        """What has become of QEMU, or None while it is there."""
        status = self._process.poll()
        return None if status is None else f"{reason(status)}; make scope starts it anew"

    def at_work(self):
        """Whether QEMU uses the processor or waits for it or for a disk, however little a busy machine leaves to it; or is
        held here, for however long a busy machine makes that."""
        self._look_at_work()  # this program may be late, too
        return self._held or time.monotonic() - self._worked_s < STILL_S

    def _look_at_work(self):
        with contextlib.suppress(OSError):  # it has just ended
            threads = [(thread / "stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
                       for thread in (PROC / str(self._process.pid) / "task").iterdir()]
            ticks = [thread[11:13] for thread in threads]
            if ticks != self._ticks or any(thread[0] in "RD" for thread in threads):
                self._ticks, self._worked_s = ticks, time.monotonic()

    def last_words(self):
        """What QEMU and the twin wrote."""
        return "\n".join(line.removeprefix("  | ") for line in tail(self._log).splitlines() if line)

    async def set_baud(self, rate):
        """The line has no rate of its own; but what arrives while the drive sets its UART anew is lost."""
        await asyncio.sleep(CHANGE_S)

    async def disturb(self, name, arguments, axis=0):
        """None when it has happened, or why not."""
        if name not in DISTURBANCES:
            return f"'{name}' is not one of {', '.join(DISTURBANCES)}"
        if not all(word.isprintable() and len(word) < 30 for word in arguments):
            return "arguments are numbers, letters or 'off'"
        if self.ended():
            return self.ended()
        said = self._log.stat().st_size
        os.write(self._pipe, " ".join([*(["2"] if axis else []), name, *arguments]).encode() + b"\n\n")
        end = time.monotonic() + TAKEN_S
        while self._waiting():
            if time.monotonic() > end:
                return "the drive is silent, and has not taken it yet"
            await asyncio.sleep(PACE_S)
        refused = re.search(r"live event '.*': (.*)", self._log.read_bytes()[said:].decode("utf-8", "replace"))
        return refused and refused.group(1)

    def _waiting(self):
        """Bytes in the pipe of events."""
        count = array.array("i", [0])
        fcntl.ioctl(self._pipe, termios.FIONREAD, count)
        return count[0]

    async def _keep_pace(self, progress):
        """As launcher/console.py: simulated time runs no faster than the clock on the wall."""
        begin = time.monotonic()
        while self._process.poll() is None:
            await asyncio.sleep(PACE_S)
            self._look_at_work()
            ahead = progress_s(progress) - (time.monotonic() - begin)
            if ahead > LEAD_S:
                await self._hold(ahead)
            elif ahead < -LEAD_S:
                begin += -ahead

    async def _hold(self, seconds):
        self._held = True
        self._process.send_signal(signal.SIGSTOP)
        await asyncio.sleep(seconds)
        self._process.send_signal(signal.SIGCONT)
        self._held, self._worked_s = False, time.monotonic()

    async def close(self):
        self._pace.cancel()
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGCONT)
            self._process.terminate()
            self._process.wait()
        os.close(self._pipe)
