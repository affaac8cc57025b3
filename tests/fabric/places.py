# SPDX-License-Identifier: MIT
"""Where the RTL is, and the headers that `make registers` writes for it."""
import os
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RTL = ROOT / "drivers/fabric/rtl"
PLANT = RTL / "plant"      # a motor beside the drive: docs/fabric.md
REGISTERS = ROOT / os.environ.get("BUILD", "build") / "fabric"


def includes(rtl=RTL):
    """Options for Verilator, Icarus and yosys alike, with the RTL or a copy of it."""
    if not (REGISTERS / "mssfoc_regs.vh").is_file():
        raise FileNotFoundError(f"{REGISTERS}/mssfoc_regs.vh is missing: run make registers")
    return [f"-I{rtl}", f"-I{REGISTERS}"]


def sources(block):
    """The files of a block's netlist."""
    return sorted((PLANT if block == "plant" else RTL).glob("*.v"))
