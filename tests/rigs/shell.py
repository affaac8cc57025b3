# SPDX-License-Identifier: MIT
"""Commands as a person types them, from the project's folder."""
import os
import subprocess
from pathlib import Path

BUILD = Path(os.environ.get("BUILD", "build")).resolve()


def run(*command, cwd=None, **variables):
    return subprocess.run(command, capture_output=True, text=True, env=os.environ | variables, cwd=cwd,
                          stdin=subprocess.DEVNULL, check=False)
