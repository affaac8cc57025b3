# SPDX-License-Identifier: MIT
"""The exceptions that reach the user: their text is the line that is printed."""


class LauncherError(Exception):
    """Something the user can put right. The message is one line, without a trailing full stop."""


class DoesNotApply(LauncherError):
    """A scenario that this motor on this inverter cannot play, whatever the drive does; with the reason."""
