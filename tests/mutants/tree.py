# SPDX-License-Identifier: MIT
"""A worker's own copy of the project, in which one fault at a time is put in, built, compared, and taken out again."""
import hashlib
import os
import shutil
import signal
import subprocess
from dataclasses import dataclass
from pathlib import Path

from elftools.common.exceptions import ELFError

from mutants import reach

FOREIGN = ("MAKEFLAGS", "MFLAGS", "MAKELEVEL", "MOTOR", "SCENARIO", "SEED", "PLANT", "SPREAD", "DETUNE", "PROBE")
# no warning gives a mutant away, but what passes an integer for a pointer is not taken for C
WARNINGS = "-Werror=int-conversion -Werror=incompatible-pointer-types"
BUILT = tuple(f"{name}/" for name in ("arm", "bringup", "eds", "fabric", "host", "qemu", "tests/target", "tests/unit"))
WALL_S = 3600.0  # without a verdict by then the machine is at fault, not the mutant


@dataclass(frozen=True)
class Project:
    """What is built, and what of it is looked at."""
    root: Path
    make: tuple                # make and its options
    targets: tuple             # all products
    objects: tuple             # globs of the objects that the faults' files are compiled into
    products: tuple            # globs of what tests run
    objcopy: str
    compiler: str = "cc"       # of the objects


class Trouble(Exception):
    """Something is wrong with the project or the machine, not with a mutant; one line."""


def digest(*parts):
    total = hashlib.sha256()
    for part in parts:
        total.update(part if isinstance(part, bytes) else str(part).encode())
        total.update(b"\0")
    return total.hexdigest()[:20]


def last_lines(text):
    return "\n".join(text.splitlines()[-12:])


def tracked(root):
    """The project's files: what git knows or would take, and for a folder without git all of it but build/."""
    answer = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "-z"], cwd=root, capture_output=True, text=True)
    inside = subprocess.run(["git", "rev-parse", "--show-prefix"], cwd=root, capture_output=True, text=True)
    if answer.returncode == 0 and inside.returncode == 0 and not inside.stdout.strip():
        names = answer.stdout.split("\0")
    else:
        names = [str(p.relative_to(root)) for p in root.rglob("*") if "build" not in p.relative_to(root).parts[:1]]
    return sorted(name for name in names if name and (root / name).is_file())


def mirror(source, target, names, keep=(), same=None):
    """Makes `target` hold exactly `names` of `source` and returns what had to go; top-level folders in `keep` are left alone.

    Without `same`, files of one time and size are taken for the same, and copies have the time of what they are copied from.
    With it, it decides, and a copy is as new as it is.
    """
    wanted, gone = set(names), []
    if target.exists():
        for folder, folders, files in os.walk(target):
            here = Path(folder).relative_to(target)
            folders[:] = [name for name in folders if not (here == Path(".") and name in keep)]
            for name in files:
                if str(here / name) not in wanted:
                    os.unlink(target / here / name)
                    gone.append(str(here / name))
    for name in wanted:
        one, two = source / name, target / name
        if not (two.is_file() and (same or _same_time)(one, two)):
            two.parent.mkdir(parents=True, exist_ok=True)
            (shutil.copy if same else shutil.copy2)(one, two)
    return gone


def _same_time(one, two):
    a, b = one.stat(), two.stat()
    return a.st_mtime_ns == b.st_mtime_ns and a.st_size == b.st_size


def _same_content(one, two):
    return one.read_bytes() == two.read_bytes()


def inside(folder):
    return [str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()] if folder.exists() else []


