# SPDX-License-Identifier: MIT
"""A whole Libero project for a board, as {path: text}: Tcl, pins, times, and the RTL."""
import re
import tomllib
from pathlib import Path

from . import board as boards
from . import constraints, design, flow, mss, rtl, wires, wrapper
from .wrong import Wrong

HERE = Path(__file__).resolve().parent
FORMAL = re.compile(r"^`ifdef FORMAL\n(?:.*\n)*?`endif\n", re.M)
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
        raise Wrong(f"{path} begins at {first:#x}: Libero's client counts from the start of the eNVM; take mssfoc.hex")
    return last


def sources(includes):
    """{name: text} of the RTL, each file whole: Libero needs no include path, and sees nothing of the proofs."""
    registers = (Path(includes) / "mssfoc_regs.vh").read_text(encoding="utf-8").rstrip()
    texts = {path.name: path.read_text(encoding="utf-8") for path in sorted(rtl.RTL.glob("*.v"))}
    return {name: INCLUDE.sub(lambda _: registers, FORMAL.sub("", text)) for name, text in texts.items()}


def clocked(board, system):
    """The system with the CCC fed by the board's oscillator, if it has one at a pad; else by the device's own."""
    if "clock" not in board:
        return system
    if board["clock"]["mhz"] != constraints.OSCILLATOR_MHZ:
        raise Wrong(f"{board['name']}: an oscillator of {board['clock']['mhz']} MHz; the CCC's settings are for 50")
    instances = {name: what | {"params": what["params"] | system["pad"].get(name, {})} if "params" in what else what
                 for name, what in system["instance"].items()}
    return system | {"instance": instances, "nets": {name: net for name, net in system["nets"].items()
                                                     if name != "oscillator_ccc"}}


def project(board, build, system=None, image="mssfoc"):
    """{path: text} of all that the project needs but the image; `build` has its .hex and fabric/mssfoc_regs.vh."""
    system = clocked(board, system or toml("system.toml"))
    fabric = rtl.read(board["axes"], build / "fabric")
    for port in fabric.ports:
        if port.name not in system["fabric"]["ports"] and not port.name.startswith("pin_"):
            raise Wrong(f"fabric.v has a port {port.name}; system.toml's [fabric.ports] and [nets] do not say where it leads")
    use = boards.Use(board, fabric)
    hdl = sources(build / "fabric") | {"fabric_board.v": wrapper.verilog(board, system, fabric, use)}
    files = {f"hdl/{file}": text for file, text in hdl.items()}
    return files | {
        "project.tcl": flow.project(board, system),
        "mss.tcl": mss.script(board, system, use, image_words(build / f"{image}.hex"), image),
        "design.tcl": design.script(board, system, use, hdl),
        "constraints.tcl": flow.constraints(board),
        "build.tcl": flow.build(board),
        "io.pdc": constraints.pdc(board, use),
        "timing.sdc": constraints.sdc(board, system, fabric, use, toml("converters.toml")),
        "wiring.md": wires.page(use, toml("signals.toml")),
    }
