# SPDX-License-Identifier: MIT
"""Has the tests judge mutant after mutant, on all cores: first those of this machine, where all mutants stand in one build,
then, of what nobody has noticed, those of the controller's image."""
import functools
import itertools
import subprocess
import threading
import time
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace

from mutants import reach
from mutants.ladder import Order, Server
from mutants.tree import Tree

HOST_PART = 0.3        # of BUDGET: what runs here takes less
PORTION, PART = 4, 6  # a worker takes so many tests at a time on the tree as it is, or this part of those that are left


class Engine:
    """drawn: all of the draw, each with its number in the build; store: what is known; say: called with each line of it.

    budget_s: CPU time of tests that a mutant may take of the image's, HOST_PART of it of others; 0: all.
    """

    def __init__(self, project, folder, drawn, rungs, store, say, jobs=1, budget_s=0.0):
        self.project, self.folder, self.rungs, self.store, self.say = project, folder, rungs, store, say
        self.numbers = {mutant.identity: number for number, mutant in enumerate(drawn, 1)}
        self.drawn, self.jobs, self.budget_s = drawn, jobs, budget_s
        self.order, self.lock, self.ended = Order(), threading.Lock(), False
        self.tests, self.broken, self.judged = {}, [], {}
        self.whole, self.servers, self.trees = None, {}, []
        for mutant in drawn:
            if mutant.identity in store.verdicts.known:
                self.order.learn(mutant, store.verdicts.known[mutant.identity])

    def run(self, wanted):
        """{identity: (mutant, entry)} of these."""
        names = [rung.name for rung in self.rungs]
        waiting = []
        for mutant in wanted:
            known = self.store.verdict(mutant, names)
            if known:
                self._done(mutant, known, "as before")
            else:
                waiting.append(mutant)
        try:
            host, image = ([rung for rung in self.rungs if bool(rung.product) == what] for what in (False, True))
            waiting = self._stage(waiting, host, self._beside, final=not image)
            plant = [mutant for mutant in waiting if mutant.file.startswith("qemu/")]
            self._stage(plant, image, self._beside, final=True)
            self._stage([mutant for mutant in waiting if mutant not in plant], image, self._built, final=True)
        finally:
            for tree in self.trees:
                tree.stop()
        return self.judged

    def _tree(self, name):
        self.trees.append(Tree(self.project, self.folder / name))
        return self.trees[-1]

    def _stage(self, waiting, rungs, judge, final):
        """Those that none of these rungs has noticed."""
        names = {rung.name for rung in rungs}
        left = [mutant for mutant in waiting if not names <= self.store.asked(mutant)]
        if left:
            self._measure(rungs)
            self._each(list(left), functools.partial(judge, rungs), self._workers(judge, rungs), final)
        return [mutant for mutant in waiting if mutant not in left or
                self.store.verdicts.known[mutant.identity]["outcome"] == "survived"]

    def _each(self, queue, judge, makers, final):
        """Judges all of them, a thread for each worker."""
        def judged(worker):
            while not self.ended:
                with self.lock:
                    if not queue:
                        return
                    mutant = queue.pop(0)
                entry = judge(worker, mutant)
                with self.lock:
                    entry["rungs"] = sorted({*entry["rungs"], *self.store.asked(mutant)})
                    self.store.put(mutant, entry)
                    self.order.learn(mutant, entry)
                    if final or entry["outcome"] != "survived":
                        self._done(mutant, entry, f"{entry['build_s'] + entry['tests_s']:.1f} s")

        self._threads(makers, judged)

    def _threads(self, makers, work):
        """One for each worker, which its maker makes there."""
        with ThreadPoolExecutor(len(makers)) as pool:
            try:
                for done in as_completed([pool.submit(lambda maker=maker: work(maker())) for maker in makers]):
                    done.result()
            except BaseException:  # of the first thread that fails, or of a person who ends it
                self.ended = True
                for tree in self.trees:
                    tree.stop()
                raise

    def _done(self, mutant, entry, took):
        self.judged[mutant.identity] = (mutant, entry)
        by = f" by {entry['by']}" if entry["by"] else ""
        self.say(f"{len(self.judged):4} {entry['outcome']} {mutant.file}:{mutant.line} {mutant.kind}{by} ({took})")

    def _workers(self, judge, rungs):
        maker = self._server if judge == self._beside else self._own_tree
        return [functools.partial(maker, rungs, number) for number in range(self.jobs)]

    # ---- where all mutants stand beside the original ----

    def _server(self, rungs, number):
        with self.lock:
            if self.whole is None:
                self.say(f"one build with {len(self.numbers)} mutants beside the original")
                self.whole = self._tree("all")
                targets = {self.project.image if rung.product else self.project.host for rung in self.rungs}
                self.whole.prepare(sum(targets, ()), [(self.numbers[one.identity], one) for one in self.drawn if one.slot])
        key = (rungs[0].name, number)
        if key not in self.servers:
            self.servers[key] = Server(self.whole, rungs, f"{number}")
        return self.servers[key]

    def _measure(self, rungs):
        """How long each test takes on the tree as it is and which mutants it comes by, as far as that is not known."""
        waiting = None

        def measured(server):
            nonlocal waiting
            with self.lock:
                if waiting is None:
                    new = {test.name: test for test in server.tests if test.name not in self.tests}
                    self.tests |= new
                    waiting = [test for test in new.values()
                               if self.store.tests.known.get(test.name, {}).get("key") != self.store.test_key(test)]
                    self.say(f"{len(new)} tests, {len(waiting)} of them first on the tree as it is")
            while not self.ended:
                with self.lock:
                    taken = max(PORTION, len(waiting) // PART // self.jobs)
                    portion, waiting = waiting[:taken], waiting[taken:]
                if not portion:
                    return
                self._portion(server, portion)

        self._threads(self._workers(self._beside, rungs), measured)
        self._take(rungs)

    def _portion(self, server, portion):
        results = server.play(portion, to_the_end=True)
        for number, (test, one) in enumerate(itertools.zip_longest(portion[:max(1, len(results))], results)):
            bits, executes = server.bits(number), ()
            if bits and test.product:
                executes = reach.Functions(server.tree.root / test.product).executed(bits)
            with self.lock:
                if one and one["what"] == "passed":
                    self.store.tests.put(test.name, {
                        "key": self.store.test_key(test), "cpu_s": max(one["cpu_s"] - one["shared_s"], 0.01),
                        "executes": sorted(executes), **{key: one[key] for key in ("shared_s", "met", "shared")}})
                else:
                    self.broken.append(test.name)
                    self.say(f"left out: {test.name} fails without any mutant")
        if 0 < len(results) < len(portion):  # the last of them has ended all
            self._portion(server, portion[len(results):])

    def _take(self, rungs):
        """What is known of each test; fixtures and images that a file's tests share count for all of them."""
        self.tests = {name: test for name, test in self.tests.items() if name not in self.broken}
        known = {name: self.store.tests.known[name] for name in self.tests}
        shared, most_s, executed = defaultdict(set), defaultdict(float), defaultdict(set)
        for name, entry in known.items():
            file = name.split("::")[0]
            shared[file].update(entry["shared"])
            most_s[file] = max(most_s[file], entry["shared_s"])
            executed[file].update(entry["executes"])
        for name, entry in known.items():
            test = self.tests[name]
            self.tests[name] = replace(
                test, cpu_s=entry["cpu_s"], shared_s=most_s[test.file], met=frozenset({*entry["met"], *shared[test.file]}),
                executes=frozenset(entry["executes"] or executed[test.file]) or None)
        self.say(f"they take {sum(test.cpu_s for test in self.tests.values() if test.rung in rungs):.0f} s of CPU")

    def _beside(self, rungs, server, mutant):
        number, survived = self.numbers[mutant.identity], self.store.asked(mutant)
        tests = [test for test in self.tests.values()
                 if number in test.met and test.rung in rungs and test.rung.name not in survived]
        entry = self._played(rungs, server, mutant, tests, number)
        same = entry["outcome"] == "survived" and same_assembly(self.project, mutant)
        return self._entry(rungs, "same code") if same else entry

    def _played(self, rungs, server, mutant, tests, number=0, begun=None):
        built = time.monotonic()
        asked = self.order.sorted(mutant, tests, self.budget_s * (1 if rungs[0].product else HOST_PART))
        results = server.play(asked, number) if asked else []
        by = next((one for one in results if one["what"] != "passed"), None)
        how = by["what"] if by else "no test comes by it" if not tests else (
            f"passed, and {len(tests) - len(asked)} tests were not asked" if len(tests) > len(asked) else "passed")
        rung = next((rung.name for rung in rungs if by and rung.has(by["name"])), "")
        return self._entry(rungs, "noticed" if by else "survived", by["name"] if by else "", how, rung,
                           [one["name"] for one in results], built - (begun or built), time.monotonic() - built)

    @staticmethod
    def _entry(rungs, outcome, by="", how="", rung="", asked=(), build_s=0.0, tests_s=0.0):
        return {"outcome": outcome, "by": by, "how": how, "rung": rung, "rungs": [one.name for one in rungs],
                "asked": list(asked), "build_s": round(build_s, 2), "tests_s": round(tests_s, 2)}

    # ---- one after the other in the image ----

    def _own_tree(self, rungs, number):
        tree = self._tree(f"w{number}")
        tree.prepare(self.project.image)
        tree.keep()
        return Server(tree, rungs, "image")

    def _built(self, rungs, server, mutant):
        begun, tree = time.monotonic(), server.tree
        try:
            none = tree.insert(mutant)
            if none:
                return self._entry(rungs, none, build_s=time.monotonic() - begun)
            changed, functions = tree.changed_products(), tree.changed_functions()
            tests = [test for test in self.tests.values() if test.rung in rungs and test.product in changed and
                     (functions is None or test.executes is None or functions & test.executes)]
            return self._played(rungs, server, mutant, tests, begun=begun)
        finally:
            tree.restore(mutant)


def same_assembly(project, mutant):
    """Whether a C file compiles to the same; a header's mutant, and one that is not C, is taken for another program."""
    if not mutant.file.endswith(".c"):
        return False
    plant = mutant.file.startswith("qemu/")
    target = [] if plant else ["-mcpu=cortex-m3", "-mthumb", "-ffreestanding", "-DLIB_TRIG_FRAC=15", '-DCONFIG_COMMIT="none"']
    text, made = (project.root / mutant.file).read_text(encoding="utf-8"), []
    for source in (text, mutant.applied(text)):
        done = subprocess.run(["cc" if plant else project.compiler, *target, "-std=gnu11", "-O2", "-w", "-S", "-x", "c",
                               f"-I{project.root}", f"-I{(project.root / mutant.file).parent}", "-", "-o", "-",
                               *(f"-I{project.root}/build/{place}" for place in ("packed/1", "fabric", "bringup"))],
                              input=source, capture_output=True, text=True)
        made.append(done.stdout if done.returncode == 0 else source)
    return made[0] == made[1]
