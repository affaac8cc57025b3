# SPDX-License-Identifier: MIT
"""A plugin for pytest: runs the tests it is told to in the order it is told, and writes down how each began and ended.

MUTANTS_PLAN    a JSON file, [[test, seconds of CPU it may take], ...]
MUTANTS_LOG     where to, one JSON object a line: {"start": test}, {"end": test, "failed": bool, "cpu_s": seconds}
MUTANTS_REACH   if set, a folder for what the twin executed in the n-th test of the plan: n.bits (qemu/twin/reach.h)

A test that does not end is stopped by its CPU time, never by the clock on the wall; what it started inherits the limit.
"""
import json
import os
import resource

import pytest

_limits = dict(json.load(open(os.environ["MUTANTS_PLAN"], encoding="utf-8")))
_numbers = {name: number for number, name in enumerate(_limits)}
_reach = os.environ.get("MUTANTS_REACH")
_failed = set()


def _say(**what):
    with open(os.environ["MUTANTS_LOG"], "a", encoding="utf-8") as log:
        log.write(json.dumps(what) + "\n")


def _used_s(who):
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def _used_in_all_s():
    return _used_s(resource.RUSAGE_SELF) + _used_s(resource.RUSAGE_CHILDREN)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    found = {item.nodeid: item for item in items}
    items[:] = [found[name] for name in _limits if name in found]
    config.hook.pytest_deselected(items=[item for name, item in found.items() if name not in _limits])


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item):
    if _limits[item.nodeid]:
        soft = int(_used_s(resource.RUSAGE_SELF) + _limits[item.nodeid]) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (soft, resource.getrlimit(resource.RLIMIT_CPU)[1]))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if _reach:
        os.environ["TWIN_REACH"] = f"{_reach}/{_numbers[item.nodeid]}.bits"
    _say(start=item.nodeid)
    before = _used_in_all_s()
    yield
    _say(end=item.nodeid, failed=item.nodeid in _failed, cpu_s=round(_used_in_all_s() - before, 3))


def pytest_runtest_logreport(report):
    if report.failed:
        _failed.add(report.nodeid)
