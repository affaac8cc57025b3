# SPDX-License-Identifier: MIT
"""A mistake in a file of the firmware, made before a program that plays the drive's own code: a library loaded before the real
one holds the file's functions once more."""
import os
import subprocess

from rigs.firmware import HERE, ROOT

FLAGS = ["-std=gnu11", "-O1", "-Wall", "-Wextra", "-Werror", "-Wno-int-to-pointer-cast", "-Wno-unused", f"-I{HERE / 'host'}",
         f"-I{ROOT}", "-fPIC", "-shared", "-fsanitize-coverage=trace-pc", "-fsanitize=undefined", "-fno-sanitize-recover=all"]


def planted(folder, path, before, after, *flags):
    """What the environment of the program has beside the usual, for the mistake to be there."""
    text = (ROOT / "firmware" / path).read_text()
    assert text.count(before) == 1, f"firmware/{path} has {text.count(before)} times what this breaks: {before}"
    source, library = folder / "mistake.c", folder / f"mistake{len(flags)}.so"
    source.write_text(text.replace(before, after))
    result = subprocess.run([os.environ.get("HOSTCC") or "cc", *FLAGS, *flags, source, "-o", library], cwd=folder,
                            capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return {"LD_PRELOAD": str(library)}
