# SPDX-License-Identifier: MIT
"""A plugin for pytest: runs the tests it is told to in the order it is told, and writes down how each began and ended.

MUTANTS_PLAN    a JSON file, [[test, seconds of CPU it may take], ...]
MUTANTS_LOG     where to, one JSON object a line: {"start": test}, {"end": test, "failed": bool, "cpu_s": seconds,
                "shared_s": those of them that fixtures took which other tests use, too}
MUTANTS_REACH   if set, a folder for what the n-th test of the plan executed: n.bits of the twin (qemu/twin/reach.h);
                n.*.LIBRARY.places of the unit tests' libraries (tests/unit/host/reach.c), file-n.*.LIBRARY.places of what a
                fixture did for several tests, of which this is the first

A test that does not end is stopped by its CPU time, never by the clock on the wall; what it started inherits the limit.
"""
import ctypes
import itertools
import json
import os
import resource
from pathlib import Path

import pytest

_limits = dict(json.load(open(os.environ["MUTANTS_PLAN"], encoding="utf-8")))
_numbers = {name: number for number, name in enumerate(_limits)}
_reach = os.environ.get("MUTANTS_REACH")
_failed = set()
_now, _parts = 0, itertools.count()
_shared_s = 0.0
LIBRARIES = ("firmware", "system")


def _say(**what):
    with open(os.environ["MUTANTS_LOG"], "a", encoding="utf-8") as log:
        log.write(json.dumps(what) + "\n")


def _used_s(who):
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def _used_in_all_s():
    return _used_s(resource.RUSAGE_SELF) + _used_s(resource.RUSAGE_CHILDREN)


def _take(stem):
    """What has been entered of the libraries that are loaded goes to files of this stem; without one it is forgotten."""
    for name in LIBRARIES if _reach else ():
        path = Path(os.environ.get("BUILD", "build")) / "tests" / "unit" / f"{name}.so"
        try:
            library = ctypes.CDLL(str(path.resolve()), mode=os.RTLD_NOLOAD)
        except OSError:
            continue  # nobody has loaded it
        library.host_reach_take(f"{_reach}/{stem}.{name}.places".encode() if stem else None)


@pytest.hookimpl(hookwrapper=True)
def pytest_fixture_setup(fixturedef):
    """What serves several tests counts for all of the file, not for the test that happens to be the first.

    The CPU time as well: pytest sets up each fixture for itself, one after the other, so none is counted twice.
    """
    global _shared_s
    several = fixturedef.scope != "function"
    if several:
        _take(f"{_now}.{next(_parts)}")
    before = _used_in_all_s()
    yield
    if several:
        _shared_s += _used_in_all_s() - before
        _take(f"file-{_now}.{next(_parts)}")


def pytest_unconfigure():
    os.environ.pop("UNIT_REACH", None)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    found = {item.nodeid: item for item in items}
    items[:] = [found[name] for name in _limits if name in found]
    config.hook.pytest_deselected(items=[item for name, item in found.items() if name not in _limits])


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item):
    global _now, _shared_s
    _shared_s = 0.0
    if _limits[item.nodeid]:
        soft = int(_used_s(resource.RUSAGE_SELF) + _limits[item.nodeid]) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (soft, resource.getrlimit(resource.RLIMIT_CPU)[1]))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if _reach:
        _now = _numbers[item.nodeid]
        os.environ["TWIN_REACH"] = f"{_reach}/{_now}.bits"
        os.environ["UNIT_REACH"] = f"{_reach}/{_now}"
    _take(None)
    _say(start=item.nodeid)
    before = _used_in_all_s()
    yield
    _take(f"{_now}.{next(_parts)}")
    _say(end=item.nodeid, failed=item.nodeid in _failed, cpu_s=round(_used_in_all_s() - before, 3),
         shared_s=round(_shared_s, 3))


def pytest_runtest_logreport(report):
    if report.failed:
        _failed.add(report.nodeid)
