# SPDX-License-Identifier: MIT
"""The checksums which the target is held to are those of the host's build, whose results the other tests here prove."""
import re
import subprocess

from host_build import HERE, LIBRARY, ROOT, SANITIZERS, build_dir, compile_host

HEADER = ROOT / "tests" / "target" / "lib_golden.h"


def test_target_is_held_to_the_host():
    program = compile_host(build_dir() / "golden", [HERE / "golden.c", *LIBRARY], ["-O1", *SANITIZERS])
    host = subprocess.run([program], capture_output=True, text=True, check=True, timeout=60).stdout.split()
    stated = re.findall(r"LIB_GOLDEN\(\"[^\"]+\",\s*0x([0-9A-F]{8})u\)", HEADER.read_text())
    assert stated == host
