# SPDX-License-Identifier: MIT
"""The exceptions that reach the user: their text is the line that is printed."""
import difflib


class LauncherError(Exception):
    """Something the user can put right. The message is one line, without a trailing full stop."""


class DoesNotApply(LauncherError):
    """A scenario that this motor on this inverter cannot play, whatever the drive does; with the reason."""


ALIKE = 0.6  # share of letters in common, in order


def choice(text, names):
    """What there is, for the end of a message, and which of it was probably meant: 'a, b; did you mean a?'"""
    names = list(names)
    best = max(names, key=lambda name: _likeness(text, name), default=None)
    meant = f"; did you mean {best}?" if best and _likeness(text, best) >= ALIKE else ""
    return ", ".join(names) + meant


def _likeness(text, name):
    """Of the whole name or of a part of it, whatever the case."""
    return max(difflib.SequenceMatcher(None, text.lower(), part.lower()).ratio() for part in (name, *name.split("_")))
