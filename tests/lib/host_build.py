# SPDX-License-Identifier: MIT
"""Compiles the library and its C test programs for the host, into $BUILD/tests/lib."""
import fcntl
import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
TRIG_FRACS = (1, 15, 16, 30, 31)
WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wundef", "-Wmissing-prototypes", "-Werror"]
SANITIZERS = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer"]

KERNELS = ROOT / "tests" / "bench" / "kernels_shipped.c"
LIBRARY = [ROOT / "lib" / f"{name}.c" for name in ("Lib", "LibFoc", "trig", "polar")]


def build_dir():
    path = Path(os.environ.get("BUILD", "build"))
    path = (path if path.is_absolute() else ROOT / path) / "tests" / "lib"
    path.mkdir(parents=True, exist_ok=True)
    return path


def host_cc():
    return os.environ.get("HOSTCC", "cc")


def compile_host(target, sources, flags):
    """Compile unless `target` is newer than everything it could depend on; safe with several pytest workers."""
    inputs = [*ROOT.glob("lib/*"), *HERE.glob("*.[ch]"), *ROOT.glob("tests/bench/kernels*"), HERE / "host_build.py"]
    with open(target.parent / ".lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if target.exists() and target.stat().st_mtime > max(path.stat().st_mtime for path in inputs):
            return target
        command = [host_cc(), "-std=c11", "-I", str(ROOT), *WARNINGS, *flags, *map(str, sources), "-lm", "-o", str(target)]
        result = subprocess.run(command, capture_output=True, text=True)
        assert result.returncode == 0, " ".join(command) + "\n" + result.stderr
    return target
