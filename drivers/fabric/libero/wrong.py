# SPDX-License-Identifier: MIT
"""What the user can mend: one line, what is wrong and what would work."""


class Wrong(Exception):
    pass
