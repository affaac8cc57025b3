# SPDX-License-Identifier: MIT
import os
import re
import subprocess
import sys

import pytest
import time_profile as tp


FILES = (("cycles_price", "cycle model"), ("core", "cycle model"), ("pwm", "fabric"), ("fabric_rtl", "fabric"),
         ("supply", "plant"),
         ("trace_csv", "trace"), ("qemu_plugin", "link to QEMU, board"), ("motor_step", "plant"), ("??", "plant"))


@pytest.mark.parametrize("file, part", FILES)
def test_a_file_belongs_to_one_part(file, part):
    assert tp.part_of([(name, f"^({pattern})$") for name, pattern in tp.PARTS], file) == part


@pytest.mark.parametrize("place, part", [("/usr/lib/x86_64-linux-gnu/libm.so.6", "plant"), ("[JIT] tid 12", "translated code"),
                                         ("[kernel.kallsyms]", "kernel"), ("/usr/bin/qemu-system-arm", "QEMU"),
                                         ("/usr/lib/x86_64-linux-gnu/libglib-2.0.so.0", "QEMU")])
def test_a_library_belongs_to_one_part(place, part):
    assert tp.part_of(tp.LIBRARIES, place) == part


def test_every_file_of_the_plugin_is_there_under_its_own_name():
    """A file that is renamed would be counted as the plant's in silence."""
    text = (tp.ROOT / "qemu" / "twin" / "twin.mk").read_text()
    lists = (r"TWIN_PHYSICS := (.*?)#", r"TWIN_PLUGIN := (.*?)\n\n")
    files = {name for pattern in lists for name in re.search(pattern, text, re.S)[1].split()}
    for part, pattern in tp.PARTS[:-1]:
        for name in pattern.split("|"):
            assert any(re.fullmatch(name, file) for file in files), (part, name)


def test_without_perf_it_says_what_to_install(tmp_path):
    answer = subprocess.run([sys.executable, tp.__file__], env={**os.environ, "PATH": str(tmp_path)}, capture_output=True,
                            text=True)
    assert answer.returncode == 1 and answer.stderr == "mssfoc: make profile needs perf: apt-get install linux-perf\n"
