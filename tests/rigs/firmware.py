# SPDX-License-Identifier: MIT
"""The firmware's rooms, and the models of the plant, as shared libraries of this machine, and programs that use them."""
import fcntl
import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = ROOT / "tests/unit"


def built(name, room="unit"):
    """The shared library of that name in that folder of tests, up to date; safe with several pytest workers."""
    wanted = Path(os.environ.get("BUILD", "build")) / "tests" / room / name
    target = ROOT / wanted
    target.parent.mkdir(parents=True, exist_ok=True)
    with open(target.parent / ".lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        result = subprocess.run(["make", "-s", "NO_INSTALL=1", str(wanted)], cwd=ROOT, capture_output=True, text=True)
        assert result.returncode == 0, result.stdout + result.stderr
    return target


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
