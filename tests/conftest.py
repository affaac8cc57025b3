# SPDX-License-Identifier: MIT
"""Where everything is: tests run from the repository's root, products are in $BUILD, the launcher is a package in qemu/."""
import gc
import os
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SHORT, NIGHT = ROOT / "tests/short.txt", ROOT / "tests/night.txt"
sys.path[:0] = [str(ROOT / folder) for folder in ("qemu", "qemu/client", "firmware/tables", "linker/bounds")]
os.chdir(ROOT)
os.environ.setdefault("BUILD", "build")
# What the caller's `make test` was told is not meant for the programs that tests start.
for told in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL", "MAKEOVERRIDES", "ALL", "UNTIL", "N", "FROM", "FILES", "BY", "RUNGS", "JOBS",
             "BUGS", "PART", "MOTOR", "SCENARIO", "SEED", "PLANT", "SPREAD", "DETUNE", "PROBE"):
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


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    from rigs.portions import Portions
    return Portions(config, log)


def pytest_collection_modifyitems(config, items):
    nodes = [item.nodeid for item in items]
    campaigns = set(names(NIGHT, nodes))
    short, but = chosen(names(SHORT, nodes)) if config.getoption("--short") else (("",), ())
    some = config.getoption("--short") or config.getoption("--first")
    kept, left_out, met = [], [], set()
    for item in items:
        test = item.nodeid.partition("[")[0]
        at_night = some and (test in met or item.get_closest_marker("night"))
        met |= {test} & campaigns
        in_short = item.nodeid.startswith(short) and not item.nodeid.startswith(but)
        (kept if in_short and not at_night else left_out).append(item)
    config.hook.pytest_deselected(items=left_out)
    items[:] = sorted(kept, key=lambda item: item.nodeid.startswith("tests/unit/"))  # a worker's last portion is short


def names(path, nodes):
    """The lines of a list of tests. Each names one, where all are collected."""
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    for name in lines if len({node.partition("::")[0] for node in nodes}) > 200 else ():
        if not any(node.startswith(name.removeprefix("- ")) for node in nodes):
            raise pytest.UsageError(f"{path.name} names {name}, and there is no such test")
    return lines


def chosen(lines):
    """(what is played, what of it is not) by the lines of short.txt."""
    return (tuple(line for line in lines if not line.startswith("- ")),
            tuple(line[2:] for line in lines if line.startswith("- ")))
