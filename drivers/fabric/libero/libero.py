# SPDX-License-Identifier: MIT
"""make libero: writes a whole Libero project for a board as Tcl, with the RTL and the image, into a folder of its own.

libero.py BOARD BUILD      BUILD has mssfoc.hex and fabric/mssfoc_regs.vh; the project goes into BUILD/libero/BOARD
"""
import re
import shutil
import sys
import tomllib
from pathlib import Path

import board as boards
import constraints
import design
import flow
import mss
import rtl
import wrapper
from wrong import Wrong

HERE = Path(__file__).resolve().parent
INCLUDE = re.compile(r'^`include "(mssfoc_regs\.vh)"$', re.M)


def toml(name):
    return tomllib.loads((HERE / name).read_text(encoding="utf-8"))


def data_of(line):
    """(kind, address, bytes) of a line of Intel hex."""
    raw = bytes.fromhex(line[1:])
    return raw[3], int.from_bytes(raw[1:3], "big"), raw[4:-1]


def image_extent(path):
    """First address and the one behind the last of an Intel hex file."""
    base, first, last = 0, None, 0
    for line in path.read_text(encoding="ascii").split():
        kind, address, data = data_of(line)
        if kind == 2:
            base = int.from_bytes(data, "big") << 4
        elif kind == 4:
            base = int.from_bytes(data, "big") << 16
        elif kind == 0:
            first = base + address if first is None else min(first, base + address)
            last = max(last, base + address + len(data))
    return first, last


def image_words(path):
    if not path.is_file():
        raise Wrong(f"{path} is missing: run make")
    first, last = image_extent(path)
    if first != 0:
        raise Wrong(f"{path} begins at {first}: Libero's client counts from the start of the eNVM; take mssfoc.hex")
    return last


def sources(includes):
    """{name: text} of the RTL, each file whole: Libero needs no include path."""
    registers = (Path(includes) / "mssfoc_regs.vh").read_text(encoding="utf-8")
    return {path.name: INCLUDE.sub(lambda _: registers.rstrip(), path.read_text(encoding="utf-8"))
            for path in sorted(rtl.RTL.glob("*.v"))}


def project(name, build, folder=boards.BOARDS):
    """{path: text} of all that the project needs but the image."""
    board, system = boards.load(name, folder), toml("system.toml")
    fabric = rtl.read(board["axes"], build / "fabric")
    for port in fabric.ports:
        if port.name not in system["fabric"]["ports"] and not port.name.startswith("pin_"):
            raise Wrong(f"fabric.v has a port {port.name}; system.toml's [fabric.ports] and [nets] do not say where it leads")
    use = boards.Use(board, fabric)
    hdl = sources(build / "fabric") | {"fabric_board.v": wrapper.verilog(board, system, fabric, use)}
    files = {f"hdl/{file}": text for file, text in hdl.items()}
    return files | {
        "project.tcl": flow.project(board, system),
        "mss.tcl": mss.script(board, system, use, image_words(build / "mssfoc.hex")),
        "design.tcl": design.script(board, system, use, hdl),
        "constraints.tcl": flow.constraints(board),
        "build.tcl": flow.build(board),
        "io.pdc": constraints.pdc(board, use),
        "timing.sdc": constraints.sdc(board, system, fabric, use, toml("converters.toml")),
    }


def write(files, out):
    """Renews what is ours; a project that Libero has made there stays."""
    shutil.rmtree(out / "hdl", ignore_errors=True)
    for name, text in files.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text, encoding="utf-8")


def main(name, build):
    build = Path(build)
    out = build / "libero" / name
    try:
        write(project(name, build), out)
    except Wrong as wrong:
        print(f"mssfoc: {wrong}", file=sys.stderr)
        return 1
    shutil.copy(build / "mssfoc.hex", out / "mssfoc.hex")
    print(f"{out}: in Libero, there: libero SCRIPT:project.tcl")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
