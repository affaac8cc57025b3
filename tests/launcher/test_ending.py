# SPDX-License-Identifier: MIT
"""QEMU does not outlive the launcher, however that ends: a terminal that closes, kill, kill -9."""
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from launcher.paths import REPO

PATIENCE_S = 60.0  # for what takes milliseconds: a stall, not a verdict


def until(holds):
    limit = time.monotonic() + PATIENCE_S
    while time.monotonic() < limit:
        if value := holds():
            return value
        time.sleep(0.01)
    return None


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def heed(number):
    """For a child of tests that were started by nohup or in the background: it then inherits signals that are ignored."""
    return lambda: signal.signal(number, signal.SIG_DFL)


@pytest.fixture
def running(build, fake_qemu):
    """A launcher whose QEMU hangs, and the process number of that QEMU."""
    started = []

    def start(**options):
        environment = {**os.environ, "BUILD": str(build), "QEMU": fake_qemu("hang")}
        launcher = subprocess.Popen([sys.executable, str(REPO / "qemu" / "run.py"), "run"], env=environment, cwd=REPO,
                                    stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
        note = build / "run" / "progress.pid"
        text = until(lambda: note.exists() and note.read_text())
        assert text, launcher.stderr.read()
        started.append(int(text))
        return launcher, started[-1]
    yield start
    for pid in started:
        if alive(pid):
            os.kill(pid, signal.SIGKILL)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_both_with_one_line(running, number):
    launcher, qemu = running(preexec_fn=heed(number))
    launcher.send_signal(number)
    _, errors = launcher.communicate(timeout=PATIENCE_S)
    assert launcher.returncode == 128 + number
    assert f"mssfoc: ended by {number.name}" in errors.splitlines() and "Traceback" not in errors
    assert not alive(qemu)  # the launcher waits for it


def test_a_launcher_that_is_killed_takes_qemu_with_it(running):
    launcher, qemu = running()
    assert alive(qemu)
    launcher.kill()
    launcher.wait()
    assert until(lambda: not alive(qemu)), "QEMU runs on"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_campaign_that_is_ended_takes_its_runs_with_it(build, fake_qemu, tmp_path, number):
    environment = {**os.environ, "BUILD": str(build), "QEMU": fake_qemu("hang"), "TMPDIR": str(tmp_path)}
    command = [sys.executable, str(REPO / "qemu" / "run.py"), "campaign", "--motors", "teknic_m2310p", "--scenarios", "idle",
               "--seeds", "4", "--jobs", "2"]
    launcher = subprocess.Popen(command, env=environment, cwd=REPO, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                preexec_fn=heed(number))
    notes = until(lambda: len(found := [n for n in tmp_path.glob("mssfoc-*/progress.pid") if n.read_text()]) == 2 and found)
    assert notes, "the runs did not begin"
    pids = [int(note.read_text()) for note in notes]
    launcher.send_signal(number)
    launcher.communicate(timeout=PATIENCE_S)
    assert launcher.returncode == (130 if number == signal.SIGINT else 128 + number)
    assert not any(until(lambda pid=pid: not alive(pid)) is None for pid in pids), "QEMU runs on"
    assert not list((build / "campaign").glob("*/*.json")), "a run that was ended is no result"


def test_nohup_is_heeded(running):
    launcher, qemu = running(preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    launcher.send_signal(signal.SIGHUP)
    launcher.send_signal(signal.SIGTERM)
    _, errors = launcher.communicate(timeout=PATIENCE_S)
    assert "SIGTERM" in errors and "SIGHUP" not in errors
    assert not alive(qemu)
