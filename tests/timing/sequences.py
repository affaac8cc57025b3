# SPDX-License-Identifier: MIT
"""Writes the assembler source of a group of sequences.txt: sequences.py NAME"""
import re
import sys
from pathlib import Path

DRAIN = [".rept 16", "mov.w r2, #0", ".endr"]
HEAD = '#include "tests/timing/sequence.inc"\n    .equ GATE_ID, 0x50000308\n    table\n'


def instructions(line):
    """(instruction, its cycles) of each on a line."""
    for item in line.split(";"):
        code, _, said = item.partition("@")
        count = re.match(r"[\d +*/()-]+", said)
        yield code.strip(), int(eval(count[0])) if count else 0  # an expression of digits


def sequence(number, title, lines, section, drains):
    title, _, whole = title.partition(" = ")
    parts, cycles = {">": list(DRAIN) if drains else [], " ": [], "<": []}, 0
    for line in lines:
        kind = line.strip()[0] if line.strip()[0] in "<>" else " "
        for code, count in instructions(line.strip(" <>")):
            parts[kind].append(code)
            cycles += count if kind != ">" else 0
    code = [*parts[">"], "start", *parts[" "], "stop", *parts["<"]]
    return f'    sequence s{number}, {whole or cycles}, "{title}", {section}\n' + "".join(f"    {one}\n" for one in code)


def source(name, text):
    head, *rows = re.search(rf"(?ms)^\[({name} .*?)(?=^\[|\Z)", text)[1].rstrip().split("\n")
    section, *drains = head.strip("]").split()[1:]
    cases = [row.split("\n") for row in re.split(r"\n(?=\S)", "\n".join(rows)) if not row.startswith("#")]
    code = "".join(sequence(n, title, lines, section, drains) for n, (title, *lines) in enumerate(cases))
    more = '#include "tests/timing/exceptions.inc"\n' if name == "rules" else ""
    return HEAD + code + more + "    end_of_table\n"


if __name__ == "__main__":
    print(source(sys.argv[1], Path(__file__).with_name("sequences.txt").read_text(encoding="utf-8")))
