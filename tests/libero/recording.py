# SPDX-License-Identifier: MIT
"""Plays a project's Tcl to the recorder, and hands back its calls."""
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

RECORDER = Path(__file__).with_name("recorder.tcl")


class Call(NamedTuple):
    name: str
    words: list       # without options
    options: dict     # option: [values]; a flag has none

    def one(self, option):
        return self.options.get(option, [""])[0]

    def params(self):
        """{NAME: VALUE} of "NAME:VALUE" "NAME:VALUE"..."""
        return dict(word.split(":", 1) for word in listed(self.one("-params")))


def listed(text):
    """The elements of a list of Tcl as the generator writes them: blanks between words, quotes around some."""
    return [word.strip('"') for word in text.replace("\\\n", " ").split()]


def is_number(word):
    return word.lstrip("-").replace(".", "", 1).isdigit()


def parsed(words, known):
    name, *rest = words
    flags = known.get(name, {}).get("flags", [])
    positional, options = [], {}
    while rest:
        word = rest.pop(0)
        if not word.startswith("-") or is_number(word):
            positional.append(word)
        elif word in flags or not rest:
            options.setdefault(word, [])
        else:
            options.setdefault(word, []).append(rest.pop(0))
    return Call(name, positional, options)


class Failed(Exception):
    """The script ended with an error."""


def play(script, folder, known):
    """The calls of a script that runs in `folder`."""
    with tempfile.NamedTemporaryFile() as out:
        done = subprocess.run(["tclsh", RECORDER, out.name, script, *known], cwd=folder, capture_output=True, text=True)
        if done.returncode:
            raise Failed(f"{script}: {done.stderr.strip()}")
        lines = Path(out.name).read_text(encoding="ascii").splitlines()
    return [parsed([bytes.fromhex(word[1:]).decode() for word in line.split(" ")], known) for line in lines]


def project(folder, known):
    """{script: calls}: the project with all that it sources, the eNVM's client that it writes, and both constraint files."""
    return {name: play(name, folder, known) for name in ("project.tcl", "envm.cfg", "io.pdc", "timing.sdc")}
