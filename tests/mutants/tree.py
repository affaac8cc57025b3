# SPDX-License-Identifier: MIT
"""A copy of the project: one with all mutants beside the original, chosen at run time; or one for one mutant after the other,
put in, built, compared and taken out again."""
import ast
import hashlib
import os
import shutil
import signal
import subprocess
from dataclasses import dataclass
from pathlib import Path

from mutants import reach
from mutants.choose import with_all

HERE = Path(__file__).resolve().parent
FOREIGN = ("MAKEFLAGS", "MFLAGS", "MAKELEVEL", "MOTOR", "SCENARIO", "SEED", "PLANT", "SPREAD", "DETUNE", "PROBE", "MUTANTS_NOW",
           "MUTANTS_MET")
BUILT = tuple(f"{name}/" for name in ("arm", "bringup", "fabric", "host", "packed", "qemu", "tests/target", "tests/unit"))
# No warning gives a mutant away. Programs of this machine are compiled with the selector; the controller's, from the same
# sources, never have a mutant that is chosen at run time.
SELECTING, ALONE = """\
#!/bin/sh
linked=yes
for word; do
    case $word in -c | -E | -S | -M | -MM | --version | -v | -print* | -dump*) linked= ;; esac
done
exec {compiler} -include {here}/selector.h "$@" ${{linked:+{folder}/selector.o}} -Wno-error
""", """\
#!/bin/sh
exec {compiler} '-DMUTANT(n)=0' "$@" -Wno-error
"""


@dataclass(frozen=True)
class Project:
    """What is built, and what of it is looked at."""
    root: Path
    make: tuple                # make and its options
    host: tuple                # what tests play on this machine
    image: tuple               # what they play on the controller, which its mutants change
    objects: tuple             # globs of the objects that the image is made of
    products: tuple            # globs of what tests run
    objcopy: str
    compiler: str = "cc"       # of the objects
    pytest: tuple = ()         # options: which of the tests are played


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


def mirror(source, target, names, keep=(), texts=None):
    """Makes `target` hold exactly `names` of `source`; top-level folders in `keep` are left alone.

    Files of one time and size are taken for the same, and copies have the time of what they are copied from. With `texts`, a
    file's text there counts instead of the source's, contents decide, and what is written is as new as it is.
    """
    for name in {*inside(target, keep)} - {*names}:
        (target / name).unlink()
    for name in names:
        one, two = source / name, target / name
        two.parent.mkdir(parents=True, exist_ok=True)
        if texts is not None and two.is_file():
            content = texts[name].encode() if name in texts else one.read_bytes()
            if two.read_bytes() != content:
                two.write_bytes(content)
        elif not two.is_file() or (one.stat().st_mtime_ns, one.stat().st_size) != (two.stat().st_mtime_ns, two.stat().st_size):
            shutil.copy2(one, two)


def inside(folder, without=()):
    """The files in it, by their paths there."""
    return [str(Path(place, name).relative_to(folder)) for place, _, names in os.walk(folder) for name in names
            if Path(place).relative_to(folder).parts[:1] not in [(one,) for one in without]]


