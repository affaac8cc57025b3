# SPDX-License-Identifier: MIT
"""What is known, kept from run to run: of tests on the tree as it is, and of each mutant."""
import json

from mutants.tree import digest, tracked

SOURCES = ("firmware/", "drivers/", "startup/", "lib/", "linker/", "qemu/", "Makefile", "docs/silicon.md")


class Lines:
    """{name: entry} in a file of one JSON object a line; the last of a name counts: an interrupted run loses nothing."""

    def __init__(self, path):
        self.path, self.known = path, {}
        for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
            try:
                entry = json.loads(line)
            except ValueError:
                continue  # the last line of a run that was cut off
            self.known[entry["name"]] = entry
        if path.exists() and not path.read_bytes().endswith(b"\n"):
            with open(path, "a", encoding="utf-8") as out:
                out.write("\n")

    def put(self, name, entry):
        self.known[name] = {"name": name, **entry}
        with open(self.path, "a", encoding="utf-8") as out:
            out.write(json.dumps(self.known[name]) + "\n")


class Store:
    """A mutant that was noticed stays so while its file, the test that noticed it and what all tests share are as they were.
    A survivor is judged anew when any source or test has changed; what a test takes and meets, when any source, what all
    tests share, the test's file or the mutants in the build have.
    """

    def __init__(self, folder, root, drawn=()):
        self.verdicts, self.tests = Lines(folder / "verdicts.jsonl"), Lines(folder / "tests.jsonl")
        names = tracked(root)
        self.texts = {name: digest((root / name).read_bytes()) for name in names if name.startswith((*SOURCES, "tests/"))}
        of_tests = {name for name in self.texts if name.startswith("tests/") and name.split("/")[-1].startswith("test_")}
        self.rigs = digest(*[self.texts[name] for name in sorted(self.texts)
                             if name.startswith("tests/") and name not in of_tests and not name.startswith("tests/mutants/")])
        self.sources = digest(*[self.texts[name] for name in sorted(self.texts) if name.startswith(SOURCES)])
        self.everything = digest(self.sources, self.rigs, *[self.texts[name] for name in sorted(of_tests)
                                                            if not name.startswith("tests/mutants/")])
        self.drawn = digest(*[mutant.identity for mutant in drawn])

    def verdict(self, mutant, rungs):
        """What is known of it if these rungs are asked; None if nothing is, or less."""
        entry = self.verdicts.known.get(mutant.identity)
        if not entry or entry["key"] != self._key(mutant, entry):
            return None
        return entry if entry["outcome"] != "survived" or set(rungs) <= set(entry["rungs"]) else None

    def asked(self, mutant):
        """The rungs that it has survived already."""
        entry = self.verdicts.known.get(mutant.identity)
        return set(entry["rungs"]) if entry and entry["outcome"] == "survived" and entry["key"] == self.everything else set()

    def put(self, mutant, entry):
        self.verdicts.put(mutant.identity, {**entry, "key": self._key(mutant, entry)})

    def _key(self, mutant, entry):
        if entry["outcome"] == "survived":
            return self.everything
        return digest(self.texts[mutant.file], self.rigs, self.texts.get(entry["by"].split("::")[0], ""))

    def test_key(self, test):
        return digest(self.sources, self.rigs, self.texts.get(test.file, ""), self.drawn)
