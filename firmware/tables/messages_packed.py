# SPDX-License-Identifier: MIT
"""The texts of refusals, faults and parameters for the drive's image: packed, as firmware/operate/messages.h says.

usage: messages_packed.py HEADER FEATURE...
"""
import sys
from collections import Counter
from pathlib import Path

from rows import faults, refusals, texts

FIRST, PAIRS, WAITING_MAX = 0x80, 128, 3
APART = "\0@#$&"  # what ends a text, and what stands for a value: never inside a pair


def packed(text):
    """(the text, its pairs): the pair met most often becomes one character, again and again."""
    assert text.isascii(), "characters from 0x80 on stand for pairs"
    pairs, waiting = [], Counter()  # how many second halves wait while the first ones are written
    for code in map(chr, range(FIRST, FIRST + PAIRS)):
        met = Counter(first + second for first, second in zip(text, text[1:]) if first not in APART and second not in APART and
                      max(waiting[first] + 1, waiting[second]) <= WAITING_MAX)
        pair = max(sorted(met) or ["  "], key=met.get)
        text = text.replace(pair, code)
        waiting[code] = max(waiting[pair[0]] + 1, waiting[pair[1]])
        pairs.append(pair)
    return text, pairs


def literal(text):
    return "".join(one if " " <= one <= "~" and one not in '"\\?' else f"\\{ord(one):03o}" for one in text)


def numbered(rows):
    """Those of a table, in the order of their numbers, which begin at 1 and have no gaps."""
    ordered = sorted(rows.values(), key=lambda row: row.number)
    assert [row.number for row in ordered] == list(range(1, len(ordered) + 1)), "a number is missing, or there twice"
    return ordered


def kinds(features):
    """{the table's name: its texts}; none for a refusal of a feature that is left out."""
    return {"error_texts": ["ok", *(row.text if row.feature in ("", *features) else "" for row in numbered(refusals()))],
            "fault_hints": ["", *(row.hint for row in numbered(faults()))],
            "fault_details": ["", *(row.details for row in numbered(faults()))],
            "param_texts": list(texts().values())}


def header(tables):
    text, pairs = packed("".join(f"{one}\0" for table in tables.values() for one in table))
    assert "\\" not in text, "escapes are not read"
    lines, rest = ["/* by firmware/tables/messages_packed.py */", f"#define WAITING_MAX {WAITING_MAX}u", "",
                   f'const char message_pairs[] = "{literal("".join(pairs))}";'], iter(text.split("\0"))
    for name, table in tables.items():
        lines += ["", f"#define {name.upper()} {len(table)}", f"static const char {name}[] ="]
        lines += [f'    "{literal(next(rest))}\\0"' for _ in table]
        lines[-1] += ";"
    return "\n".join((*lines, ""))


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(header(kinds([name.upper() for name in sys.argv[2:]])), encoding="ascii")
