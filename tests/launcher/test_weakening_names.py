# SPDX-License-Identifier: MIT
"""How far each motor's field can be weakened, and that those that cannot are named with the reason."""
import dataclasses

import pytest

from launcher import LauncherError, weakening
from launcher.capability import CIRCLE, KEPT, machine_of
from launcher.drive import load_drive
from launcher.scenario import load_scenario
from launcher.weakening import WARM_C, overmodulation_names, weakening_names

# motor -> times its base speed: 2 of surface magnets, 3 of interior ones, less where psi / L does not allow it
REACHES = {"estun_emj04apb22": 2.0, "thor_pmsyrm": 3.0, "baldor_ecs101m0h7ef4": 3.0, "abb_m2bj100l": 2.5, "teknic_m2310p": 1.8,
           "hoverboard_350w": 1.6, "maxon_ec45flat": 1.55}


@pytest.mark.parametrize("motor", REACHES)
def test_as_far_as_psi_by_l_allows(motor):
    drive = load_drive(motor, plant="full", spread=0)
    names = weakening_names(drive)
    assert names["weak_x"] == pytest.approx(REACHES[motor], abs=0.06)
    assert names["weak_sag_rpm"] <= names["weak_rpm"] < names["weak_max_rpm"] < names["weak_overspeed_rpm"]
    supply = drive.inverter["supply"]
    usable_v = KEPT * CIRCLE * supply["vbus_v"] * (0.955 if supply["rectifier_hz"] else 1)
    i_max_a, machine = drive.params["i_max_ma"] / 1000, machine_of(drive, WARM_C)
    most = machine.most_torque(0, 1e9, i_max_a).torque_nm
    assert machine.most_torque(names["base_rpm"] * 0.99, usable_v, i_max_a).torque_nm >= 0.99 * most
    assert machine.most_torque(names["weak_rpm"], usable_v, i_max_a).torque_nm >= 0.34 * most


@pytest.mark.parametrize("pole_pairs, limit_rpm", ((2, 26000), (4, 980 * 60 / 4)))
def test_speeds_end_where_the_firmwares_do(pole_pairs, limit_rpm):
    """On a bus that would take the motor further, as far as a sagged one, too; from 1.3 times the base speed on it is worth."""
    machine = dataclasses.replace(machine_of(load_drive("thor_pmsyrm"), WARM_C), pole_pairs=pole_pairs)

    def names(share):
        base_rpm = weakening._names("", machine, 400, 20)["base_rpm"]  # pylint: disable=protected-access
        return weakening._names("", machine, 400 * limit_rpm / share / base_rpm, 20)  # pylint: disable=protected-access
    for share in (1.33, 1.5):
        assert names(share) == pytest.approx({
            "base_rpm": limit_rpm / share, "weak_x": share, "weak_rpm": limit_rpm, "weak_sag_rpm": limit_rpm,
            "weak_max_rpm": 1.05 * limit_rpm, "weak_overspeed_rpm": 1.15 * limit_rpm}, rel=0.015)
    with pytest.raises(LauncherError, match=f"the firmware's speeds end at {limit_rpm:.0f} rpm"):
        names(1.25)


@pytest.mark.parametrize("motor, why", [("rctimer_gbm5208", "i_max 0.9 A takes 10 % away"), ("maxon_ec22", "takes 4 % away"),
                                        ("qs138_3kw", "takes 23 % away"),
                                        ("dys_be8108", "speeds end at 2800 rpm, 980 Hz"),
                                        ("mjbots_mj5208", "speeds end at 8400 rpm, 980 Hz")])
def test_who_cannot_is_named(motor, why):
    drive = load_drive(motor)
    with pytest.raises(LauncherError, match="no field weakening") as refused:
        load_scenario("field_weakening", drive)
    assert why in str(refused.value) and str(refused.value).startswith(drive.motor.name)


def test_low_side_shunts_forbid_overmodulation():
    with pytest.raises(LauncherError, match="Teknic.*low-side shunts"):
        overmodulation_names(load_drive("teknic_m2310p"))
    assert overmodulation_names(load_drive("estun_emj04apb22"))["weak_x"] > 1.9


def test_an_unknown_theory():
    with pytest.raises(LauncherError, match="no theory 'magic'; there are: weakening, overmodulation"):
        load_scenario({"key": "x", "theory": "magic", "end_s": 1}, load_drive("teknic_m2310p"))
