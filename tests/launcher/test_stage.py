# SPDX-License-Identifier: MIT
"""A motor that its power stage cannot drive is refused before it is played; what that line names does fit. The bounds are the
firmware's own."""
import random
import re

import pytest
from launcher.data import INVERTERS, MOTORS, available, load_inverter, load_motor
from launcher.drive import console_params, load_drive
from launcher.stage import _limits

from rigs.firmware import built
from rigs.motor_files import SMALLEST, changed, refusal
from unit.cinterface import Library

# a maxon EC 13 of 6 W for 24 V, about
SMALL = {"pole_pairs": 1 / 4, "resistance_ohm": 6 / 0.36, "ld_h": 0.75, "lq_h": 0.75, "flux_wb": 2.2 / 6.4,
         "inertia_kgm2": 3e-8 / 7e-6, "rated_current_a": 0.1, "rated_torque_nm": 2.3e-3 / 0.27, "rated_speed_rpm": 8,
         "max_speed_rpm": 6}


def test_a_motor_too_small_for_its_stage(tmp_path):
    text = SMALLEST.replace("lv24_drv8323", "lv24_drv8316")
    said = refusal(changed(text, tmp_path, **SMALL))
    found = re.search(r"too small for inverter lv24_drv8316: resistance_ohm 6, where \S+ to (\S+) can be driven with"
                      r" i_range_a 11, v_range_v \S+: i_range_a of at most (\S+) would fit", said)
    assert found, said
    load_drive(changed(text, tmp_path, **{**SMALL, "resistance_ohm": 0.99 * float(found[1]) / 0.36}))
    stage = (INVERTERS / "lv24_drv8316.toml").read_text()
    stage = re.sub(r"(?m)^(i_range_a\s*= { value = )[^,]+", rf"\g<1>{0.99 * float(found[2])}", stage)
    (tmp_path / "stage.toml").write_text(stage)
    load_drive(changed(text.replace("lv24_drv8316", "stage.toml"), tmp_path, **SMALL))


def test_a_stage_that_fits_is_named(tmp_path):
    """Half of the same motor's resistance again is too much for the next stage as well, a tenth of it for none."""
    said = refusal(changed(SMALLEST.replace("lv24_drv8323", "lv24_drv8323"), tmp_path, **{**SMALL, "resistance_ohm": 3 / 0.36}))
    assert "resistance_ohm 3, where" in said and said.endswith("would fit, or inverter lv24_drv8316")


def test_a_current_of_a_few_steps(tmp_path):
    tiny = {**SMALL, "rated_current_a": 0.05 / 7.1, "rated_torque_nm": 1.65e-4 / 0.27, "inertia_kgm2": 3e-9 / 7e-6}
    assert "rated_current_a 0.05, where at least 0.46 can be driven" in refusal(changed(SMALLEST, tmp_path, **tiny))


@pytest.mark.parametrize("slip, said", [
    ({"inertia_kgm2": 1e4}, "takes 81.4 s to bring the bare rotor"), ({"inertia_kgm2": 1e7}, "1 g cm2 is 1e-7 kg m2"),
    ({"ld_h": 1000, "lq_h": 1000}, "takes 1.78e+03 V a phase"), ({"ld_h": 1e-3, "lq_h": 1e-3}, "no winding is so quick"),
    ({"resistance_ohm": 1e-3}, "no winding loses so little"), ({"resistance_ohm": 1000}, "or at most 200 ohm would fit"),
    ({"flux_wb": 1000}, "flux_wb 0.00634 would fit")])
def test_milli_and_micro(tmp_path, slip, said):
    assert said in refusal(changed(SMALLEST, tmp_path, **slip))


def test_what_is_only_asked_about(tmp_path):
    notes = load_drive(changed(SMALLEST, tmp_path, rated_speed_rpm=0.105, max_speed_rpm=0.105)).notes
    assert any("is it in rpm? From rad/s it were 3008" in note for note in notes)
    assert not any("rpm?" in note for note in load_drive(changed(SMALLEST, tmp_path)).notes)


def test_friction_by_rule_is_told_and_what_is_given_stays(tmp_path):
    """Without any a shaft that turns once never stands still again, and `on` waits for that."""
    drive = load_drive(changed(SMALLEST, tmp_path))
    assert drive.motor["mechanical"]["friction_coulomb_nm"] == pytest.approx(0.0027)
    assert any(note.startswith("friction_coulomb_nm 0.0027 by rule") for note in drive.notes)
    given = SMALLEST.replace("[mechanical]\n", "[mechanical]\nfriction_coulomb_nm = { value = 0, source = 'none' }\n")
    drive = load_drive(changed(given, tmp_path))
    assert drive.motor["mechanical"]["friction_coulomb_nm"] == 0 and not any("by rule" in note for note in drive.notes)


@pytest.fixture(scope="module")
def c():
    return Library(built("firmware.so"))


def refuses(c, told, **values):
    params, tuning = c.params(), c.tuning()
    c.params_init(params)
    for name, value in {**told, **values}.items():
        setattr(params, name, value)
    error = c.tuning_compute(params, tuning).error
    return error in (c.ERROR_CURRENT_GAIN, c.ERROR_CURRENT_INTEGRAL_GAIN, c.ERROR_DECOUPLING)


PARAM = {"resistance_ohm": ("resistance_mohm", 1e3), "ld_h": ("ld_uh", 1e6), "lq_h": ("lq_uh", 1e6),
         "flux_wb": ("flux_uwb", 1e6)}


@pytest.mark.parametrize("name", available(MOTORS))
def test_the_bounds_are_the_firmwares(c, name):
    motor = load_motor(name)
    told = console_params(load_drive(name))
    told.update(ld_apparent_uh=0, lq_apparent_uh=0, lq_rest_uh=0)
    draw = random.Random(name)
    for key, _, _, most, _ in _limits(motor, load_inverter(motor.inverter, motor.path)):
        if key in PARAM:
            param, units = PARAM[key]
            if 1.02 * most * units < 2e7:
                assert not refuses(c, told, **{param: int(draw.uniform(0.5, 0.98) * most * units)}), key
                assert refuses(c, told, **{param: int(1.02 * most * units) + 1}), key
