# SPDX-License-Identifier: MIT
"""Puts fault after fault into copies of the project, on all cores, and notes who notices."""
import functools
import shutil
import threading
import time
from dataclasses import replace

from mutants import reach
from mutants.choose import sequence, shares
from mutants.ladder import Order, Played, affordable, collect, concerned, play
from mutants.tree import Trouble

TRIES, TRIES_MORE = 4, 10  # so many faults of a file are tried for each that it owes
LISTED = {"outcome": "survived", "by": "", "how": "listed", "rung": "", "build_s": 0.0, "tests_s": 0.0}
PORTION = 8                # so many tests at least a worker takes at a time when the tree as it is runs them,
PART = 8                   # and this part of those that are left: the many short ones first, few at a time at the end


class Engine:
    """sources: what faults go into; trees: one for each worker; store: what is known; say: called with each line of it.

    listed: identities of those that are known to change nothing: survivors, without a trial that takes all tests there are.
    hints: {identity: test} of who noticed it elsewhere, to be asked first. budget_s: CPU time of tests that a mutant may take.
    """

    def __init__(self, sources, trees, rungs, store, seed, say, keep_going=False, listed=frozenset(), hints=None, budget_s=0.0):
        self.sources, self.trees, self.rungs, self.store, self.seed, self.say = sources, trees, rungs, store, seed, say
        self.listed, self.hints, self.budget_s = listed, hints or {}, budget_s
        self.entered = reach.Entered()
        self.keep_going, self.broken = keep_going, []  # tests that fail without any fault
        self.order, self.lock, self.prepared = Order(), threading.Lock(), set()
        self.waiting, self.tests, self.measured, self.bits = None, {}, {}, {}
        self.left, self.failure, self.judged, self.tried = {}, None, {}, {}
        for entry in store.known.values():
            self.order.learn(*entry["identity"].split("|")[:2], entry.get("asked", []), entry["by"])

    def run(self, count, files):
        """{identity: (fault, entry)} of `count` mutants, or as many as there are."""
        self.left = {file: sequence(self.sources.faults[file], self.seed, file) for file in files}
        weights = {file: self.sources.weights[file] for file in files if self.sources.faults[file]}
        owed = shares(weights, count, self.seed)
        while sum(owed.values()) and not self.failure:
            self.wanted = sum(owed.values()) + len(self.judged)
            self._share_out(owed)
            short = count - len(self.judged)
            rest = {file: weight for file, weight in weights.items() if self.left[file] is not None}
            owed = shares(rest, short, f"{self.seed}|{len(self.judged)}") if rest and short > 0 else {}
        if self.failure:
            raise self.failure
        return self.judged

    def plan(self, count, files):
        """The faults that would be tried first, without judging any."""
        weights = {file: self.sources.weights[file] for file in files if self.sources.faults[file]}
        for file, number in shares(weights, count, self.seed).items():
            for fault, _ in zip(sequence(self.sources.faults[file], self.seed, file), range(number)):
                yield file, fault

    def _share_out(self, owed):
        queue = sorted((file for file in owed if owed[file]), key=lambda file: (-owed[file], file))
        threads = [threading.Thread(target=self._work, args=(tree, queue, owed), daemon=True) for tree in self.trees]
        for thread in threads:
            thread.start()
        try:
            for thread in threads:
                while thread.is_alive():
                    thread.join(0.2)
        except BaseException:
            self.failure = KeyboardInterrupt()
            for tree in self.trees:
                tree.stop()
            raise

    def _work(self, tree, queue, owed):
        try:
            while not self.failure:
                with self.lock:
                    if not queue:
                        return
                    file = queue.pop(0)
                self._file(tree, file, owed[file])
        except BaseException as error:  # of a thread: the main one ends the run with it
            self.failure = self.failure or error

    def _file(self, tree, file, count):
        done = tried = 0
        while done < count and tried < TRIES * count + TRIES_MORE and not self.failure:
            fault = next(self.left[file], None)
            if fault is None:
                self.left[file] = None
                return
            tried += 1
            entry = LISTED if fault.identity in self.listed else self.store.get(fault)
            known = entry is not None
            entry = entry or self._judge(tree, fault)
            with self.lock:
                if not known:
                    self.store.put(fault, entry, tree.root)
                    self.order.learn(fault.file, fault.function, entry.get("asked", []), entry["by"])
                if entry["outcome"] in ("noticed", "survived"):
                    done += 1
                    self.judged[fault.identity] = (fault, entry)
                    self._tell(fault, entry, known)
                else:
                    self.tried[fault.identity] = (fault, entry)
        if done < count:
            self.left[file] = None

    def _tell(self, fault, entry, known):
        by = f" by {entry['by']}" if entry["by"] else ""
        took = "as listed" if entry is LISTED else "as before" if known else f"{entry['build_s'] + entry['tests_s']:.1f} s"
        count = f"{len(self.judged):4}/{self.wanted}"
        self.say(f"{count} {entry['outcome']} {fault.file}:{fault.line} {fault.kind}{by} ({took})")

    def _judge(self, tree, fault):
        self._ready(tree)
        begun = time.monotonic()
        try:
            none = tree.insert(fault, self.sources.texts[fault.file])
            built = time.monotonic()
            if none:
                return {"outcome": none, "by": "", "build_s": round(built - begun, 2), "tests_s": 0.0}
            tests, left_out = self._tests_for(tree, fault)
            results = play(tree, tests) if tests else []
        finally:
            tree.restore(fault.file, self.sources.texts[fault.file])
        last = results[-1] if results else Played("", "passed")
        by, what = last.name if last.what != "passed" else "", last.what
        what = f"{what}, and {left_out} tests were not asked" if left_out and not by else what
        return {"outcome": "noticed" if by else "survived", "by": by, "how": what, "rung": self.rung_of(by),
                "asked": [one.name for one in results], "cpu_s": round(sum(one.cpu_s for one in results), 2),
                "build_s": round(built - begun, 2), "tests_s": round(time.monotonic() - built, 2)}

    def _tests_for(self, tree, fault):
        """In the order in which they are asked, and how many are left out because they would take too long."""
        functions = tree.changed_functions()
        entered = reach.entered_by(fault, functions, self.entered.known())
        tests = concerned(self.measured.values(), tree.changed_products(), functions, entered)
        hint = self.hints.get(fault.identity)
        tests = sorted(self.order.sorted(fault, tests), key=lambda test: test.name != hint)
        asked = affordable(tests, self.budget_s)
        return asked, len(tests) - len(asked)

    def rung_of(self, name):
        for rung in self.rungs:
            if any(name.split("::")[0] == place or name.startswith(place.rstrip("/") + "/") for place in rung.tests):
                return rung.name
        return ""

    # ---- before the first mutant ----

    def _ready(self, tree):
        """Builds a worker's tree as it is, and takes its part in seeing that all tests pass there and how long they take."""
        if tree in self.prepared:
            return
        tree.prepare()
        with self.lock:
            if self.waiting is None:
                self._collect(tree)
        while not self.failure:
            with self.lock:
                taken = max(PORTION, len(self.waiting) // PART)
                portion, self.waiting = self.waiting[:taken], self.waiting[taken:]
            if not portion:
                break
            self._measure(tree, portion)
        tree.keep()
        while len(self.measured) < len(self.tests) and not self.failure:
            time.sleep(0.05)
        if self.failure:
            raise self.failure
        self.prepared.add(tree)

    def _collect(self, tree):
        tests = collect(tree, self.rungs)
        self.tests = {test.name: test for test in tests}
        self.waiting = tests
        self.say(f"{len(tests)} tests; first on the tree as it is")

    def _reach(self, tree):
        """What each test executes of the image, now that all have run."""
        if self.bits:
            functions_of = functools.cache(lambda product: reach.Functions(tree.root / product))
            known = reach.of_tests(functions_of, self.measured.values(), self.bits)
            self.measured = {name: replace(test, executes=known.get(name)) for name, test in self.measured.items()}
            self.say(f"{len(known)} of them execute functions of their image that are known")
        self.measured = {name: replace(test, enters=self.entered.of(test)) for name, test in self.measured.items()}
        self.order.all = tuple(self.measured.values())

    def _share(self):
        """Whichever of a file's tests comes first in a mutant pays for the fixtures that they share."""
        most_s = {}
        for test in self.measured.values():
            most_s[test.file] = max(most_s.get(test.file, 0.0), test.shared_s)
        self.measured = {name: replace(test, shared_s=most_s[test.file]) for name, test in self.measured.items()}

    def _measure(self, tree, portion):
        seen = tree.root.parent / "reach"
        shutil.rmtree(seen, ignore_errors=True)
        seen.mkdir()
        results = play(tree, portion, to_the_end=True, reach=seen)
        bits = {test.name: file.read_bytes() for n, test in enumerate(portion) if (file := seen / f"{n}.bits").exists()}
        failed = [one.name for one in results if one.what != "passed"]
        failed += sorted({test.name for test in portion} - {one.name for one in results})
        if failed and not self.keep_going:
            raise Trouble(f"the tree as it is does not pass {failed[0]}; mend that first, or leave it out by KEEP_GOING=1")
        with self.lock:
            self.broken += failed
            for name in failed:
                del self.tests[name]
                self.say(f"left out: {name} fails without any fault")
            self.measured |= {one.name: replace(self.tests[one.name], cpu_s=max(one.cpu_s - one.shared_s, 0.01),
                                                shared_s=one.shared_s) for one in results if one.name in self.tests}
            self.bits |= bits
            self.entered.take(tree.root, seen, portion)
            if len(self.measured) == len(self.tests):
                self.say(f"they take {sum(test.most_s for test in self.measured.values()):.0f} s of CPU")
                self._share()
                self._reach(tree)
