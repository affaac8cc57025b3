# SPDX-License-Identifier: MIT
"""python3 -m libero BOARD [BUILD [IMAGE]]: into BUILD/libero/BOARD, with BUILD/IMAGE.hex. Without BUILD: is BOARD there?"""
import shutil
import sys
from pathlib import Path

from . import board, project
from .wrong import Wrong


def write(files, out):
    """Renews what is ours; a project that Libero has made there stays."""
    shutil.rmtree(out / "hdl", ignore_errors=True)
    for name, text in files.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text, encoding="utf-8")


def main(name, build=None, image="mssfoc"):
    try:
        wanted = board.load(name)
        if build is None:
            return 0
        out = Path(build) / "libero" / name
        write(project.project(wanted, Path(build), image=image), out)
    except Wrong as wrong:
        print(f"mssfoc: {wrong}", file=sys.stderr)
        return 1
    shutil.copy(Path(build) / f"{image}.hex", out / f"{image}.hex")
    print(f"{out}: copy it to where Libero is, and run there: libero SCRIPT:project.tcl")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
