# SPDX-License-Identifier: MIT
"""Names that are taken for one another, in any language: of axes, phases, directions, units."""
import re

GROUPS = [words.split() for words in (
    "a b c", "d q", "alpha beta", "x y", "up down", "first second", "first last", "low high", "lower upper", "min max",
    "least most", "rx tx", "head tail", "from to", "sin cos", "kp ki", "ld lq", "ref target", "start end", "begin end",
    "read write", "old new", "before after", "one two", "on off", "here there", "shorter longer", "id iq", "ia ib ic",
    "left right", "in out", "rows columns", "width height")]
UNITS = [words.split() for words in (
    "s ms us ns ps", "q15 q16 q14 q31 q30 q4 q11", "rad deg mdeg", "v mv", "a ma", "rpm hz", "ohm mohm", "h uh")]
KINDS = (("copy error", GROUPS), ("unit", UNITS))


def twins(name, known):
    """[(kind, other name)] of the names in `known` that differ from this one in one word."""
    parts, found = re.split(r"(_)", name), []
    for n, part in enumerate(parts):
        for kind, groups in KINDS[:2 if n else 1]:  # a name's first word is no unit
            for other in (other for group in groups if part.lower() in group for other in group):
                new = "".join([*parts[:n], other.upper() if part.isupper() else other, *parts[n + 1:]])
                if new in known and new != name:
                    found.append((kind, new))
    return found
