# SPDX-License-Identifier: MIT
"""What the RTL says of itself, by yosys: the fabric's ports, and how fast its serial readers run."""
import functools
import json
import re
import subprocess
from pathlib import Path
from typing import NamedTuple

from .wrong import Wrong

RTL = Path(__file__).resolve().parents[1] / "rtl"


class Port(NamedTuple):
    name: str
    direction: str  # "input" or "output"
    width: int


class Fabric(NamedTuple):
    ports: list
    half: dict  # instance of adc_spi: clocks in half a period of its SCLK

    def pins(self):
        """(name, index, direction) of each bit that leads out of the device; the lock comes from inside."""
        return [(port.name, bit, port.direction) for port in self.ports if port.name.startswith("pin_")
                and port.name != "pin_clock_ok" for bit in range(port.width)]


def run_yosys(script):
    """The netlist that `script` ends with, as yosys' JSON has it."""
    done = subprocess.run(["yosys", "-q", "-p", script + "; write_json /dev/stdout"], capture_output=True, text=True)
    if done.returncode:
        raise Wrong(f"yosys does not read the RTL: {done.stderr.strip().splitlines()[-1]}")
    return json.loads(done.stdout)["modules"]


@functools.cache
def read(axes, includes):
    """The fabric with so many axes; `includes` is the folder with mssfoc_regs.vh."""
    if not (Path(includes) / "mssfoc_regs.vh").is_file():
        raise Wrong(f"{includes}/mssfoc_regs.vh is missing: run make registers")
    modules = run_yosys(f"read_verilog -I{includes} {RTL}/*.v; hierarchy -check -top fabric -chparam AXES {axes}; proc")
    top = next(module for module in modules.values() if module["attributes"].get("top"))
    ports = [Port(name, port["direction"], len(port["bits"])) for name, port in top["ports"].items()]
    half = {}
    for module in modules.values():
        for name, cell in module["cells"].items():
            if re.search(r"\badc_spi$", cell["type"]):
                half[name] = int(modules[cell["type"]]["parameter_default_values"]["HALF"], 2)
    return Fabric(ports, half)
