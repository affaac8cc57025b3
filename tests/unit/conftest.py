# SPDX-License-Identifier: MIT
"""The firmware's rooms as shared libraries of this machine (unit.mk)."""
import ctypes
import os
import re
import subprocess
from pathlib import Path

import hypothesis
import pytest

from unit.cinterface import Library, made
from unit.register_pages import NO_ACCESS, PAGES, READ_WRITE, protect

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent


# the same numbers every time, and no verdict that depends on how fast they come
hypothesis.settings.register_profile("unit", deadline=None, derandomize=True, database=None, suppress_health_check=list(
    hypothesis.HealthCheck))
hypothesis.settings.load_profile("unit")


def built(name):
    """The shared library of that name, up to date."""
    return made(f"unit/{name}")


def build_program(source, target):
    """A program of the host that uses everything in the shared library."""
    library = built("firmware.so")
    command = [os.environ.get("HOSTCC") or "cc", "-std=gnu11", "-O1", "-Wall", "-Wextra", "-Werror", "-Wno-int-to-pointer-cast",
               f"-I{HERE / 'host'}", f"-I{ROOT}", str(source), str(library), "-lm", "-o", str(target)]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


def storm(source, folder, count):
    """What a program that judges so many lines or frames by itself has counted: {name: count}."""
    program = folder / source.stem
    build_program(source, program)
    output = subprocess.run([program, str(count), "2463534242"], check=True, capture_output=True, text=True).stdout
    return {name: int(n) for name, n in (line.split() for line in output.splitlines())}


def identify(fabric):
    """The identity that the firmware looks for: as the register shows it."""
    text = (ROOT / "drivers/fabric/gate.h").read_text()
    fabric.gate.ID = int(re.search(r"#define GATE_ID (0x[0-9A-F]+)u", text).group(1), 16)


@pytest.fixture(scope="session")
def system():
    """The device's side: registers stand at their own addresses, so that no test may forget to map them (test_system.py)."""
    return Library(built("system.so"))


@pytest.fixture(scope="session")
def two_axes():
    """The same for a device with two motors."""
    return Library(built("two_axes.so"))


@pytest.fixture(scope="session")
def two_buses():
    """As `c`, for a device with two motors."""
    return Library(built("two_axes_buses.so"))


@pytest.fixture(scope="module")
def memory():
    """The registers' addresses can be used: nothing stands there at first."""
    protect(READ_WRITE)
    for page in PAGES:
        ctypes.memset(page, 0, 4096)
    yield
    protect(NO_ACCESS)


@pytest.fixture(scope="session")
def c():
    """Everything the firmware's headers declare: structures, enums, functions."""
    return Library(built("firmware.so"))
