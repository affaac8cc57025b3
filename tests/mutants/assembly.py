# SPDX-License-Identifier: MIT
"""The mistakes of assembly: of three short files, so another line, condition, number or register, and no more."""
import re

from mutants.mutant import mutants_of, without_remarks

OPPOSITE = {"eq": "ne", "cs": "cc", "hs": "lo", "mi": "pl", "hi": "ls", "ge": "lt", "gt": "le"}
OPPOSITE |= {value: key for key, value in OPPOSITE.items()}
OTHER = {"add": "sub", "adds": "subs", "sub": "add", "subs": "adds", "mla": "mls", "asr": "lsr", "lsrs": "asrs", "ldr": "ldrh"}
LINE = re.compile(r"(?m)^(?:([A-Za-z_]\w*):)?[ \t]+([a-z][a-z0-9.]*)[ \t]*([^@\n]*?)[ \t]*(?:@.*)?$")
KEPT = ("push", "pop", "bx", "nop", "it")


def mutants(file, text):
    blank, found, function, before = without_remarks(text), [], "file", None
    for match in LINE.finditer(blank):
        function = match[1] or function
        name, place = match[2], match.span(2)
        if name.startswith("."):
            continue
        whole = (place[0], match.end(3))
        found += [(function, kind, edits, None) for kind, edits in _of_line(blank, name, place, whole, match.start(3))]
        if before and before[0] == function and not name.startswith(("it", "b")):
            one, two = (blank[slice(*span)] for span in (before[1], whole))
            found.append((function, "order", ((*before[1], two), (*whole, one)), None))
        before = (function, whole) if not name.startswith(KEPT) else None
    return mutants_of(file, blank, found)


def _of_line(text, name, place, whole, operands):
    if not name.startswith(KEPT):
        yield "forgotten clear", ((*whole, ""),)
    branch = re.fullmatch(r"b([a-z]{2})(?:\.[nw])?", name)
    if branch and branch[1] in OPPOSITE:
        yield "comparison", ((place[0] + 1, place[0] + 3, OPPOSITE[branch[1]]),)
    if name in OTHER:
        yield "sign", ((*place, OTHER[name]),)
    for number in re.finditer(r"#(\d+)\b", text[operands:whole[1]]):
        at = operands + number.start(1)
        yield "off by one", ((at, at + len(number[1]), str(int(number[1]) + 1)),)
    for register in re.finditer(r"\br([0-7])\b", text[operands:whole[1]]):
        at = operands + register.start(1)
        yield "copy error", ((at, at + 1, str(int(register[1]) ^ 1)),)
