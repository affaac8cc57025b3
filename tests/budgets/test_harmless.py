# SPDX-License-Identifier: MIT
"""What changes nothing trips nothing: four harmless changes, each by itself in a copy of the project.

Each moves code or members by some bytes, and with them lines of flash, waits and the thread's cycles. Compared is with the
image as it is, not with the budgets, whose slack others may have used: what a change moves must stay within that slack, the
motor must start in the same millisecond, and the default run must keep its limits and its quality.
"""
import fcntl
import json
import os
import re
import shutil
import subprocess
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from bench.measure import ZERO_WAIT, read_table, run_image
from budgets.figures import complaints, sizes, stacks
from budgets.quality import complaints as quality_complaints
from budgets.quality import failure, load_quality, mean_of
from launcher import simulate
from launcher.paths import build_dir
from mutants.tree import mirror, tracked

ROOT = Path(__file__).resolve().parents[2]
MOTOR, SCENARIO = "teknic_m2310p", "default"
PRODUCTS = ("mssfoc.elf", "mssfoc.hex", "bench.elf", "bench.hex")
QUALITY = load_quality()
VALUES = QUALITY["values"][MOTOR][SCENARIO]
SAME_S = 1e-6  # the slow loop's own way to the gates may be some cycles longer; a sample later is 50 us


def rename_a_static_function(text):
    """The first of the file, at every place."""
    name = re.search(r"(?m)^static (?!inline)[\w ]+?\**(\w+)\(", text).group(1)
    return re.sub(rf"\b{name}\b", f"{name}_by_another_name", text)


def add_constants(text):
    """64 bytes that nobody uses, and that stay: EXTERN() in the linker's script asks for them."""
    return text + "\nextern const uint8_t nobody_uses[64];\nconst uint8_t nobody_uses[64] = {1, 2, 3};\n"


def keep_constants(text):
    return text + "\nEXTERN(nobody_uses)\n"


def exchange_two_members(text):
    """Of struct axis, two neighbours beyond what the interrupt's assembly reaches: all between them and the end moves."""
    whole = re.search(r"(?s)\nstruct axis \{.*?\n\};", text).group()
    pair = re.search(r"(?s)( struct hall hall;\n.*?\n)(    struct (?!hall\b)\w+ \w+;\n)(    struct \w+ \w+;\n)", whole)
    return text.replace(pair.group(), pair.group(1) + pair.group(3) + pair.group(2))


def lengthen_a_message(text):
    return re.sub(r'''(X\(\d+, \w+, "[a-z]\w* [\w ,;']+)("\))''', r"\1, as it happens\2", text, count=1)


CHANGES = {
    "a static function renamed": {"firmware/drive/start.c": rename_a_static_function},
    "64 bytes of constants": {"firmware/drive/states.c": add_constants, "linker/m2s010.ld": keep_constants},
    "two members exchanged": {"firmware/axis/axis.h": exchange_two_members},
    "a longer message": {"firmware/settings/error.h": lengthen_a_message},
}


def said_commit():
    """What the image says of its sources, so that a copy without git says the same."""
    said = subprocess.run(["sh", ".ci/commit"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return said.replace("+", " ")


def copied_project(folder, edits):
    """A copy with these texts, and with the products of the build, of which make renews what the edits touch."""
    own, names = build_dir(), [name for name in tracked(ROOT) if not name.startswith(("docs/", "tests/closed_loop"))]
    mirror(ROOT, folder, names)
    for part in ("arm", "bench", "packed", "fabric"):
        shutil.copytree(own / part, folder / "build" / part, symlinks=True, ignore=shutil.ignore_patterns("run*", "lockstep"))
    for part in ("choices", "commit.h", "libmssfoc.a"):
        shutil.copy2(own / part, folder / "build" / part)
    (folder / "build/qemu").symlink_to((own / "qemu").resolve())
    (folder / ".ci/archived").write_text(said_commit())
    for name, edit in edits.items():
        before = (folder / name).read_text()
        try:
            after = edit(before)
        except AttributeError:
            after = before
        assert after != before, f"{name} has no place any more for this change; {edit.__name__}() has to look for another"
        (folder / name).write_text(after)
    return folder / "build"


def built(folder, edits):
    build = copied_project(folder, edits)
    done = subprocess.run(["make", "-s", "-j2", "NO_INSTALL=1", *(f"build/{name}" for name in PRODUCTS)], cwd=folder,
                          env={**os.environ, "BUILD": "build"}, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    assert done.returncode == 0, done.stderr[-2000:]
    return build


def figures_of(build, out_dir, known=None):
    """What an image is judged by. The same image does the same, and need not be played again."""
    hashes = {name: sha256((build / name).read_bytes()).hexdigest() for name in ("mssfoc.hex", "bench.hex")}
    same = {name: known and known["hashes"][name] == found for name, found in hashes.items()}
    flash, ram = sizes(build)
    return {"hashes": hashes, "flash": flash, "ram": ram, "stack": stacks(build),
            "cycles": known["cycles"] if same["bench.hex"] else timed(build, out_dir / "cycles"),
            "run": known["run"] if same["mssfoc.hex"] else played(build, out_dir / "run")}


def timed(build, out_dir):
    """The largest cycles of all rows of the benchmark image, without the flash's waits: what is held of most."""
    return {name: row[""][2] for name, row in read_table(run_image(build, out_dir, 1, ["dwt cycles", *ZERO_WAIT])).items()}


def played(build, out_dir):
    run = simulate(SCENARIO, motor=MOTOR, build=build, out_dir=out_dir)
    return {"failure": failure(run), "figures": {name: mean_of([run], name) for name in VALUES},
            "loops": {f"{name}.in_run": getattr(run.load, name).max_cycles for name in ("current_loop",)},
            "on_s": float(run.trace["t_s"][np.argmax(run.trace["gates"] != 0)])}


@pytest.fixture(scope="module")
def as_it_is(tmp_path_factory, request):
    """Played by one process of a session, for all."""
    alone, base = not hasattr(request.config, "workerinput"), tmp_path_factory.getbasetemp()
    made = (base if alone else base.parent) / "as_it_is.json"
    with open(made.with_suffix(".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not made.is_file():
            made.write_text(json.dumps(figures_of(build_dir(), tmp_path_factory.mktemp("as_it_is"))))
    return json.loads(made.read_text())


def budgets(figures):
    return {name: {"max": figure} for name, figure in figures.items()}


@pytest.mark.parametrize("change", CHANGES)
def test_a_harmless_change_trips_nothing(change, as_it_is, tmp_path):
    now = figures_of(built(tmp_path / "project", CHANGES[change]), tmp_path, as_it_is)
    found = [line for section in ("cycles", "flash", "ram", "stack") for line in
             complaints(section, now[section], budgets(as_it_is[section]))]
    run, before = now["run"], as_it_is["run"]
    found += complaints("pessimistic", run["loops"], budgets(before["loops"]))  # with the waits
    found += [run["failure"]] if run["failure"] else []
    found += quality_complaints("quality", run["figures"], VALUES, QUALITY["held"][SCENARIO])
    if abs(run["on_s"] - before["on_s"]) > SAME_S:
        found += [f"the bridge switches on at {run['on_s']} s, not at {before['on_s']} s"]
    assert not found, "\n".join([f"{change}:", *found])
