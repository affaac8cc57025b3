# SPDX-License-Identifier: MIT
"""What the locked cache is for: without it, the current loop takes longer whenever other code has run."""
import pytest

from bench.measure import COLD, closed_loop_of
from launcher.paths import build_dir

UNLOCKED = "design 0x18 0x0 0x4"  # the design keeps the firmware from setting CC_CACHE_LOCK
SHORT = {
    "key": "short", "title": "a short while in operation", "end_s": 0.9, "preamble_s": 0.05,
    "step": [{"t_s": 0.15, "console": "on"}, {"t_s": 0.5, "console": "speed 1500"}, {"t_s": 0.8, "console": "status"}],
}


@pytest.mark.parametrize("lines, locked", [((), True), ((COLD,), True), ((UNLOCKED,), False), ((UNLOCKED, COLD), False)],
                         ids=("as built", "cold", "unlocked", "unlocked, cold"))
def test_the_lock_keeps_the_worst_near_the_typical(tmp_path, lines, locked):
    whole = closed_loop_of(SHORT, build_dir(None), tmp_path, lines)["current_loop.interrupt"]
    assert whole["interrupts"] > 5000
    if locked:
        assert whole["cycles_max"] == whole["cycles_min"]
    else:
        assert whole["cycles_max"] > 2 * 248
