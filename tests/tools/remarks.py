# SPDX-License-Identifier: MIT
"""The comments beside the instructions of assembly sources, also where a macro stands for them."""
import re

_SAME = {"negs": "rsbs", "r10": "sl", "r11": "fp", "r12": "ip", "r13": "sp", "r14": "lr", "r15": "pc"}
_REGISTER = re.compile(r"\b(r\d\d?|sl|fp|ip|sp|lr|pc)\b")


def remark(line):
    """The text of a line's comment, without the number of cycles at its beginning."""
    found = re.search(r"/\*(.*?)\*/|//(.*)|@(.*)", line)
    text = next((part for part in found.groups() if part is not None), "") if found else ""
    return re.sub(r"^\s*\d+(\s+|$)", "", text).strip()


def key(instruction):
    """What an instruction in a source and the same disassembled have in common: the mnemonic and the registers."""
    text = re.sub(r"/\*.*?\*/|//.*|@.*", "", instruction).strip()
    name, _, operands = text.partition(" ")
    return _SAME.get(name.split(".")[0], name.split(".")[0]), frozenset(_SAME.get(r, r) for r in _REGISTER.findall(operands))


def macros(lines):
    """{name: (parameters, lines of the body)}."""
    found, name = {}, None
    for line in lines:
        start = re.match(r"\s*\.macro\s+(\w+)\s*(.*)", line)
        if start:
            name = start.group(1)
            found[name] = [part.strip() for part in start.group(2).split(",") if part.strip()], []
        elif re.match(r"\s*\.endm", line):
            name = None
        elif name:
            found[name][1].append(line)
    return found


def expanded(line, known):
    """The lines that a line stands for: a macro's body with its arguments, or none."""
    name, _, arguments = re.sub(r"/\*.*?\*/|//.*|@.*", "", line).strip().partition(" ")
    if name not in known:
        return []
    parameters, body = known[name]
    values = {}
    for position, argument in enumerate(part.strip() for part in arguments.split(",") if part.strip()):
        parameter, named, value = argument.partition("=")
        values[parameter if named else parameters[position]] = value if named else argument
    return [re.sub(r"\\(\w+)", lambda m: values.get(m.group(1), m.group(0)), text) for text in body]


def of_macro(line, lines, instruction):
    """The remark of a disassembled instruction at a line that calls a macro: that of the like line in its body."""
    for text in expanded(line, macros(lines)):
        if key(text) == key(instruction):
            return remark(text)
    return ""
