# SPDX-License-Identifier: MIT
"""An environment of its own, in the build folder, for what Debian does not package: clients of others, and ours by pip."""
import fcntl
import subprocess
import sys
from pathlib import Path

import pytest

from launcher.paths import build_dir
from tools import client

WANTED = ("canopen==2.4.1", "python-can==4.6.1", "eds-utils==0.3.1", "minimalmodbus==2.1.1", "pyserial==3.5", "numpy",
          "blark==0.8.3", "setuptools", "wheel")
PIP = ("-q", "--disable-pip-version-check", "--retries", "1", "--timeout", "15")


def environment():
    """Its folder of programs, or None if it cannot be had: there is no network, say."""
    folder = build_dir() / "clients"
    ready = folder / "ready"
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / ".lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (ready.exists() and ready.read_text() == repr(WANTED)):
            made = subprocess.run([sys.executable, "-m", "venv", "--clear", folder / "env"], capture_output=True, check=False)
            got = made.returncode == 0 and subprocess.run(
                [folder / "env/bin/pip", *PIP, "install", *WANTED], capture_output=True, check=False).returncode == 0
            if not got:
                return None
            ready.write_text(repr(WANTED))
    return folder / "env" / "bin"


def packed(folder):
    """The client as a wheel, by `make client` and pip; nothing is fetched."""
    client.write(folder / "client")
    subprocess.run([environment() / "pip", *PIP, "wheel", "--no-index", "--no-deps", "--no-build-isolation", "-w", folder,
                    folder / "client"], check=True)
    return next(Path(folder).glob("mssfoc-*.whl"))


def installed_in(folder):
    """(a Python, the folder of the client's wheel for its PYTHONPATH); skips the test where PyPI cannot be reached."""
    if environment() is None:
        pytest.skip("the client's environment cannot be had from PyPI: no network?")
    install = [environment() / "pip", "-q", "install", "--no-index", "--no-deps", "--target", folder / "site"]
    subprocess.run([*install, packed(folder)], check=True)
    return environment() / "python", folder / "site"
