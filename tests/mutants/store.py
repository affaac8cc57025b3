# SPDX-License-Identifier: MIT
"""What is known of each mutant, kept from run to run. What was judged of other sources or other tests is done again."""
import json

from mutants.ladder import material
from mutants.tree import digest, tracked


class Store:
    """One JSON object a line; the last of a mutant counts, so that an interrupted run loses nothing.

    A fault that was noticed stays noticed while its file and the test that noticed it are as they were. Everything else is
    judged anew when any source or test has changed.
    """

    def __init__(self, path, root, sources, everything):
        self.path, self.root, self.sources, self.everything = path, root, sources, everything
        self.known = {}
        if path.exists():
            for line in path.read_text(encoding="utf-8").splitlines():
                try:
                    entry = json.loads(line)
                except ValueError:
                    continue  # the last line of a run that was cut off
                self.known[entry["identity"]] = entry

    def get(self, fault):
        entry = self.known.get(fault.identity)
        return entry if entry and entry["key"] == self._key(fault, entry, self.root) else None

    def put(self, fault, entry, root):
        """root: of the tree that it was judged in."""
        entry = {"identity": fault.identity, **entry}
        entry["key"] = self._key(fault, entry, root)
        self.known[fault.identity] = entry
        with open(self.path, "a", encoding="utf-8") as out:
            out.write(json.dumps(entry) + "\n")

    def _key(self, fault, entry, root):
        if entry["outcome"] == "noticed":
            return digest(self.sources[fault.file], material(root, entry["by"]))
        return self.everything


def fingerprint(root, folders):
    """A hash of every file of the project in these folders, or of this name."""
    names = [name for name in tracked(root) if any(name == f or name.startswith(f.rstrip("/") + "/") for f in folders)]
    return digest(*[part for name in names for part in (name, (root / name).read_bytes())])
