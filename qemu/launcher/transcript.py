# SPDX-License-Identifier: MIT
"""Whose a line of the console is, where the image drives two motors.

    > axis 2 on          this line, and the answers up to the next prompt, are of axis 2
    > axis 2             so are all lines behind it that name none
    fault: axis 2: ...   likewise done: and warning:, which the drive says by itself
    axis 2: ...          and what it says at the start

What names no axis before the first line is of both. Each axis' own part reads like the console of a drive with one motor, so
that whatever looks for text there need not know of axes.
"""
import re

_PROMPT = "> "
_TYPED = re.compile(r"\s*axis\s+([12])(?:\s+(?!axis\b)(\S.*)|\s*)$")
_BY_ITSELF = re.compile(r"((?:fault|warning|done): |)axis ([12]): (.*)")


def of_axis(console, axis):
    """The lines of a transcript that are of axis 0 or 1, as they would read if that were the only one."""
    kept, chosen, speaking = [], 0, None
    for line in console.split("\n"):
        by_itself = _BY_ITSELF.fullmatch(line)
        if by_itself:
            whose, line = int(by_itself[2]) - 1, by_itself[1] + by_itself[3]
        elif line.startswith(_PROMPT):
            typed = _TYPED.fullmatch(line[len(_PROMPT):])
            if typed and not typed[2]:
                chosen = int(typed[1]) - 1
            whose = speaking = int(typed[1]) - 1 if typed else chosen
            line = _PROMPT + typed[2] if typed and typed[2] else line
        else:
            whose = speaking
        if whose in (None, axis):
            kept.append(line)
    return "\n".join(kept)
