# SPDX-License-Identifier: MIT
"""Where everything is: tests run from the repository's root, products are in $BUILD, the launcher is a package in qemu/."""
import gc
import itertools
import os
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SHORT, NIGHT = ROOT / "tests/short.txt", ROOT / "tests/night.txt"
sys.path[:0] = [str(ROOT / "qemu"), str(ROOT / "qemu/client")]
os.chdir(ROOT)
os.environ.setdefault("BUILD", "build")
# What the caller's `make test` was told is not meant for the programs that tests start.
for told in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL", "MAKEOVERRIDES", "ALL", "UNTIL", "N", "FROM", "FILES", "RUNGS", "JOBS", "PART",
             "MOTOR", "SCENARIO", "SEED", "PLANT", "SPREAD", "DETUNE", "PROBE"):
    os.environ.pop(told, None)
gc.set_threshold(100_000, 20, 100)  # of thousands of tests, all of which stay, looked through for garbage

pytest.register_assert_rewrite("rigs")  # an assertion there says as much as one in a test

from unit import register_pages  # noqa: E402  (the path must be set first)

register_pages.keep_free()  # before a heap that grows reaches them


# what every program of the machine writes to or reads from, and a tool run as root can spoil for all other users
DEVICES = [path for path in map(Path, ("/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom")) if path.exists()]


def devices():
    """{path: (mode and kind, owner, group)}; None where there is nothing any more."""
    stats = {path: path.stat() if path.exists() else None for path in DEVICES}
    return {path: stat and (oct(stat.st_mode), stat.st_uid, stat.st_gid) for path, stat in stats.items()}


DEVICES_BEFORE = devices()


def pytest_sessionfinish(session):
    if not hasattr(session.config, "workerinput") and devices() != DEVICES_BEFORE:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter):
    now = devices()
    for path, before in DEVICES_BEFORE.items():
        if now[path] != before:
            terminalreporter.write_line(f"{path} was {before} and is {now[path]}: put it back, and find the test that did it",
                                        red=True)


def pytest_addoption(parser):
    parser.addoption("--short", action="store_true", help="what tests/short.txt names: as `make test` has it")
    parser.addoption("--first", action="store_true", help="the first case of a campaign, nothing marked `night`: as .ci/run")
    parser.addoption("--until", type=float, help="seconds since 1970: what has not begun by then is left out, and said")


class Until:
    """Ends the session in time, each worker its own part, since xdist waits for what it has handed out. Said; no failure."""
    def __init__(self, config):
        self.config, self.ends, self.played = config, config.getoption("--until"), 0

    def pytest_runtest_logreport(self, report):
        if report.when != "teardown":
            return
        self.played += 1
        if time.time() >= self.ends:
            for session in filter(None, (self.config.pluginmanager.getplugin(name) for name in ("session", "dsession"))):
                session.shouldstop = "time was up"

    @pytest.hookimpl(tryfirst=True)
    def pytest_sessionfinish(self, session, exitstatus):
        if exitstatus == pytest.ExitCode.INTERRUPTED and time.time() >= self.ends:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED if session.testsfailed else pytest.ExitCode.OK

    def pytest_terminal_summary(self, terminalreporter):
        if time.time() >= self.ends:
            terminalreporter.write_line(f"time was up after {self.played} tests")


def pytest_configure(config):
    if config.getoption("--until"):
        config.pluginmanager.register(Until(config))
    config.addinivalue_line("markers", "night: a campaign over motors, angles and seeds; ALL=2 has it, and no promise needs it")


def pytest_collection_modifyitems(config, items):
    nodes = [item.nodeid for item in items]
    campaigns, short = set(names(NIGHT, nodes)), tuple(names(SHORT, nodes)) if config.getoption("--short") else ("",)
    some = config.getoption("--short") or config.getoption("--first")
    kept, left_out, met = [], [], set()
    for item in items:
        test = item.nodeid.partition("[")[0]
        at_night = some and (test in met or item.get_closest_marker("night"))
        met |= {test} & campaigns
        (left_out if at_night or not item.nodeid.startswith(short) else kept).append(item)
    config.hook.pytest_deselected(items=left_out)
    items[:] = _mixed(kept)


def names(path, nodes):
    """The lines of a list of tests. Each names one, where all are collected."""
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    for name in lines if len({node.partition("::")[0] for node in nodes}) > 200 else ():
        if not any(node.startswith(name) for node in nodes):
            raise pytest.UsageError(f"{path.name} names {name}, and there is no such test")
    return lines


def _mixed(items):
    """The files with many short tests between the others: xdist's first portions, each of so many neighbours, must not be the
    longest, or one worker is left with its own when all others have ended."""
    files = [list(group) for _, group in itertools.groupby(items, key=lambda item: item.nodeid.split("::")[0])]
    short = [file for file in files if file[0].nodeid.startswith("tests/unit/")]
    long = [file for file in files if not file[0].nodeid.startswith("tests/unit/")]
    places = [((n + 0.5) / len(group), file) for group in (short, long) for n, file in enumerate(group)]
    return [item for _, file in sorted(places, key=lambda place: place[0]) for item in file]
