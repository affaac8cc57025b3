# SPDX-License-Identifier: MIT
"""compile_commands.json of the image and the twin, for editors: what make would run, as it says itself.

Usage: compile_commands.py OUT, with the output of `make -nB` on standard input."""
import json
import os
import shlex
import sys


def entries(lines, folder):
    for line in lines:
        words = shlex.split(line) if " -c " in line and " -o " in line else []
        if "-c" in words and "-o" in words:
            yield {"directory": folder, "file": words[words.index("-c") + 1], "output": words[words.index("-o") + 1],
                   "arguments": words}


def main():
    found = list(entries(sys.stdin, os.getcwd()))
    if not found:
        sys.exit("mssfoc: make names no compilation; run `make compile_commands.json`")
    with open(sys.argv[1], "w", encoding="utf-8") as out:
        json.dump(found, out, indent=1)


if __name__ == "__main__":
    main()