class Tree:
    def __init__(self, project, folder, cpu=None):
        self.project, self.root, self.cpu = project, folder / "tree", cpu
        self.snapshot = folder / "as_it_was"
        self.group, self.times = None, None
        folder.mkdir(parents=True, exist_ok=True)
        for name, compiler in (("cc", os.environ.get("HOSTCC") or "cc"), ("cc-arm", project.compiler)):
            (folder / name).write_text(f'#!/bin/sh\nexec {compiler} "$@" -Wno-error {WARNINGS}\n')
            (folder / name).chmod(0o755)

    def environment(self):
        """Without the user's choices, and with warnings that are no errors for whatever is built on the way."""
        kept = {key: value for key, value in os.environ.items() if key not in FOREIGN and not key.startswith("PYTEST_")}
        return {**kept, "BUILD": "build", "HOSTCC": "../cc", "NO_INSTALL": "1", "MAKEFLAGS": "CC_ARM=../cc-arm",
                "PYTHONDONTWRITEBYTECODE": "1"}

    def run(self, command, extra=None):
        """(status, output); ends everything it started."""
        if self.cpu is not None:
            os.sched_setaffinity(0, {self.cpu})  # of this thread, and so of what it starts
        process = subprocess.Popen(command, cwd=self.root, env={**self.environment(), **(extra or {})}, text=True,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                   errors="replace", start_new_session=True)
        self.group = process.pid
        try:
            output, _ = process.communicate(timeout=WALL_S)
        except subprocess.TimeoutExpired as error:
            raise Trouble(f"'{' '.join(command[:4])} ...' has not ended after {WALL_S:g} s") from error
        finally:
            self.stop()
            process.wait()
        return process.returncode, output

    def stop(self):
        """Ends what runs in this tree now."""
        if self.group is not None:
            try:
                os.killpg(self.group, signal.SIGKILL)
            except ProcessLookupError:
                pass
            self.group = None

    # ---- as it was ----

    def prepare(self):
        """The project as it is, built. What an interrupted run left of a mutant goes first."""
        mirror(self.snapshot, self.root / "build", inside(self.snapshot))
        new = not self.root.exists()
        gone = mirror(self.project.root, self.root, tracked(self.project.root), ("build",), None if new else _same_content)
        if new:
            self._take_what_is_built()
        if gone or self.build(self.project.targets)[0]:  # perhaps of products whose sources are not there any more
            for folder in (self.root / "build", self.snapshot):
                shutil.rmtree(folder, ignore_errors=True)
            status, output = self.build(self.project.targets)
            if status:
                raise Trouble("the tree as it is does not build:\n" + last_lines(output))

    def _take_what_is_built(self):
        """Of the project itself, whose times the copies have: what is stale there is built here."""
        source = self.project.root / "build"
        names = [name for name in inside(source) if "/" not in name or name.startswith(BUILT)]
        mirror(source, self.root / "build", names)

    def build(self, targets):
        return self.run([*self.project.make, *targets])

    def keep(self):
        """Takes the present products as those to go back to."""
        mirror(self.root / "build", self.snapshot, inside(self.root / "build"))
        self.objects = {path: self._code(path) for path in self._found(self.project.objects)}
        self.products = {path: self._content(path) for path in self._found(self.project.products)}

    def _found(self, globs):
        return sorted(str(p.relative_to(self.root)) for pattern in globs for p in self.root.glob(pattern))

    def _changed(self, path):
        one, two = self.root / path, self.snapshot / Path(path).relative_to("build")
        return not two.exists() or one.stat().st_mtime_ns != two.stat().st_mtime_ns

    def _code(self, path):
        """Of an object: everything but what is for the debugger."""
        return self._through_objcopy(path, "--strip-debug")

    def _content(self, path):
        """Of a linked program: its bytes in memory."""
        return self._through_objcopy(path, "-O", "binary")

    def _through_objcopy(self, path, *options):
        out = self.root.parent / "objcopy.out"
        status = subprocess.run([self.project.objcopy, *options, str(self.root / path), str(out)], capture_output=True)
        return digest(out.read_bytes()) if status.returncode == 0 else digest((self.root / path).read_bytes())

    # ---- with a fault ----

    def insert(self, fault, text):
        """'' if there is a mutant to be tested now, or why there is none."""
        path = self.root / fault.file
        if path.read_text(encoding="utf-8") != text:
            raise Trouble(f"{fault.file} was changed while this ran; start it again")
        self.times = path.stat().st_atime_ns, path.stat().st_mtime_ns
        path.write_text(fault.applied(text), encoding="utf-8")
        if self.build(self.objects)[0]:  # alone: many a fault in a header changes none of them
            return "does not build"
        changed = [path for path in self.objects if self._changed(path)]
        if all(self._code(path) == self.objects[path] for path in changed):
            return "same code"
        return "does not build" if self.build(self.project.targets)[0] else ""

    def changed_products(self):
        return {path for path in self._found(self.project.products)
                if self._changed(path) and self._content(path) != self.products.get(path)}

    def changed_functions(self):
        """Those that differ, if nothing else does; else None."""
        paths = [path for path in self.objects if self._changed(path) and self._code(path) != self.objects[path]]
        pairs = [(self.snapshot / Path(path).relative_to("build"), self.root / path) for path in paths]
        try:
            return reach.changed_functions(pairs)
        except (ELFError, OSError):
            return None  # there is none now, or it is no ELF file

    def restore(self, file, text):
        """Source and products back, with their times, so that nothing is built or kept by mistake."""
        (self.root / file).write_text(text, encoding="utf-8")
        if self.times:
            os.utime(self.root / file, ns=self.times)
        mirror(self.snapshot, self.root / "build", inside(self.snapshot))
