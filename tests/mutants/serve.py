# SPDX-License-Identifier: MIT
"""A plugin for pytest: collects everything once and waits; for each request a process that has all of it already is forked,
plays some tests in the order it is told, and writes down how each began and ended.

MUTANTS_LINK    a socket that requests come from, one JSON object a line: {"tests": [[test, seconds of CPU it may take], ...],
                "now": number of the mutant, "log": path, "to_the_end": bool, "met": bool}
The log is one JSON object a line: {"name": test} before, {"name": test, "failed": bool, "cpu_s": seconds, "shared_s": those of
them that fixtures took which others use, too, "met": numbers of mutants that it came by, "shared": that these fixtures did}.
With "met", TWIN_REACH is a file beside the log, NUMBER.bits, for what the n-th test executed at the twin.

A test that does not end is stopped by its CPU time, or when for WALL_S nothing has ended it.
"""
import ctypes
import json
import os
import re
import resource
import select
import shutil
import signal
import socket
from pathlib import Path

import pytest
from _pytest.runner import runtestprotocol

WALL_S = 900.0
PR_SET_PDEATHSIG = 1  # linux/prctl.h
MOST = 8192
_now = None  # the Child of this process


def _used_s(*whose):
    return sum(usage.ru_utime + usage.ru_stime for usage in map(resource.getrusage, whose))


def _used_in_all_s():
    return _used_s(resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session):
    with socket.socket(fileno=int(os.environ["MUTANTS_LINK"])) as link:
        stream = link.makefile("rw", encoding="utf-8")
        items = {item.nodeid: item for item in session.items}
        if not session.testsfailed:
            _shared_by_all(session)
        folder = Path(session.config._tmp_path_factory.getbasetemp())
        kept = {path.name for path in folder.iterdir()}
        print(json.dumps({"tests": list(items), "broken": session.testsfailed}), file=stream, flush=True)
        for line in stream:
            status = _forked(items, json.loads(line))
            for path in folder.iterdir():
                if path.name not in kept:
                    path.unlink() if path.is_symlink() else shutil.rmtree(path, ignore_errors=True)
            print(json.dumps({"status": status}), file=stream, flush=True)
    return True


def _shared_by_all(session):
    """What a session has one of, made before the first fork; what cannot be made, each of its tests will say."""
    session._setupstate.setup(session)
    made = set()
    for item in session.items:
        for name in item.fixturenames:
            definitions = item._fixtureinfo.name2fixturedefs.get(name, ())
            if definitions and definitions[-1].scope == "session" and definitions[-1].params is None and name not in made:
                made.add(name)
                try:
                    item._request.getfixturevalue(name)
                except BaseException:  # pytest's own outcomes are no Exception
                    definitions[-1].cached_result = None


def _forked(items, request):
    """How the process that plays it has ended: '' if by itself."""
    pid = os.fork()
    if pid == 0:
        try:
            os.setsid()
            ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
            Child(request).play([(items[name], most_s) for name, most_s in request["tests"] if name in items])
        finally:
            os._exit(0)
    watch = os.pidfd_open(pid)
    ready, _, _ = select.select([watch], [], [], WALL_S)
    os.close(watch)
    try:
        os.killpg(pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    _, status = os.waitpid(pid, 0)
    return "nothing ended it" if not ready else "" if os.WIFEXITED(status) else f"signal {os.WTERMSIG(status)}"


class Child:
    def __init__(self, request):
        global _now
        _now = self
        self.log, self.to_the_end = request["log"], request["to_the_end"]
        self.met = Path(self.log).with_suffix(".met") if request["met"] else None
        self.own, self.shared, self.shared_s = set(), set(), 0.0
        os.environ["MUTANTS_NOW"] = str(request["now"])
        if self.met:
            self.met.write_bytes(bytes(MOST))
            os.environ["MUTANTS_MET"] = str(self.met)
        for path in set(re.findall(r"/\S+\.so\b", Path("/proc/self/maps").read_text())):
            begin = getattr(ctypes.CDLL(path), "mutant_begin", None) if path.startswith(os.getcwd()) else None
            begin and begin()
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    def say(self, **what):
        with open(self.log, "a", encoding="utf-8") as log:
            log.write(json.dumps(what) + "\n")

    def take(self):
        """The mutants met since it was last asked."""
        if not self.met:
            return set()
        with open(self.met, "r+b") as file:
            found = {number for number, byte in enumerate(file.read()) if byte}
            file.seek(0)
            file.write(bytes(MOST))
        return found

    def play(self, tests):
        for number, ((item, most_s), after) in enumerate(zip(tests, [*tests[1:], (None, 0)])):
            if most_s:
                soft = int(_used_s(resource.RUSAGE_SELF) + most_s) + 1
                resource.setrlimit(resource.RLIMIT_CPU, (soft, resource.getrlimit(resource.RLIMIT_CPU)[1]))
            if self.met:
                os.environ["TWIN_REACH"] = str(Path(self.log).with_name(f"{number}.bits"))
            self.own, self.shared, self.shared_s = set(), set(), 0.0
            self.say(name=item.nodeid)
            before = _used_in_all_s()
            failed = any(report.failed for report in runtestprotocol(item, log=False, nextitem=after[0]))
            self.own |= self.take()
            used_s = round(_used_in_all_s() - before, 3)
            self.say(name=item.nodeid, failed=failed, cpu_s=used_s, shared_s=round(self.shared_s, 3),
                     met=sorted(self.own), shared=sorted(self.shared))
            if failed and not self.to_the_end:
                return


@pytest.hookimpl(hookwrapper=True)
def pytest_fixture_setup(fixturedef):
    """What serves several tests counts for all of the file, not for the test that happens to be the first.

    The CPU time as well: pytest sets up each fixture for itself, one after the other, so none is counted twice.
    """
    if _now is None or fixturedef.scope == "function":
        yield
        return
    _now.own |= _now.take()
    before = _used_in_all_s()
    yield
    _now.shared_s += _used_in_all_s() - before
    _now.shared |= _now.take()
