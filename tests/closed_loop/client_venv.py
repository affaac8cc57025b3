# SPDX-License-Identifier: MIT
"""An environment of its own, in the build folder, for clients that Debian does not package. Made once."""
import fcntl
import subprocess
import sys

from launcher.paths import build_dir

WANTED = ("canopen==2.4.1", "python-can==4.6.1", "eds-utils==0.3.1")


def environment():
    """Its folder of programs, or None if it cannot be had: there is no network, say."""
    folder = build_dir() / "canopen"
    ready = folder / "ready"
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / ".lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (ready.exists() and ready.read_text() == repr(WANTED)):
            made = subprocess.run([sys.executable, "-m", "venv", "--clear", folder / "env"], capture_output=True, check=False)
            got = made.returncode == 0 and subprocess.run(
                [folder / "env/bin/pip", "-q", "--disable-pip-version-check", "--retries", "1", "--timeout", "15", "install",
                 *WANTED], capture_output=True, check=False).returncode == 0
            if not got:
                return None
            ready.write_text(repr(WANTED))
    return folder / "env" / "bin"