class Tree:
    def __init__(self, project, folder):
        self.project, self.root = project, folder / "tree"
        self.folder, self.snapshot = folder, folder / "as_it_was"
        self.times, self.objects, self.products, self.running = None, {}, {}, set()
        (folder / "bin").mkdir(parents=True, exist_ok=True)
        host = os.environ.get("HOSTCC") or "cc"
        for name, compiler, text in (("cc", host, SELECTING), ("gcc", host, SELECTING), ("cc-arm", project.compiler, ALONE),
                                     ("arm-none-eabi-gcc", project.compiler, ALONE)):
            (folder / "bin" / name).write_text(text.format(compiler=shutil.which(compiler), here=HERE, folder=folder))
            (folder / "bin" / name).chmod(0o755)
        subprocess.run([host, "-O2", "-fPIC", "-c", HERE / "selector.c", "-o", folder / "selector.o"], check=True)

    def environment(self):
        """Without the user's choices."""
        kept = {key: value for key, value in os.environ.items() if key not in FOREIGN and not key.startswith("PYTEST_")}
        wrappers = self.folder / "bin"
        return {**kept, "BUILD": "build", "HOSTCC": str(wrappers / "cc"), "NO_INSTALL": "1", "PYTHONDONTWRITEBYTECODE": "1",
                "MAKEFLAGS": f"CC_ARM={wrappers / 'cc-arm'}", "PATH": f"{wrappers}:{os.environ['PATH']}"}

    def start(self, command, extra=None, **more):
        """A process of this tree."""
        process = subprocess.Popen(command, cwd=self.root, env={**self.environment(), **(extra or {})},
                                   stdin=subprocess.DEVNULL, start_new_session=True, **more)
        self.running = {one for one in self.running if one.poll() is None} | {process}
        return process

    def stop(self):
        """Ends what runs in this tree now, with all that it has started."""
        for process in self.running:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()

    def run(self, command):
        """(status, output)."""
        process = self.start(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
        output, _ = process.communicate()
        return process.returncode, output

    def build(self, targets):
        return self.run([*self.project.make, *targets])

    # ---- as it was, with all mutants beside it ----

    def prepare(self, targets, numbered=()):
        """The project, with these mutants beside the original, [(number, mutant)], built. What an interrupted run left goes."""
        source, texts = self.project.root, {}
        for file in {mutant.file for _, mutant in numbered}:
            text = (source / file).read_text(encoding="utf-8")
            texts[file] = headed(file, with_all(text, [(number, one) for number, one in numbered if one.file == file]))
        names = tracked(source)
        if not self.root.exists():
            mirror(source, self.root, names)
            mirror(source / "build", self.root / "build", [name for name in inside(source / "build", ("mutants",))
                                                           if "/" not in name or name.startswith(BUILT)])
        elif self.snapshot.exists():
            mirror(self.snapshot, self.root / "build", inside(self.snapshot))
        mirror(source, self.root, names, ("build",), texts)
        old = () if numbered else self._found(self.project.objects)  # which insert() builds, too
        if self.build((*targets, *old))[0]:  # perhaps of products whose sources are not there any more
            for folder in (self.root / "build", self.snapshot):
                shutil.rmtree(folder, ignore_errors=True)
            status, output = self.build(targets)
            if status:
                raise Trouble("the tree as it is does not build:\n" + last_lines(output))

    def keep(self):
        """Takes the present products as those to go back to."""
        mirror(self.root / "build", self.snapshot, inside(self.root / "build"))
        self.objects = {path: self._code(path) for path in self._found(self.project.objects)}
        self.products = {path: self._through_objcopy(path, "-O", "binary") for path in self._found(self.project.products)}

    def _found(self, globs):
        return sorted(str(p.relative_to(self.root)) for pattern in globs for p in self.root.glob(pattern))

    def _changed(self, path):
        one, two = self.root / path, self.snapshot / Path(path).relative_to("build")
        return not two.exists() or one.stat().st_mtime_ns != two.stat().st_mtime_ns

    def _code(self, path):
        """Of an object: everything but what is for the debugger."""
        return self._through_objcopy(path, "--strip-debug")

    def _through_objcopy(self, path, *options):
        out = self.folder / "objcopy.out"
        status = subprocess.run([self.project.objcopy, *options, str(self.root / path), str(out)], capture_output=True)
        return digest(out.read_bytes()) if status.returncode == 0 else digest((self.root / path).read_bytes())

    # ---- with one mutant in the image ----

    def insert(self, mutant):
        """'' if the image is another one now, or why there is none to be tested."""
        path = self.root / mutant.file
        text = path.read_text(encoding="utf-8")
        self.times = path.stat().st_atime_ns, path.stat().st_mtime_ns, text
        path.write_text(mutant.applied(text), encoding="utf-8")
        if self.build(self.objects)[0]:
            return "does not build"
        changed = [path for path in self.objects if self._changed(path)]
        if all(self._code(path) == self.objects[path] for path in changed):
            return "same code"
        return "does not build" if self.build(self.project.image)[0] else ""

    def changed_products(self):
        return {path for path in self._found(self.project.products)
                if self._changed(path) and self._through_objcopy(path, "-O", "binary") != self.products.get(path)}

    def changed_functions(self):
        """Those that differ, if nothing else does; else None."""
        paths = [path for path in self.objects if self._changed(path) and self._code(path) != self.objects[path]]
        return reach.changed_functions([(self.snapshot / Path(path).relative_to("build"), self.root / path) for path in paths],
                                       self.project.objcopy.replace("objcopy", "objdump"))

    def restore(self, mutant):
        """Source and products back, with their times, so that nothing is built or kept by mistake."""
        path = self.root / mutant.file
        if self.times:
            path.write_text(self.times[2], encoding="utf-8")
            os.utime(path, ns=self.times[:2])
        mirror(self.snapshot, self.root / "build", inside(self.snapshot))


def headed(file, text):
    """Python says what `_mutant` is before it uses it, on the line of the first statement that may stand behind it."""
    if not file.endswith(".py"):
        return text
    body = [node for node in ast.parse(text).body if not isinstance(getattr(node, "value", None), ast.Constant) and
            getattr(node, "module", "") != "__future__"]
    lines, first = text.split("\n"), min([body[0].lineno, *[one.lineno for one in getattr(body[0], "decorator_list", [])]]) - 1
    lines[first] = f"exec(open({str(HERE / 'selector.py')!r}).read())\n{lines[first]}"
    return "\n".join(lines)
