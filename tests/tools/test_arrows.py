# SPDX-License-Identifier: MIT
"""Arrows between objects: a circle and a way up are told by name, what only goes down is not."""
import os
from pathlib import Path

import arrows


def test_arrows_that_only_go_down_are_fine():
    objects = {"drive/drive": ({"drive_step"}, {"torque_ask"}), "control/torque": ({"torque_ask"}, set())}
    assert not list(arrows.findings(objects))


def test_a_circle_is_told_with_all_who_are_in_it_and_no_other():
    objects = {"drive/a": ({"a"}, {"b"}), "drive/b": ({"b"}, {"c"}), "drive/c": ({"c"}, {"a", "d"}), "drive/d": ({"d"}, set())}
    assert list(arrows.findings(objects)) == ["a circle: drive/a, drive/b, drive/c"]


def test_a_way_up_is_told_with_the_symbol():
    objects = {"fault/latch": ({"fault_raise"}, {"drive_step"}), "drive/drive": ({"drive_step"}, set())}
    assert list(arrows.findings(objects)) == ["fault/latch reaches up to drive/drive: drive_step"]


def test_each_room_of_the_firmware_has_its_place():
    objects = arrows.objects_in(Path(os.environ.get("BUILD", "build")) / "arm/firmware")
    assert len(objects) > 100 and {arrows.room(name) for name in objects} == set(arrows.ROOMS)
    assert not list(arrows.findings(objects))
