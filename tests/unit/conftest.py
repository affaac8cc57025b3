# SPDX-License-Identifier: MIT
"""The firmware's rooms, compiled for this machine with every undefined behaviour trapped.

Registers are structures in the test's memory; the core and the console are tests/unit/host. MSSFOC_SOURCE names another tree to
take the firmware from: a mutant's.
"""
import fcntl
import os
import re
import subprocess
from pathlib import Path

import hypothesis
import pytest

from unit.cinterface import Library

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
SOURCE = Path(os.environ.get("MSSFOC_SOURCE", ROOT))
ROOMS = ("settings", "control", "commission", "axis", "scope", "operate")
FLAGS = ["-std=gnu11", "-O1", "-g", "-fPIC", "-shared", "-fsanitize=undefined", "-fno-sanitize-recover=all", "-Wall", "-Wextra",
         "-Werror", "-Wno-int-to-pointer-cast"]


# the same numbers every time, and no verdict that depends on how fast they come
hypothesis.settings.register_profile("unit", deadline=None, derandomize=True, database=None, suppress_health_check=list(
    hypothesis.HealthCheck))
hypothesis.settings.load_profile("unit")


def sources():
    firmware = [path for room in ROOMS for path in sorted((SOURCE / "firmware" / room).glob("*.c")) if path.name != "device.c"]
    fabric = sorted(path for path in (SOURCE / "drivers" / "fabric").glob("*.c") if path.name != "contract.c")  # checks only
    envm = [SOURCE / "drivers/mss/envm.c", *(ROOT / "qemu/twin" / name for name in ("envm.c", "random.c"))]  # and its model
    return firmware + fabric + envm + sorted((SOURCE / "lib").glob("*.c")) + sorted((HERE / "host").glob("*.c"))


def system_sources():
    """The rooms below the console with the system's, and the drivers of the processor's side."""
    left_out = (SOURCE / "firmware" / "operate", HERE / "host")
    return [path for path in sources() if path.parent not in left_out or path.name == "envm.c"] + sorted(
        (SOURCE / "firmware" / "system").glob("*.c")) + [SOURCE / "firmware/axis/device.c"] + [
            SOURCE / "drivers/mss" / name for name in ("sysreg.c", "timer.c")] + sorted((HERE / "host" / "system").glob("*.c"))


def build_library(name="firmware.so", sources=sources):
    """The shared library, newer than everything it is made of; safe with several pytest workers."""
    build = Path(os.environ.get("BUILD", "build"))
    folder = (build if build.is_absolute() else ROOT / build) / "tests" / "unit"
    if SOURCE != ROOT:
        folder = SOURCE / "build-unit"
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / name
    headers = ("firmware/**/*.h", "drivers/**/*.h", "lib/*.h")
    inputs = sources() + [path for pattern in headers for path in SOURCE.glob(pattern)]
    inputs += [*(HERE / "host").rglob("*"), Path(__file__)]
    with open(folder / ".lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not target.exists() or target.stat().st_mtime <= max(path.stat().st_mtime for path in inputs):
            command = [os.environ.get("HOSTCC") or "cc", *FLAGS, f"-I{HERE / 'host'}", f"-I{SOURCE}", f"-I{ROOT}",
                       *map(str, sources()), "-lm", "-o", str(target)]
            result = subprocess.run(command, capture_output=True, text=True)
            assert result.returncode == 0, result.stderr
    return target


def build_program(source, target):
    """A program of the host that uses everything in the shared library."""
    library = build_library()
    command = [os.environ.get("HOSTCC") or "cc", *FLAGS[:2], "-Wall", "-Wextra", "-Werror", "-Wno-int-to-pointer-cast",
               f"-I{HERE / 'host'}", f"-I{SOURCE}", str(source), str(library), f"-Wl,-rpath,{library.parent}",
               "-lm", "-o", str(target)]
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
    text = (SOURCE / "drivers/fabric/gate.h").read_text()
    fabric.gate.ID = int(re.search(r"#define GATE_ID (0x[0-9A-F]+)u", text).group(1), 16)


@pytest.fixture(scope="session")
def system():
    """The device's side: registers stand at their own addresses, so that no test may forget to map them (test_system.py)."""
    return Library(build_library("system.so", system_sources))


@pytest.fixture(scope="session")
def c():
    """Everything the firmware's headers declare: structures, enums, functions."""
    return Library(build_library())
