# SPDX-License-Identifier: MIT
"""The page that shows a drive and commands it: `make scope`. line.py takes the serial line apart, drive.py talks to the
console, twin.py and board.py are the two things at the line's other end, web.py is the page's server."""
