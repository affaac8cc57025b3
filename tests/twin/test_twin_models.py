# SPDX-License-Identifier: MIT
"""The models of the twin, without QEMU: every twin_*.c of this folder is a program that checks some of them."""
import fcntl
import os
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
TWIN = ROOT / "qemu" / "twin"
_PHYSICS = re.search(r"TWIN_PHYSICS := ((?:.*\\\n)*.*)\n", (TWIN / "twin.mk").read_text()).group(1)
MODELS = [name for name in _PHYSICS.replace("\\", "").split() if name not in ("config", "cycles_keys")]
MODELS += ["cycles_cache", "sysreg", "watchdog"]  # of the core's side what needs no core
PROGRAMS = sorted(path.stem for path in HERE.glob("twin_*.c"))
FLAGS = ["-std=gnu11", "-O1", "-g", "-Wall", "-Wextra", "-Wshadow", "-Werror", "-fsanitize=address,undefined",
         "-fno-sanitize-recover=all", f"-I{TWIN}", f"-I{HERE}"]
CLOSING = re.compile(r"(\d+) passed, (\d+) failed")


def compile_host(folder, *arguments):
    command = [os.environ.get("HOSTCC", "cc"), *FLAGS, *map(str, arguments)]
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert result.returncode == 0, " ".join(command) + "\n" + result.stderr


@pytest.fixture(scope="module")
def models():
    """A folder with the models and the bench as objects; kept between runs, safe with several pytest workers."""
    folder = ROOT / os.environ.get("BUILD", "build") / "tests" / "twin"
    folder.mkdir(parents=True, exist_ok=True)
    sources = [*(TWIN / f"{name}.c" for name in MODELS), HERE / "check.c", HERE / "bench.c"]
    objects = [folder / f"{source.stem}.o" for source in sources]
    inputs = max(path.stat().st_mtime for path in [*TWIN.glob("*.[ch]"), *HERE.iterdir()] if path.is_file())
    with open(folder / ".lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not all(path.exists() and path.stat().st_mtime > inputs for path in objects):
            compile_host(folder, "-c", *sources)
    return folder, objects


@pytest.mark.parametrize("program", PROGRAMS)
def test_model(models, program):
    folder, objects = models
    compile_host(folder, HERE / f"{program}.c", *objects, "-o", program, "-lm")
    result = subprocess.run([folder / program], capture_output=True, text=True, timeout=60)
    *checks, closing = result.stdout.splitlines() or [""]
    assert not [line for line in checks if not line.startswith("ok ")], result.stderr
    assert result.returncode == 0 and CLOSING.fullmatch(closing), closing + "\n" + result.stderr
    assert CLOSING.fullmatch(closing).groups() == (str(len(checks)), "0") and len(checks) > 10
