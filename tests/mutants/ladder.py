# SPDX-License-Identifier: MIT
"""The tests that a mutant has to pass: which concern it, in which order, and what they said."""
import json
import re
import sys
import tomllib
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path

from mutants.tree import Trouble, digest, last_lines

CPU_TIMES, CPU_MORE_S = 4, 5.0  # a test may take this much of what it took, and this much more
NEAR, FAR = 0.3, 0.03      # how likely a test is to notice before anything is known: of a file of its name, of any other
PLUGINS = str(Path(__file__).resolve().parents[1])


@dataclass(frozen=True)
class Rung:
    name: str
    tests: tuple          # files and folders
    product: str = ""     # runs where this has changed; [] stands for the test's parameter
    only: str = ""        # regular expressions of tests
    without: str = ""


@dataclass(frozen=True)
class Played:
    """One that has run."""
    name: str
    what: str             # "passed", or why not
    cpu_s: float = 0.0    # all of it
    shared_s: float = 0.0


@dataclass(frozen=True)
class Test:
    name: str             # as pytest has it: path::function[parameter]
    rung: Rung
    cpu_s: float = 0.0
    shared_s: float = 0.0       # CPU seconds more for the first of a file that is asked: fixtures that they share
    executes: frozenset = None  # functions of the image; None: unknown
    enters: frozenset = None    # the same of the unit tests' libraries

    @property
    def file(self):
        return self.name.split("::")[0]

    @property
    def most_s(self):
        """As the first of its file."""
        return self.cpu_s + self.shared_s

    @property
    def parameter(self):
        match = re.search(r"\[(.*)\]$", self.name)
        return match[1] if match else ""

    @property
    def product(self):
        """What it runs; "" where that is no product."""
        return self.rung.product.replace("[]", self.parameter)


def load_rungs(path):
    with open(path, "rb") as stream:
        rows = tomllib.load(stream)["rung"]
    return [Rung(**{**row, "tests": tuple(row["tests"])}) for row in rows]


def pytest_command(files, folder, *options):
    """Relative to a tree's root."""
    return [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir=.", "--confcutdir=.",
            f"--basetemp={folder}", *options, *files]


def collect(tree, rungs):
    """Every test of the ladder."""
    tests = []
    for rung in rungs:
        files = [name for name in rung.tests if (tree.root / name).exists()]
        if not files:
            continue
        status, output = tree.run(pytest_command(files, "build/tmp", "--collect-only"))
        names = [line for line in output.splitlines() if "::" in line and not line.startswith(("ERROR", "FAILED"))]
        chosen = [n for n in names if (not rung.only or re.search(rung.only, n)) and
                  not (rung.without and re.search(rung.without, n))]
        if status or not chosen:
            raise Trouble(f"rung '{rung.name}' has no tests, pytest ended with {status}:\n{last_lines(output)}")
        tests += [Test(name, rung) for name in dict.fromkeys(chosen) if name not in {t.name for t in tests}]
    if not tests:
        raise Trouble("no rung of the ladder has a test")
    return tests


def play(tree, tests, to_the_end=False, reach=None):
    """Played ones in order, up to the first that did not pass unless to_the_end.

    reach   a folder for what the twin executes in each
    """
    plan, log = tree.root.parent / "plan.json", tree.root.parent / "log.jsonl"
    plan.write_text(json.dumps([[t.name, CPU_TIMES * t.most_s + CPU_MORE_S if t.cpu_s else 0] for t in tests]))
    log.write_text("")
    files = list(dict.fromkeys(test.file for test in tests))
    command = pytest_command(files, "build/tmp", "-p", "mutants.watch", *([] if to_the_end else ["-x"]))
    told = {"MUTANTS_PLAN": str(plan), "MUTANTS_LOG": str(log), "MUTANTS_REACH": str(reach or ""), "PYTHONPATH": PLUGINS}
    status, output = tree.run(command, told)
    results, begun = [], None
    for line in log.read_text().splitlines():
        entry = json.loads(line)
        if "start" in entry:
            begun = entry["start"]
        else:
            what = "failed" if entry["failed"] else "passed"
            results.append(Played(entry["end"], what, entry["cpu_s"], entry["shared_s"]))
            begun = None
    if begun:
        results.append(Played(begun, f"did not end (status {status})"))
    elif status == 2 and not results:
        match = re.search(r"ERROR (tests/\S+?\.py|\S+\.py)", output)
        results.append(Played(match[1] if match else files[0], "could not be collected"))
    elif status not in (0, 1) or not results or (status == 1 and all(r.what == "passed" for r in results)):
        raise Trouble(f"pytest ended with {status}:\n" + last_lines(output))
    return results


class Order:
    """Which test to ask first: the one that, as far as is known, notices most a second."""

    def __init__(self):
        self.all = ()  # tests that there are
        self.asked, self.noticed = defaultdict(Counter), defaultdict(Counter)

    def learn(self, file, function, asked, noticed_by):
        for scope in self._scopes(file, function):
            self.asked[scope].update(asked)
            if noticed_by:
                self.noticed[scope][noticed_by] += 1

    @staticmethod
    def _scopes(file, function):
        return (f"{file}|{function}", file, str(Path(file).parent), "")

    def sorted(self, fault, tests):
        """The fewer execute or enter what has changed, the more likely one of them notices."""
        few = {what: self._few(tests, what) for what in ("executes", "enters")}
        return sorted(tests, key=lambda test: (-self._worth(fault, test, few), test.name))

    def _few(self, tests, what):
        every, these = (sum(getattr(test, what) is not None for test in some) for some in (self.all, tests))
        return 1 - these / max(every, 1)

    def _worth(self, fault, test, few):
        near = Path(fault.file).stem in test.name
        share = max(few[what] if getattr(test, what) else 0.0 for what in few)
        noticed, asked = NEAR if near else max(FAR, NEAR * share), 1.0
        for scope, weight in zip(self._scopes(fault.file, fault.function), (4.0, 2.0, 0.5, 0.2)):
            noticed += weight * self.noticed[scope][test.name]
            asked += weight * self.asked[scope][test.name]
        return noticed / asked / (test.most_s + 0.05)


def concerned(tests, changed, functions=None, entered=None):
    """The tests whose product has changed, and those of no product: they compile the sources themselves.

    functions   those that have changed, and nothing else has: tests that execute none of them are left out
    entered     the same of the unit tests' libraries
    """
    return [test for test in tests
            if (not test.product or test.product in changed) and
            (functions is None or test.executes is None or functions & test.executes) and
            (entered is None or test.enters is None or entered & test.enters)]


def affordable(tests, budget_s):
    """The first of them that take no more CPU time than this; all without a budget."""
    left, files = budget_s, set()
    for n, test in enumerate(tests):
        left -= test.cpu_s if test.file in files else test.most_s
        files.add(test.file)
        if budget_s and left < 0:
            return tests[:n]
    return tests


def material(root, name):
    """A hash of what a test is made of, as far as its folder goes."""
    test = Test(name, None)
    path = root / test.file
    others = [p for p in sorted(path.parent.glob("*")) if p.is_file() and
              (p == path or not p.name.startswith("test_") or p.stem == test.parameter)]
    return digest(*[p.read_bytes() for p in others]) if path.exists() else ""
