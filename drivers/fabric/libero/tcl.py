# SPDX-License-Identifier: MIT
"""Words of Tcl, as Libero's own exports have them, and the marks on what no public design confirms."""
import re

LICENCE = "# SPDX-License-Identifier: MIT\n"
UNCONFIRMED, TO_CHECK = "# unconfirmed: ", "# to check: "


def head(board, what):
    return [LICENCE.rstrip(), f"# {board['title']}: {what}. Written by `make libero BOARD={board['name']}`.", ""]


def step(what):
    """Each is printed, so that the last one says where Libero stopped."""
    return f"step {{{what}}}"


def expanded(params):
    """NAME[a-b] as NAMEa ... NAMEb."""
    whole = {}
    for name, value in params.items():
        match = re.search(r"\[(\d+)-(\d+)\]", name)
        for n in range(int(match[1]), int(match[2]) + 1) if match else [None]:
            whole[name if n is None else name.replace(match[0], str(n))] = value
    return whole


def param_list(params):
    lines = [f'"{name}:{value}"' for name, value in params.items()]
    return "{\\\n" + " \\\n".join(lines) + " }"


def names(pins):
    return "{" + " ".join(f'"{pin}"' for pin in pins) + "}"


def braced(words):
    return "{ " + " ".join(words) + " }"
