# SPDX-License-Identifier: MIT
"""A handful of cases of each part of the campaign, against the strict list of those that fail today."""
import tomllib
from pathlib import Path

import pytest

from launcher.parts import PARTS, parse, plan_part, run_part_case

EXPECTED_FILE = Path(__file__).with_name("expected_parts.toml")
CASES = [
    "start:teknic_m2310p/free/90", "start:maxon_ec22/hoist20/1", "start:teknic_m2310p/again/135",
    "wiring:teknic_m2310p/swap_BC", "wiring:mjbots_mj5208/open_B", "supervision:teknic_m2310p/slip60/speed100/load50",
    "supervision:maxon_ec45flat/open_A/speed50/load50", "detune:maxon_ec22/default/L*2",
    "sensorless:teknic_m2310p/flying/-60", "sensorless:maxon_ec45flat/lost/thrown", "saliency:thor_pmsyrm/lock/90",
    "start:lot:28/hoist50/30", "start:lot:28/hoist50/90", "start:lot:22/hoist20/0",
    "wiring:teknic_m2310p/pole_pairs=5", "supervision:teknic_m2310p/quickstop/no_chopper", "start:dys_be8108/friction20/180",
    "wiring:maxon_ec45flat/counts*1.02", "wiring:teknic_m2310p/turning_3",
    "wiring:teknic_m2310p/sensor_B_negative", "wiring:estun_emj04apb22/encoder_reversed",
    "wiring:teknic_m2310p/reversed_and_CA", "wiring:teknic_m2310p/locked", "wiring:teknic_m2310p/brake",
    "wiring:mjbots_mj5208/sensors_CAB",
    "supervision:hoverboard_350w/slip120/speed50/load100",
    "sensorless:thor_pmsyrm/flying/20", "saliency:thor_pmsyrm/hold1/45/silent",
]
LONG = ["identify:maxon_ec45flat/seed2", "wiring:qs138_3kw/encoder_frozen", "supervision:estun_emj04apb22/reversal/chopper",
        "detune:hoverboard_350w/default/R*2_L*0.5", "identified:thor_pmsyrm/seed1", "identify:lot:112/seed1"]
HOISTED = ("lot:22", "lot:28")  # an outrunner and a traction motor, from twelve angles: right, or not at all
LONG += sorted({f"start:{motor}/hoist{size}/{angle}" for motor in HOISTED for size in (20, 50) for angle in range(0, 360, 30)}
               - set(CASES)) + ["start:lot:28/hoist50/200"]


def expected(path=EXPECTED_FILE):
    """{PartCase: cause}"""
    return {parse(key): cause for cause in tomllib.loads(path.read_text()).get("cause", []) for key in cause["cases"]}


@pytest.mark.parametrize("case", [parse(key) for key in CASES] + [
    pytest.param(parse(key), marks=pytest.mark.night) for key in LONG], ids=lambda case: case.key)
def test_case(case, tmp_path):
    outcome, cause = run_part_case(case, tmp_path), expected().get(case)
    border = cause and cause.get("border")
    assert outcome["passed"] or cause and border in (None, outcome["outcome"]), \
        f"{case.command} fails: {outcome['outcome']}: {outcome['why']}"
    assert not outcome["passed"] or not cause or border, f"{case.command} passes now: take it out of {EXPECTED_FILE.name}"


def test_the_sample_is_of_every_part_and_the_list_of_the_sample():
    cases = [parse(key) for key in CASES + LONG]
    assert {case.part for case in cases} == set(PARTS) and set(expected()) <= set(cases)
    for case in cases:
        load, *rest = case.what.split("/")
        options = {"angles": rest[0], "loads": load} if case.part == "start" and load != "again" else {}
        planned = plan_part(case.part, [case.motor], {**options, "motors": case.motor})
        assert case in planned, f"{case.key} is no case of its part"
