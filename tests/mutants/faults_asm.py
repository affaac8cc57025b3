# SPDX-License-Identifier: MIT
"""The faults that a person makes in assembly: another condition, immediate, shift, register, or a line that is missing."""
import re
from dataclasses import dataclass

from mutants.fault import make_faults, without_remarks

OPPOSITE = {"eq": "ne", "cs": "cc", "hs": "lo", "mi": "pl", "vs": "vc", "hi": "ls", "ge": "lt", "gt": "le"}
OPPOSITE |= {value: key for key, value in OPPOSITE.items()}
NEAR = {"gt": "ge", "ge": "gt", "lt": "le", "le": "lt", "hi": "hs", "hs": "hi", "lo": "ls", "ls": "lo"}
OTHER = {"add": "sub", "adds": "subs", "sub": "add", "subs": "adds", "adc": "add", "mla": "mls", "mls": "mla", "asr": "lsr",
         "asrs": "lsrs", "lsrs": "asrs", "ubfx": "sbfx", "sbfx": "ubfx", "orr": "and", "orrs": "ands", "bic": "and",
         "ldr": "ldrh", "ldrh": "ldrsh", "cmp": "cmn", "cmn": "cmp", "rsb": "sub", "cpsid": "cpsie", "tst": "teq"}
ORDERED = {"sub": 2, "subs": 2, "rsb": 2, "bic": 2, "cmp": 2, "mla": 2, "mls": 2}  # the last two operands are not alike
KEPT = ("push", "pop", "bx", "nop", "it")
BRANCH = re.compile(r"b(eq|ne|cs|cc|hs|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)(\.n|\.w)?")
CONDITIONAL = re.compile(r"([a-z]+?)(eq|ne|cs|cc|hs|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)")
LINE = re.compile(r"(?P<label>[A-Za-z_.][\w.]*:)?[ \t]*(?P<name>[a-z][\w.]*)?[ \t]*(?P<operands>[^\n]*)")
CONSTANT = re.compile(r"(?m)^[ \t]*(?:\.equ[ \t]+(\w+)[ \t]*,|#[ \t]*define[ \t]+(\w+))[ \t]*(0x[0-9A-Fa-f]+|\d+)[ \t]*$")
IMMEDIATE = re.compile(r"#(0x[0-9a-fA-F]+|\d+)\b|(?<=[ #(,])([A-Z]+_[A-Z0-9_]+)\b|\((\d), (\d)\)")
SHIFTS = {"asr": "lsr", "lsr": "asr", "lsl": "lsr", "ror": "lsr"}


@dataclass
class Instruction:
    name: str
    start: int          # of the name, in the file
    end: int            # behind the last operand
    operands: list      # (start, end) of each
    function: str


def asm_faults(file, text):
    blank = without_remarks(text, assembly=True)
    code = list(instructions(blank))
    found = list(_constants(blank))
    in_block = 0
    for n, one in enumerate(code):
        if one.name.startswith("it") and re.fullmatch(r"it[te]{0,3}", one.name):
            in_block = len(one.name) - 1
            found += _block(blank, one, code[n + 1:n + 1 + in_block])
            continue
        found += _branch(blank, one)
        found += _operation(blank, one)
        found += _immediates(blank, one)
        found += _registers(blank, one)
        if not in_block and not one.name.startswith(KEPT):
            found.append((one.function, "dropped statement", ((one.start, one.end, ""),)))
        found += _order(blank, one, code[n + 1]) if n + 1 < len(code) and not in_block else []
        in_block = max(0, in_block - 1)
    return make_faults(file, blank, found)


def instructions(text):
    function, at, in_macro = "file", 0, False
    for line in text.split("\n"):
        start, at = at, at + len(line) + 1
        if in_macro or re.match(r"[ \t]*#", line):
            in_macro = line.rstrip().endswith("\\")
            continue
        match = LINE.match(line)
        label, name = match["label"], match["name"]
        if label and re.search(rf"\.type\s+{re.escape(label[:-1])}\s*,", text):
            function = label[:-1]
        if not name or name.startswith(".") or line.strip().startswith("."):
            continue
        operands = _operands(line, match.start("operands"), start)
        end = operands[-1][1] if operands else start + match.end("name")
        yield Instruction(name, start + match.start("name"), end, operands, function)


def _operands(line, at, offset):
    found, depth, begin = [], 0, at
    for i in range(at, len(line) + 1):
        c = line[i] if i < len(line) else ","
        depth += (c in "[{(") - (c in "]})")
        if c == "," and depth == 0:
            part = line[begin:i]
            if part.strip():
                first = begin + len(part) - len(part.lstrip())
                found.append((offset + first, offset + first + len(part.strip())))
            begin = i + 1
    return found


