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
    best = _alike(text, names)
    return ", ".join(names) + (f"; did you mean {best}?" if best else "")


def instead(text, names, elsewhere=None):
    """The end of a message about a word that is none of the names: which was meant, or where it belongs, or what there is.

    elsewhere   {place: names} in which the word would have been right
    """
    places = [place for place, others in (elsewhere or {}).items() if text in others]
    best = _alike(text, names)
    if places:
        return f"; it belongs into {places[0]}"
    return f"; did you mean {best}?" if best else f"; there are: {', '.join(names)}"


def _alike(text, names):
    best = max(names, key=lambda name: _likeness(text, name), default=None)
    return best if best and _likeness(text, best) >= ALIKE else None


def _likeness(text, name):
    """Of the whole name or of a part of it, whatever the case."""
    return max(difflib.SequenceMatcher(None, text.lower(), part.lower()).ratio() for part in (name, *name.split("_")))
