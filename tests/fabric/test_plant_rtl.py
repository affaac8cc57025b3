# SPDX-License-Identifier: MIT
"""The plant in RTL: its arithmetic bit for bit, and beside the C plant for a moment. `make fabric` has both for longer."""
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER))

import plant_exact  # noqa: E402
import plant_lockstep  # noqa: E402


def test_every_result_is_exact():
    assert sum(plant_exact.play(seed, 8) for seed in range(1000, 1020)) > 10000


def test_half_a_second_beside_the_c_plant():
    found, rated_a, speed = plant_lockstep.play("teknic_m2310p", 0.5)
    assert found["i_a"] < plant_lockstep.CURRENT_SHARE * rated_a
    assert found["speed"] < plant_lockstep.SPEED_LIMIT * speed
    assert found["angle"] < plant_lockstep.ANGLE_LIMIT_DEG