def _constants(text):
    for match in CONSTANT.finditer(text):
        value, name = int(match[3], 0), match[1] or match[2]
        for new in (value * 2, value ^ (value & -value)) if value > 16 else (value + 1, max(value - 1, 0)):
            yield name, "constant", ((match.start(3), match.end(3), hex(new) if match[3][:2] == "0x" else str(new)),)


def _block(text, it, inside):
    """The condition of an IT block and of all in it, the opposite or with the equal case on the other side."""
    condition = text[slice(*it.operands[0])]
    for table, kind in ((OPPOSITE, "condition"), (NEAR, "off by one")):
        if condition not in table:
            continue
        swap = {condition: table[condition], OPPOSITE[condition]: OPPOSITE[table[condition]]}
        edits = [(*it.operands[0], table[condition])]
        for one in inside:
            match = CONDITIONAL.fullmatch(one.name)
            if match and match[2] in swap:
                edits.append((one.start, one.start + len(one.name), match[1] + swap[match[2]]))
        if len(edits) == len(inside) + 1:
            yield it.function, kind, tuple(edits)


def _branch(text, one):
    match = BRANCH.fullmatch(one.name)
    if match:
        for table, kind in ((OPPOSITE, "condition"), (NEAR, "off by one")):
            if match[1] in table:
                place = (one.start + 1, one.start + 1 + len(match[1]))
                yield one.function, kind, ((*place, table[match[1]]),)


def _operation(text, one):
    if one.name in OTHER:
        yield one.function, "operator", ((one.start, one.start + len(one.name), OTHER[one.name]),)
    for start, end in one.operands:
        match = re.fullmatch(r"(asr|lsl|lsr|ror)\s.*", text[start:end])
        if match:
            yield one.function, "operator", ((start, start + 3, SHIFTS[match[1]]),)


def _immediates(text, one):
    """Numbers by one or by a factor, names by another of the same family."""
    for match in IMMEDIATE.finditer(text[one.start:one.end]):
        at = one.start + match.start()
        if match[1]:
            value, place = int(match[1], 0), (at + 1, at + 1 + len(match[1]))
            news = (value + 1, value - 1) if 0 < value <= 32 else (value + 1,) if value == 0 else (value * 2, value // 2)
            if value == 31 and text[one.start:at].endswith("asr "):
                news = (30,)  # by 32 places the sign is spread as by 31
            for new in news:
                yield one.function, "off by one" if value <= 32 else "constant", ((*place, str(new)),)
        elif match[2]:
            family = _family(text, match[2])
            if len(family) > 1:
                new = family[(family.index(match[2]) + 1) % len(family)]
                yield one.function, "operand", ((at, at + len(match[2]), new),)
        else:
            yield one.function, "operand", ((at + 4, at + 5, str(int(match[4]) ^ 1)),)


def _family(text, name):
    """Names used in this file that begin alike, up to the second underscore if several do."""
    parts = name.split("_")
    for count in (2, 1):
        family = sorted(set(re.findall(rf"\b{'_'.join(parts[:count])}_\w+", text)))
        if len(parts) > count and len(family) > 1:
            return family
    return []


def _registers(text, one):
    names = [text[slice(*place)] for place in one.operands]
    registers = [n for n, name in enumerate(names) if re.fullmatch(r"r\d+|lr|[A-Z]+", name)]
    if one.name in ORDERED and len(registers) == len(names) >= 2 and names[-1] != names[-2]:
        a, b = one.operands[-2], one.operands[-1]
        yield one.function, "arguments", ((*a, names[-1]), (*b, names[-2]))
    for n in registers:
        match = re.fullmatch(r"r([0-7])", names[n])
        if match and one.name not in ("push", "pop"):
            yield one.function, "operand", ((*one.operands[n], f"r{int(match[1]) ^ 1}"),)


def _order(text, one, two):
    """Two instructions exchanged, where the second needs what the first gives."""
    if one.function != two.function or not (one.operands and two.operands):
        return
    if one.name.startswith(("b", "cmp", "str", "it", "pop", "push")) or two.name.startswith("it"):
        return
    given, a, b = text[slice(*one.operands[0])], text[one.start:one.end], text[two.start:two.end]
    if re.search(rf"\b{re.escape(given)}\b", text[two.operands[0][1]:two.end]):
        yield one.function, "order", ((one.start, one.end, b), (two.start, two.end, a))
