# SPDX-License-Identifier: MIT
"""What the guides tell their reader to type, and whether what they show is stale."""
import difflib
import os
import re
import subprocess

from guides.transcript import ROOT, renewed, same

GUIDES = sorted((ROOT / "docs" / "guides").glob("*.md"))
SHELL = re.compile(r"^ *```sh\n(.*?)^ *```", re.DOTALL | re.MULTILINE)
ELSEWHERE = {  # these are run by tests of their own, or by CI as a whole; here make must know them
    "make run", "make test", "make fabric", "make console", "make debug", "make flash PROBE=openocd",
    "make flash PROBE=jlink", "make PWM_HZ=16000 DEAD_TIME_NS=800 BUILD=build/another_rate", "make lint",
    'make FEATURES="encoder console settings" BUILD=build/least'}


def lines():
    found = [line.strip() for guide in GUIDES for block in SHELL.findall(guide.read_text()) for line in block.splitlines()]
    return sorted({line for line in found if line and not line.startswith("#")})


def shell(line, folder):
    env = os.environ | {"NO_INSTALL": "1"}
    return subprocess.run(line, shell=True, cwd=folder, env=env, capture_output=True, text=True, stdin=subprocess.DEVNULL,
                          check=False)


def stale(guide, folder):
    """What a guide shows of the console, against what the drive says; nothing when only numbers differ."""
    shown, now = guide.read_text().splitlines(), renewed(guide.read_text(), folder).splitlines()
    if len(shown) == len(now) and all(map(same, shown, now)):
        return ""
    return "\n".join(["stale; /usr/bin/python3 tests/guides/transcript.py writes it anew:",
                      *difflib.unified_diff(shown, now, "shown", "now", n=1, lineterm="")])
