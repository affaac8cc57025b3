# SPDX-License-Identifier: MIT
"""Motor files that somebody has changed, and what is said of them."""
import re

import pytest
from launcher import LauncherError
from launcher.drive import load_drive
from launcher.paths import REPO

SMALLEST = re.search(r"```toml\n(name = .*?)```", (REPO / "docs" / "motors.md").read_text(), re.S).group(1)


def changed(text, tmp_path, **factors):
    """The file with these keys of it times a factor, where they come first."""
    for key, factor in factors.items():
        text, count = re.subn(rf"(?m)^({key}\s*= {{ value = )([^,]+)",
                              lambda m, f=factor: f"{m[1]}{float(m[2]) * f:.9g}", text, count=1)
        assert count == 1, key
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return str(path)


def refusal(path, **settings):
    with pytest.raises(LauncherError) as raised:
        load_drive(path, **settings)
    assert "\n" not in str(raised.value)
    return str(raised.value)
