# SPDX-License-Identifier: MIT
"""Checks a project that `make libero` has written: check.py BOARD FOLDER. Plays a copy of it to the recorder.

Prints what is wrong and exits 1, or what no public design confirms and exits 0.
"""
import shutil
import sys
import tempfile
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "drivers/fabric"))

import demands  # noqa: E402  (they need the generator on the path)
import pins_and_times  # noqa: E402
import public  # noqa: E402
import recording  # noqa: E402
import wiring  # noqa: E402
from libero import board as boards  # noqa: E402
from libero.wrong import Wrong  # noqa: E402

KNOWN = tomllib.loads((HERE / "known.toml").read_text(encoding="utf-8"))


def imported(calls, folder):
    """Every source is imported, is there, and is whole."""
    named = {Path(call.one("-hdl_source")).name for call in calls["project.tcl"] if call.name == "import_files"}
    for name in named ^ {path.name for path in (folder / "hdl").glob("*.v")}:
        yield f"hdl/{name} is imported or there, not both"
    for path in sorted((folder / "hdl").glob("*.v")):
        if "`include" in path.read_text(encoding="utf-8"):
            yield f"hdl/{path.name} includes a file that Libero would not find"


def of_design(board, folder, calls, modules):
    try:
        modules = modules or wiring.wrapper(folder)
        design = wiring.read(calls["project.tcl"], KNOWN, modules)
    except (Wrong, ValueError) as error:
        return [str(error)]
    return [*wiring.findings(design), *wiring.inside_findings(modules, board),
            *demands.findings(calls, design, folder, KNOWN, board), *pins_and_times.findings(calls, design, board, KNOWN)]


def findings(board, folder, modules=None):
    """All that is wrong with the project in `folder`; `modules`, if its sources were read before."""
    try:
        calls = recording.project(folder, KNOWN["command"])
    except recording.Failed as error:
        return [str(error)]
    return [*public.findings(calls, folder, KNOWN), *imported(calls, folder), *of_design(board, folder, calls, modules)]


def main(name, folder):
    with tempfile.TemporaryDirectory() as copy:
        project = Path(copy) / "project"
        shutil.copytree(folder, project, ignore=shutil.ignore_patterns("libero", "envm.cfg"))
        found = findings(boards.load(name), project)
    for line in found:
        print(f"{name}: {line}", file=sys.stderr)
    if found:
        return 1
    marked, to_check = public.marks(folder)
    print(f"{name}: checked; not confirmed by any public design:")
    for line in [f"{fact}: {why}" for fact, why in marked.items()] + to_check:
        print(f"  {line}")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
