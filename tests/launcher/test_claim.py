# SPDX-License-Identifier: MIT
"""Two launchers do not write one folder: the second is refused in one line, and a holder that was killed leaves no lock."""
import os
import signal
import subprocess
import sys
import time

import pytest

from launcher import LauncherError
from launcher.claim import LOCK, claim
from launcher.paths import REPO

PATIENCE_S = 60.0  # for what takes milliseconds: a stall, not a verdict
FOLDERS = {"run": "run", "console": "console", "debug": "console", "campaign": "campaign"}


def until(holds, process=None):
    limit = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < limit
        assert process is None or process.poll() is None, process.communicate()
        time.sleep(0.01)


def launcher(build, qemu, *arguments):
    return subprocess.Popen([sys.executable, str(REPO / "qemu" / "run.py"), *arguments], cwd=REPO, text=True,
                            env={**os.environ, "BUILD": str(build), "QEMU": qemu}, stdin=subprocess.DEVNULL,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)


@pytest.fixture
def holder(build, fake_qemu):
    """A launcher that has its folder, while its QEMU hangs; and the folder's lock."""
    processes = []

    def start(command):
        lock = build / FOLDERS[command] / LOCK
        first = launcher(build, fake_qemu("hang"), command)
        processes.append(first)
        until(lambda: lock.exists() and lock.read_text(), first)
        return first, lock
    yield start
    for process in processes:
        process.terminate()
        process.communicate(timeout=PATIENCE_S)


@pytest.mark.parametrize("first, second", [("run", "run"), ("console", "debug"), ("campaign", "campaign")])
def test_the_second_is_refused_in_one_line(build, fake_qemu, holder, first, second):
    process, lock = holder(first)
    late = launcher(build, fake_qemu("hang"), second, *(() if second == "campaign" else ("--seed", "5")))
    _, said = late.communicate(timeout=PATIENCE_S)
    assert late.returncode == 2 and len(said.splitlines()) == 1, said
    assert f"{lock.parent.name} is in use by another run (process {process.pid}): wait until it has ended" in said
    assert "BUILD=build2" in said and process.poll() is None
    assert lock.read_text() == f"{process.pid}\n"
    if second != "campaign":
        until(lambda: (lock.parent / "progress.pid").exists())
        assert "seed 1" in (lock.parent / "twin.cfg").read_text().splitlines(), "it wrote there"


def test_a_holder_that_was_killed_leaves_nothing(build, fake_qemu, holder, tmp_path):
    process, lock = holder("run")
    process.send_signal(signal.SIGKILL)
    process.wait(PATIENCE_S)
    assert lock.read_text() == f"{process.pid}\n"  # the number is there, the lock is not
    scenario = tmp_path / "short.toml"
    scenario.write_text('title = "a test"\nend_s = 0.1\npreamble_s = 0.01\n')
    late = launcher(build, fake_qemu(), "run", "--scenario", str(scenario))
    _, said = late.communicate(timeout=PATIENCE_S)
    assert late.returncode == 0, said


def test_it_is_held_as_long_as_somebody_keeps_it(tmp_path):
    ask = [sys.executable, "-c", "import sys; sys.path.insert(0, 'qemu'); from launcher.claim import claim; claim(sys.argv[1])",
           str(tmp_path / "results")]
    held, again = claim(tmp_path / "results"), claim(tmp_path / "results")
    assert again is held  # a process is not in its own way
    assert b"is in use by another run" in subprocess.run(ask, cwd=REPO, capture_output=True, check=False).stderr
    del held, again
    assert subprocess.run(ask, cwd=REPO, capture_output=True, check=False).returncode == 0
    (tmp_path / "file").write_text("")
    with pytest.raises(LauncherError, match="cannot write to"):
        claim(tmp_path / "file" / "results")
