# SPDX-License-Identifier: MIT
"""When things happen in a scenario: values that are worked out from each other, in whatever order they are written."""
from .errors import LauncherError
from .expression import names_in, number

LONGEST_S = 3600


class Timeline:
    """Values of expressions over the drive's names and over labels; a label is worked out when it is first needed."""

    def __init__(self, names):
        self._names = dict(names)
        self._waiting = {}  # label -> function that gives its value
        self.labels = {}
        self._open = []

    def define(self, label, value, where):
        """Names an instant or another number; `value` is called once, when all labels are known."""
        if not isinstance(label, str) or not label.isidentifier():
            raise LauncherError(f"{where}: label '{label}' is not one word")
        if label in self._names or label in self._waiting:
            raise LauncherError(f"{where}: the name '{label}' is taken")
        self._waiting[label] = value

    @property
    def names(self):
        """Everything an expression may use, labels included."""
        for label in self._waiting:
            self._resolve(label)
        return {**self._names, **self.labels}

    def number(self, value, more=()):
        """The value of an expression; `more` are further names, for this expression only."""
        for name in names_in(value):
            if name in self._waiting:
                self._resolve(name)
        return number(value, {**self._names, **self.labels, **dict(more)})

    def seconds(self, value, where, more=()):
        """An instant or a length of time."""
        try:
            result = self.number(value, more)
        except LauncherError as error:
            raise LauncherError(f"{where}: {error}") from error
        if not 0 <= result <= LONGEST_S:
            raise LauncherError(f"{where}: {result:g} s is outside 0..{LONGEST_S} s")
        return result

    def _resolve(self, label):
        if label in self.labels:
            return
        if label in self._open:
            raise LauncherError(f"the label '{label}' depends on itself: {' -> '.join([*self._open, label])}")
        self._open.append(label)
        self.labels[label] = self._waiting[label]()
        self._open.pop()
