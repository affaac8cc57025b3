# SPDX-License-Identifier: MIT
"""The drive in QEMU at the line's other end, in real time, and what can be done to its motor and sensors."""
import asyncio
import os
import subprocess
import time

from launcher.console import LEAD_S, PACE_S, prepared
from launcher.drive import preamble
from launcher.qemu import progress_s, start

# what the page may do to the plant: names and arguments as in docs/motors.md, and what they are for people
DISTURBANCES = {
    "load_nm": "load torque, Nm", "lock": "rotor locked, 0 or 1", "supply_v": "supply, V", "sto": "safe torque off: A 1, A 0",
    "driver_fault": "gate driver's fault pin, 0 or 1", "encoder_cut": "encoder's cable cut, 0 or 1",
    "encoder_slip": "counts that the encoder loses", "phase_open": "wire of a phase: A 1, A 0",
    "temperature_c": "winding's sensor, degC or off",
}


CHANGE_S = 0.05


class Twin:
    name = "twin"
    disturbances = DISTURBANCES

    def __init__(self, motor, seed, build=None, qemu=None, **plant):
        self._arguments = (motor, seed, build, qemu, plant)
        self.title, self.ratings = "", {}

    async def open(self):
        motor, seed, build, qemu, plant = self._arguments
        drive, line, environment, progress, self._pipe_path = prepared(
            motor, seed, build, qemu, None, plant, console="stdio,id=console,mux=off,signal=off", live=True)
        self.title = f"{drive.motor.name} on {drive.inverter.name}, in QEMU"
        self.lines = list(preamble(drive))
        self._process = start(line, environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._pipe = os.open(self._pipe_path, os.O_RDWR)  # both ways: it never has nobody who reads
        loop = asyncio.get_running_loop()
        self._reader = asyncio.StreamReader()
        await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(self._reader), self._process.stdout)
        self._pace = asyncio.ensure_future(self._keep_pace(progress))

    async def read(self):
        return await self._reader.read(65536)

    async def write(self, data):
        self._process.stdin.write(data)
        self._process.stdin.flush()

    async def set_baud(self, rate):
        """The line has no rate of its own; but what arrives while the drive sets its UART anew is lost."""
        await asyncio.sleep(CHANGE_S)

    def disturb(self, name, arguments):
        """None, or why not."""
        if name not in DISTURBANCES:
            return f"'{name}' is not one of {', '.join(DISTURBANCES)}"
        if not all(word.isprintable() and " " not in word and len(word) < 30 for word in arguments):
            return "arguments are numbers, letters or 'off'"
        os.write(self._pipe, " ".join([name, *arguments]).encode() + b"\n")
        return None

    async def _keep_pace(self, progress):
        """As launcher/console.py: simulated time runs no faster than the clock on the wall."""
        begin = time.monotonic()
        while self._process.poll() is None:
            await asyncio.sleep(PACE_S)
            ahead = progress_s(progress) - (time.monotonic() - begin)
            if ahead > LEAD_S:
                self._process.send_signal(19)  # SIGSTOP
                await asyncio.sleep(ahead)
                self._process.send_signal(18)  # SIGCONT
            elif ahead < -LEAD_S:
                begin += -ahead

    async def close(self):
        self._pace.cancel()
        if self._process.poll() is None:
            self._process.send_signal(18)
            self._process.terminate()
            self._process.wait()
        os.close(self._pipe)
