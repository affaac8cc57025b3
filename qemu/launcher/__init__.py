# SPDX-License-Identifier: MIT
"""The host side of a run: data files -> twin configuration -> QEMU -> trace -> figures, verdicts, report and plot.

Tests use the same path as `make run`:

    from launcher import simulate
    result = simulate("default", motor="teknic_m2310p", out_dir=tmp_path)
    result.figures["thd"].value, result.trace["i_a_A"], result.console
"""
import sys

from .paths import QEMU_DIR

sys.path.append(str(QEMU_DIR / "client"))  # mssfoc.dwarf: what an ELF says

from .errors import LauncherError  # noqa: E402
from .simulate import Result, simulate  # noqa: E402

__all__ = ["LauncherError", "Result", "simulate"]
