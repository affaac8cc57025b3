# SPDX-License-Identifier: MIT
"""wiring.md: which header pin carries what, and what to buy, from the board's file and signals.toml."""
import re

LEGS = "ABC"
BIT = re.compile(r"(pin_\w+?)_(\d+)\Z")


def row(pin, signals):
    match = BIT.match(pin.port)
    name, bit = (match[1], int(match[2])) if match else (pin.port, 0)
    what, level = signals["signal"][name]
    what = what[bit % len(what)] if isinstance(what, list) else what.format(leg=LEGS[bit % len(LEGS)])
    return f"| {pin.net} | {pin.package} | {'out' if pin.direction == 'output' else 'in'} | {what} | {level} |"


def table(use, signals):
    """Every wire of the board, in the order of its file."""
    return "\n".join(["| header pin | FPGA | | signal | level |", "|---|---|---|---|---|",
                      *(row(pin, signals) for pin in use.pins)]) + "\n"


def shopping(use, signals):
    lines = ["| pieces | what |", "|--:|---|", f"| 1 | {use.board['title']} |"]
    for part in signals["part"]:
        pins = [pin for pin in use.pins if pin.port.startswith(tuple(part["pins"]))]
        if pins:
            lines.append(f"| {part['count'] or len(pins)} | {part['what']} |")
    return "\n".join(lines) + "\n"


def page(use, signals):
    return (f"# {use.board['title']}\n\nAll levels are 0 and 3.3 V. *Out* is from the FPGA.\n\n"
            f"## Wires\n\n{table(use, signals)}\n## To buy\n\n{shopping(use, signals)}")
