# SPDX-License-Identifier: MIT
"""A board's file: where the fabric's pins and the UARTs lead. Everything wrong with it ends in one line."""
import re
import tomllib
from pathlib import Path
from typing import NamedTuple

from .wrong import Wrong

BOARDS = Path(__file__).resolve().parent / "boards"
NEEDED = ("title", "die", "package", "speed", "axes", "nets", "wired", "tied", "open", "console", "unused")
KNOWN = NEEDED + ("legs", "io_standard", "bank_volts", "bring_up_only", "can", "clock", "modbus", "sampling", "to_check")
CLOCK = "CLK0_PAD"  # the top's port of an oscillator on the board, at a dedicated pad of the CCC
CAN = (("CAN_TX", "tx", "output"), ("CAN_RX", "rx", "input"), ("CAN_TX_EN_N", "enable", "output"))
MOST_AXES = 4  # of 1 KB, in the 4 KB of CoreAPB3's slot
LEGS = ("gates", "in_en")  # what pin_high and pin_low lead to: six gates, or an input and an enable for each leg
BIT = re.compile(r"(\w+)\[(\d+)\]\Z")


class Pin(NamedTuple):
    port: str        # of the top
    net: str
    package: str     # name of the device's pin
    direction: str
    own: bool        # one of the MSS' own, which Libero places


def load(name, folder=BOARDS):
    path = Path(folder) / f"{name}.toml"
    if not path.is_file():
        there = "|".join(sorted(found.stem for found in Path(folder).glob("*.toml")))
        raise Wrong(f"no board is called '{name}': BOARD={there}, or add yours in drivers/fabric/libero/boards: "
                    "docs/libero.md")
    try:
        board = tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise Wrong(f"{name}: {error}") from error
    for key in NEEDED:
        if key not in board:
            raise Wrong(f"{name}: `{key}` is missing; see one of the other boards")
    for key in board.keys() - set(KNOWN):
        raise Wrong(f"{name}: `{key}` means nothing here; known are {', '.join(KNOWN)}")
    if board["axes"] not in range(1, MOST_AXES + 1):
        raise Wrong(f"{name}: {board['axes']} axes; the bus has room for 1 to {MOST_AXES}")
    if board.setdefault("legs", LEGS[0]) not in LEGS:
        raise Wrong(f"{name}: legs = {board['legs']}; {', '.join(LEGS)}")
    return board | {"name": name}


class Use:
    """Each bit of the fabric's pins: led to a pin of the device, tied to 0 or 1, or left open."""

    def __init__(self, board, fabric):
        self.board, self.wired, self.tied, self.open = board, {}, {}, set()
        self.bits = {(name, bit): direction for name, bit, direction in fabric.pins()}
        for key, net in board["wired"].items():
            self._take(key, lambda bit, net=net: self.wired.__setitem__(bit, net))
        for key, level in board["tied"].items():
            if level not in (0, 1):
                raise self._wrong(f"{key} is tied to {level}; 0 or 1")
            self._take(key, lambda bit, level=level: self.tied.__setitem__(bit, level), "input")
        for key in board["open"]:
            self._take(key, self.open.add, "output")
        for name, bit in self.bits:
            if not self._has((name, bit)):
                raise self._wrong(f"{name}[{bit}] is neither wired nor tied (inputs) nor open (outputs)")
        self._check_sampling()
        self.pins = self._pins()
        self._check_nets()

    def _wrong(self, what):
        return Wrong(f"{self.board['name']}: {what}")

    def _has(self, bit):
        return bit in self.wired or bit in self.tied or bit in self.open

    def _take(self, key, put, direction=None):
        match = BIT.match(key)
        bits = [(match[1], int(match[2]))] if match else [bit for bit in self.bits if bit[0] == key]
        if not bits or bits[0] not in self.bits:
            raise self._wrong(f"the fabric has no pin {key}")
        for bit in bits:
            if self._has(bit):
                raise self._wrong(f"{bit[0]}[{bit[1]}] has two uses")
            if direction not in (None, self.bits[bit]):
                raise self._wrong(f"{key} is an {self.bits[bit]}: inputs are tied, outputs are left open")
            put(bit)

    def _check_sampling(self):
        samples = any(name == "pin_sdata" for name, _ in self.wired)
        stopped = all(self.tied.get((name, 0)) == 0 for name in ("pin_sto_a_n", "pin_sto_b_n"))
        if samples != ("sampling" in self.board):
            raise self._wrong("[sampling] is for boards whose pin_sdata is wired, and those need it")
        if samples == ("bring_up_only" in self.board):
            raise self._wrong("a board that samples nothing says so by `bring_up_only`, others do not")
        if not samples and not stopped:
            raise self._wrong("a board that samples nothing ties pin_sto_a_n and pin_sto_b_n to 0: no gate may turn on")

    def uarts(self):
        """(MSS block, what the board says of it)."""
        return [(block, self.board[key]) for block, key in (("MMUART_0", "console"), ("MMUART_1", "modbus"))
                if key in self.board]

    def _pins(self):
        uses = [(f"{name}_{bit}", net, self.bits[name, bit], False) for (name, bit), net in self.wired.items()]
        for block, uart in self.uarts():
            own = {"fabric": False, "pins": True}.get(uart["through"])
            if own is None:
                raise self._wrong(f"{block} through {uart['through']}: `fabric` or `pins`")
            uses += [(f"{block}_TXD", uart["txd"], "output", own), (f"{block}_RXD", uart["rxd"], "input", own)]
            if "driver" in uart:
                uses.append(("GPIO_0_M2F", uart["driver"], "output", False))
        if "can" in self.board:
            uses += [(port, self.board["can"][key], direction, False) for port, key, direction in CAN]
        if "clock" in self.board:
            uses.append((CLOCK, self.board["clock"]["net"], "input", False))
        for port, net, _, _ in uses:
            if net not in self.board["nets"]:
                raise self._wrong(f"{port} is wired to {net}, which [nets] does not have")
        return [Pin(port, net, self.board["nets"][net], direction, own) for port, net, direction, own in uses]

    def _check_nets(self):
        seen = {}
        for net, package in self.board["nets"].items():
            if package in seen:
                raise self._wrong(f"{net} and {seen[package]} are both on pin {package}")
            seen[package] = net
        unused = self.board["unused"]["nets"]
        used = [pin.net for pin in self.pins] + unused
        for net in used:
            if net not in self.board["nets"]:
                raise self._wrong(f"[unused] has {net}, which [nets] does not have")
            if used.count(net) > 1:
                raise self._wrong(f"{net} has two uses")
        for net in self.board["nets"].keys() - set(used):
            raise self._wrong(f"{net} is neither used nor in [unused]")
