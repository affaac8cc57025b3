# SPDX-License-Identifier: MIT
"""Where everything is: tests run from the repository's root, products are in $BUILD, the launcher is a package in qemu/."""
import gc
import hashlib
import itertools
import os
import sys
import time
from pathlib import Path

import pytest

SHORT = "tests/unit/"
# what each of them has whole; of what plays the image and takes its time, one test in so many, drawn by its name
WHOLE = (SHORT, *(f"tests/{name}/" for name in ("fuzz", "lib", "launcher", "tools", "make", "budgets", "silicon", "mutants",
                                                "twin")),
         "tests/campaign/test_lots.py", "tests/guides/test_adding.py", "tests/closed_loop/test_scenarios.py::test_scenario[")
ONE_IN = {"--sample": 5, "--most": 4}
ROOT = Path(__file__).resolve().parents[1]
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
    parser.addoption("--sample", action="store_true",
                     help="without what is marked `rest`, more motors, rates and cases of what is there already; of what plays"
                          " the image, one test in five")
    parser.addoption("--until", type=float, help="seconds since 1970: what has not begun by then is left out, and said")
    parser.addoption("--most", action="store_true",
                     help="without what is marked `long`, half a minute for one case more; of what plays the image, a fourth")


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
    config.addinivalue_line("markers", "rest: more of what other tests show; `make test ALL=1`, and so .ci/run, has it")
    config.addinivalue_line("markers", "long: the same, for a night: only `make test ALL=2` has it")


def pytest_collection_modifyitems(config, items):
    left = {"--sample": ("rest", "long"), "--most": ("long",)}
    names = {name for option, marks in left.items() if config.getoption(option) for name in marks}
    one_in = next((many for option, many in ONE_IN.items() if config.getoption(option)), 1)
    kept, left_out = [], []
    for item in items:
        out = any(item.get_closest_marker(name) for name in names) or not _drawn(item.nodeid, one_in)
        (left_out if out else kept).append(item)
    config.hook.pytest_deselected(items=left_out)
    items[:] = kept
    items[:] = _mixed(items)


def _drawn(nodeid, one_in):
    return nodeid.startswith(WHOLE) or hashlib.blake2b(nodeid.encode(), digest_size=8).digest()[-1] % one_in == 0


def _mixed(items):
    """The files with many short tests between the others: xdist's first portions, each of so many neighbours, must not be the
    longest, or one worker is left with its own when all others have ended."""
    files = [list(group) for _, group in itertools.groupby(items, key=lambda item: item.nodeid.split("::")[0])]
    short = [file for file in files if file[0].nodeid.startswith(SHORT)]
    long = [file for file in files if not file[0].nodeid.startswith(SHORT)]
    places = [((n + 0.5) / len(group), file) for group in (short, long) for n, file in enumerate(group)]
    return [item for _, file in sorted(places, key=lambda place: place[0]) for item in file]
