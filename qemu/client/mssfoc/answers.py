# SPDX-License-Identifier: MIT
"""The console's text in its mode for programs (docs/console.md): which line answers, and which comes unasked."""
import re

END = "."  # the line behind each answer
UNASKED = re.compile("done: |fault: .*; see 'fault'")  # no answer has such a line


class Answers:
    """Text in, lines that came unasked out; `lines` is the answer so far, `ended` that it is whole."""

    def __init__(self):
        self.lines, self.rest, self.ended = [], "", True
        self._asked = self._begun = False

    def expect(self):
        """A question goes out now. A line that has begun before it is no part of the answer."""
        self.lines, self._begun, self._asked, self.ended = [], bool(self.rest), True, False

    def expect_mode(self):
        """The drive is told to change to this mode: everything that comes is heard, an END among it."""
        self.lines, self.rest, self._begun, self._asked, self.ended = [], "", False, True, True

    def give_up(self):
        self._asked, self.ended = False, True

    def take(self, text):
        """The lines of what has come that answer nothing: a fault, a warning, a greeting after a reset."""
        *lines, self.rest = (self.rest + text.decode("ascii", "replace")).replace("\r", "").split("\n")
        unasked = []
        for line in lines:
            if not self._asked or self._begun or UNASKED.match(line):
                unasked.append(line)
                self._begun = False
            elif line == END and not self.ended:
                self._asked, self.ended = False, True
            else:
                self.lines.append(line)
        return [line for line in unasked if line]

    def mode_is_there(self):
        """After expect_mode(): the last that came is an END, and nothing has begun behind it."""
        return self.lines[-1:] == [END] and not self.rest
