# SPDX-License-Identifier: MIT
"""The tests that a mutant has to pass: which concern it, in which order, and what they said."""
import json
import re
import shutil
import socket
import sys
import tomllib
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path

from mutants.tree import Trouble, last_lines

CPU_TIMES, CPU_MORE_S = 4, 5.0  # a test may take this much of what it took, and this much more
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
class Played:
    """One that has run."""
    name: str
    what: str             # "passed", or why not
    cpu_s: float = 0.0    # all of it
    shared_s: float = 0.0
    met: tuple = ()
    shared: tuple = ()


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

    def __init__(self, tree, rungs, name, core=None):
        self.tree, self.which = tree, None
        self.folder = tree.folder / f"serve_{rungs[0].name}_{name}"
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir()
        place = Path("/tmp") / f"mutants.{self.folder.stat().st_ino}"  # a socket's path is short
        place.unlink(missing_ok=True)
        with socket.socket(socket.AF_UNIX) as door:
            door.bind(str(place))
            door.listen(1)
            door.settimeout(1.0)
            files = [name for rung in rungs for name in rung.tests if (tree.root / name).exists()]
            command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "mutants.serve", "--rootdir=.",
                       "--confcutdir=.", f"--basetemp={self.folder / 'tmp'}", "--most", *files]
            self.said = self.folder / "pytest.txt"
            with open(self.said, "w") as said:
                self.process = tree.start(command if (tree.root / "tests/conftest.py").exists() else
                                          [word for word in command if word != "--most"],
                                          {"MUTANTS_SOCKET": str(place), "PYTHONPATH": PLUGINS}, core, stdout=said, stderr=said)
            self.stream = self._accepted(door).makefile("rw", encoding="utf-8")
            place.unlink()
        answer = json.loads(self.stream.readline())
        self.tests = [Test(name, rung) for name in answer["tests"]
                      if (rung := next((rung for rung in rungs if rung.has(name)), None))]
        if answer["broken"] or not self.tests:
            raise Trouble(f"rungs {', '.join(rung.name for rung in rungs)}: no tests\n{last_lines(self.said.read_text())}")

    def _accepted(self, door):
        while True:
            try:
                return door.accept()[0]
            except TimeoutError:
                if self.process.poll() is not None:
                    raise Trouble(f"pytest ended before any test:\n{last_lines(self.said.read_text())}") from None

    def play(self, tests, number=0, to_the_end=False):
        """Played ones in order, up to the first that did not pass unless to_the_end; number: of the mutant that counts."""
        log = self.folder / "log.jsonl"
        log.write_text("")
        limits = [[t.name, CPU_TIMES * t.most_s + CPU_MORE_S if t.cpu_s else 0] for t in tests]
        print(json.dumps({"tests": limits, "now": number, "log": str(log), "to_the_end": to_the_end, "met": to_the_end}),
              file=self.stream, flush=True)
        line = self.stream.readline()
        if not line:
            raise Trouble(f"pytest has ended:\n{last_lines(self.said.read_text())}")
        results, begun = [], None
        for entry in map(json.loads, log.read_text().splitlines()):
            begun = entry.get("start")
            if begun is None:
                results.append(Played(entry["end"], "failed" if entry["failed"] else "passed", entry["cpu_s"],
                                      entry["shared_s"], tuple(entry["met"]), tuple(entry["shared"])))
        if begun:
            results.append(Played(begun, f"did not end ({json.loads(line)['status']})"))
        return results

    def bits(self, tests):
        """{test: what the twin executed} of those that were played last."""
        return {test.name: file.read_bytes() for n, test in enumerate(tests) if (file := self.folder / f"{n}.bits").exists()}

    def clear(self):
        for file in self.folder.glob("*.bits"):
            file.unlink()


class Order:
    """Which test to ask first: the one that, as far as is known, notices most a second."""

    def __init__(self):
        self.asked, self.noticed = defaultdict(Counter), defaultdict(Counter)

    def learn(self, mutant, asked, noticed_by):
        for scope in self._scopes(mutant):
            self.asked[scope].update(asked)
            if noticed_by:
                self.noticed[scope][noticed_by] += 1

    @staticmethod
    def _scopes(mutant):
        return (f"{mutant.file}|{mutant.function}", mutant.file, str(Path(mutant.file).parent), "")

    def sorted(self, mutant, tests):
        return sorted(tests, key=lambda test: (-self._worth(mutant, test), test.name))

    def _worth(self, mutant, test):
        """The fewer come by this mutant and the fewer others this test comes by, the more likely it notices."""
        near = Path(mutant.file).stem in test.name
        noticed, asked = NEAR if near else FAR + NEAR / (1 + len(test.met)), 1.0
        for scope, weight in zip(self._scopes(mutant), (4.0, 2.0, 0.5, 0.2)):
            noticed += weight * self.noticed[scope][test.name]
            asked += weight * self.asked[scope][test.name]
        return noticed / asked / (test.most_s + 0.05)


def affordable(tests, budget_s):
    """The first of them that take no more CPU time than this; all without a budget."""
    left, files = budget_s, set()
    for n, test in enumerate(tests):
        left -= test.cpu_s if test.file in files else test.most_s
        files.add(test.file)
        if budget_s and left < 0:
            return tests[:n]
    return tests
