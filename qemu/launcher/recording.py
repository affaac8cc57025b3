# SPDX-License-Identifier: MIT
"""The twin's files of numbers (qemu/twin/recording.h): a line of column names, then rows of little-endian doubles."""
import numpy as np

from .errors import LauncherError
from .paths import shown


def read_recording(path, what):
    """{column: array} of a file that is `what`."""
    try:
        with open(path, "rb") as file:
            head = file.readline()
            data = np.fromfile(file, "<f8")
    except OSError as error:
        raise LauncherError(f"no {what}: cannot read {shown(path)}: {error.strerror}") from error
    names = head.decode("ascii", "replace").rstrip("\n").split(",")
    if not head.endswith(b"\n") or len(data) % len(names):
        raise LauncherError(f"{shown(path)} is damaged: not a whole number of rows under {len(names)} names")
    columns = np.ascontiguousarray(data.reshape(-1, len(names)).T)
    return dict(zip(names, columns))
