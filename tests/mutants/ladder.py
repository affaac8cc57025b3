# SPDX-License-Identifier: MIT
"""The tests that a mutant has to pass: which concern it, in which order, and what they said."""
import json
import re
import shutil
import socket
import sys
import tomllib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from mutants.tree import Trouble, last_lines

CPU_TIMES, CPU_MORE_S = 4, 5.0  # a test may take this much of what it took, and this much more
ALIKE = 0.6  # of its worth a test has, for each case of the same function that is asked before it
NEAR, FAR = 0.3, 0.03      # how likely a test is to notice before anything is known: of a file of its name, of any other
PLUGINS = str(Path(__file__).resolve().parents[1])


@dataclass(frozen=True)
class Rung:
    name: str
    tests: tuple          # files and folders; those that are not there are left out
    product: str = ""     # of the controller, which it runs; [] stands for the test's parameter
    only: str = ""        # regular expressions of tests
    without: str = ""

    def has(self, name):
        return any(name.split("::")[0] == place or name.startswith(place.rstrip("/") + "/") for place in self.tests) and (
            not self.only or re.search(self.only, name)) and not (self.without and re.search(self.without, name))


@dataclass(frozen=True)
class Test:
    name: str             # as pytest has it: path::function[parameter]
    rung: Rung
    cpu_s: float = 0.0
    shared_s: float = 0.0       # CPU seconds more for the first of a file that is asked: fixtures that they share
    met: frozenset = frozenset()     # numbers of mutants that it comes by
    executes: frozenset = None  # functions of the image; None: unknown

    @property
    def file(self):
        return self.name.split("::")[0]

    @property
    def most_s(self):
        """As the first of its file."""
        return self.cpu_s + self.shared_s

    @property
    def product(self):
        """What it runs; "" where that is nothing of the controller's."""
        match = re.search(r"\[(.*)\]$", self.name)
        return self.rung.product.replace("[]", match[1] if match else "")


def load_rungs(path):
    with open(path, "rb") as stream:
        rows = tomllib.load(stream)["rung"]
    return [Rung(**{**row, "tests": tuple(row["tests"])}) for row in rows]


class Server:
    """pytest with these rungs' tests collected, in a tree; it plays what it is asked to in forks of itself (serve.py)."""

    def __init__(self, tree, rungs, name):
        self.tree = tree
        self.folder = tree.folder / f"serve_{rungs[0].name}_{name}"
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir()
        files = [name for rung in rungs for name in rung.tests if (tree.root / name).exists()]
        ours, theirs = socket.socketpair()
        self.said = self.folder / "pytest.txt"
        with open(self.said, "w") as said, theirs:
            tree.start([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "mutants.serve",
                        *tree.project.pytest, "--rootdir=.", "--confcutdir=.", f"--basetemp={self.folder / 'tmp'}", *files],
                       {"MUTANTS_LINK": str(theirs.fileno()), "PYTHONPATH": PLUGINS}, stdout=said, stderr=said,
                       pass_fds=[theirs.fileno()])
        self.stream = ours.makefile("rw", encoding="utf-8")
        answer = json.loads(self.stream.readline() or '{"tests": [], "broken": 1}')
        self.tests = [Test(name, rung) for name in answer["tests"]
                      if (rung := next((rung for rung in rungs if rung.has(name)), None))]
        if answer["broken"] or not self.tests:
            raise Trouble(f"rungs {', '.join(rung.name for rung in rungs)}: no tests\n{last_lines(self.said.read_text())}")

    def play(self, tests, number=0, to_the_end=False):
        """[{name, what: "passed" or why not, cpu_s, ...}] in order, up to the first that did not pass unless to_the_end.

        number   of the mutant that counts
        """
        log = self.folder / "log.jsonl"
        for file in (log, *self.folder.glob("*.bits")):
            file.unlink(missing_ok=True)
        limits = [[t.name, CPU_TIMES * t.most_s + CPU_MORE_S if t.cpu_s else 0] for t in tests]
        print(json.dumps({"tests": limits, "now": number, "log": str(log), "to_the_end": to_the_end, "met": to_the_end}),
              file=self.stream, flush=True)
        line = self.stream.readline()
        if not line:
            raise Trouble(f"pytest has ended:\n{last_lines(self.said.read_text())}")
        played = [json.loads(line) for line in log.read_text().splitlines()]
        results = [{**one, "what": "failed" if one["failed"] else "passed"} for one in played if "failed" in one]
        if played and "failed" not in played[-1]:
            results.append({**played[-1], "what": f"did not end ({json.loads(line)['status']})"})
        return results

    def bits(self, number):
        """What the n-th of those that were played last has executed at the twin; None: nothing."""
        file = self.folder / f"{number}.bits"
        return file.read_bytes() if file.exists() else None


class Order:
    """Which test to ask first: the one that, as far as is known, notices most a second."""

    def __init__(self):
        self.asked, self.noticed = Counter(), Counter()

    def learn(self, mutant, entry):
        for scope, _ in _scopes(mutant):
            self.asked.update((scope, name) for name in entry["asked"])
            self.noticed[scope, entry["by"]] += 1

    def sorted(self, mutant, tests, budget_s=0.0):
        """As many as take no more CPU time than this; all without a budget."""
        asked, files, left, alike = [], set(), budget_s, Counter()
        worth = {}
        for test in sorted(tests, key=lambda test: (-self._worth(mutant, test), test.name)):
            function = test.name.split("[")[0]
            worth[test] = self._worth(mutant, test) * ALIKE ** alike[function]
            alike[function] += 1
        for test in sorted(worth, key=worth.get, reverse=True):
            left -= test.cpu_s if test.file in files else test.most_s
            if budget_s and left < 0:
                break
            files.add(test.file)
            asked.append(test)
        return asked

    def _worth(self, mutant, test):
        """Before anything is known: one whose name has the file's, and one that comes by few others."""
        noticed, asked = NEAR if Path(mutant.file).stem in test.name else FAR + NEAR / (1 + len(test.met)), 1.0
        for scope, weight in _scopes(mutant):
            noticed += weight * self.noticed[scope, test.name]
            asked += weight * self.asked[scope, test.name]
        return noticed / asked / (test.most_s + 0.05)


def _scopes(mutant):
    """Of which mutants something is known, and how much that says of this one."""
    return (f"{mutant.file}|{mutant.function}", 4.0), (mutant.file, 2.0), (str(Path(mutant.file).parent), 0.5), ("", 0.2)
