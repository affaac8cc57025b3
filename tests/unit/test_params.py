# SPDX-License-Identifier: MIT
"""The table of parameters: every row names its own field, holds its initial value in its range, and is found by its name."""
from rigs.firmware import ROOT
from rows import param_rows


def fields():
    return list(param_rows(ROOT))


def test_every_field_has_one_row_at_its_place(c):
    names = fields()
    assert len(names) > 15
    params = c.params()
    for name in names:
        info = c.param_find(name.encode())
        assert info, f"{name} has no row"
        assert info.contents.name.decode() == name
        assert info.contents.offset == getattr(c.params, name).offset, f"{name}'s row is another field's"
        for value in (info.contents.min, info.contents.max, 12345):
            c.param_set(params, info, value)
            assert getattr(params, name) == value == c.param_get(params, info)


def test_initial_values_are_in_their_ranges_and_fit_together(c):
    params = c.params()
    c.params_init(params)
    for name in fields():
        info = c.param_find(name.encode()).contents
        assert info.min <= info.initial <= info.max
        assert getattr(params, name) == info.initial
    assert c.tuning_compute(params, c.tuning()).error == c.ERROR_NONE


def test_units_follow_from_names(c):
    units = {name: c.param_unit(c.param_find(name.encode())).decode() for name in fields()}
    some = {"i_max_ma": "mA", "v_max_mv": "mV", "resistance_mohm": "mohm", "ld_uh": "uH", "flux_uwb": "uWb",
            "ramp_rpm_s": "rpm/s", "speed_max_rpm": "rpm", "retry_delay_ms": "ms", "winding_tau_s": "s",
            "following_mturn": "mturn", "inertia_gmm2": "g mm2", "t_max_c": "degC", "friction_unm": "uNm"}
    assert {name: units[name] for name in some} == some
    assert {name for name, unit in units.items() if not unit} == {
        "pole_pairs", "emf_beyond_v_max", "pwm_update", "pwm_samples", "overmodulation", "low_side_shunts", "modulator_osr",
        "angle_source", "direction", "hall_states", "retry_count", "modbus_address", "modbus_parity", "can_node", "can_kbit",
        "can_recover", "injection_silent"}


def test_what_is_not_there_is_not_found(c):
    for name in ("", "pole_pair", "pole_pairss", "POLE_PAIRS", "all"):
        assert not c.param_find(name.encode())
