# SPDX-License-Identifier: MIT
"""Why something was not done. Each has one line that says it."""


class Error(Exception):
    """Whatever the client raises."""


class Refused(Error):
    """The drive, or the client before it asks, does not do that; the text says what would work."""


class Silent(Error):
    """No answer, or none that can be understood."""


class Faulted(Error):
    """The drive is in a fault; `fault` has its record."""

    def __init__(self, fault):
        super().__init__(f"fault: {fault.name}")
        self.fault = fault
