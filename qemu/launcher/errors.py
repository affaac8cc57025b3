# SPDX-License-Identifier: MIT
"""The one exception that reaches the user: its text is the line that is printed."""


class LauncherError(Exception):
    """Something the user can put right. The message is one line, without a trailing full stop."""
