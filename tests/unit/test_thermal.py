# SPDX-License-Identifier: MIT
"""The thermal model against its differential equations in floating point."""
import ctypes

import pytest

SHARE, TAU_W, TAU_H, T_MAX, AMBIENT, ZERO = 0.4, 60, 1200, 130, 40, 235


def code(celsius):
    """Of a sensor that is there: docs/fabric.md, TEMP."""
    return min(max(round(800 + 16 * celsius), 1), 4095)


class Model:
    """What firmware/monitor/thermal.h says, solved in small steps."""
    def __init__(self):
        self.winding = self.housing = 0.0

    def follow(self, seconds, share_of_rated):
        rise = T_MAX - AMBIENT
        for _ in range(round(seconds * 10)):
            loss = share_of_rated**2 * (ZERO + self.celsius) / (ZERO + T_MAX)
            self.winding += (SHARE * rise * loss - self.winding) * 0.1 / TAU_W
            self.housing += ((1 - SHARE) * rise * loss - self.housing) * 0.1 / TAU_H
        return self.celsius

    @property
    def celsius(self):
        return AMBIENT + self.winding + self.housing


class Warm:
    def __init__(self, c, memory=None, **params):
        self.c, self.axis, self.thermal = c, c.axis(), c.thermal()
        c.drive_init(self.axis, c.fabric())
        for name, value in params.items():
            setattr(self.axis.params, name, value)
        self.memory = memory
        c.thermal_init(self.thermal, memory, self.axis.params)

    def follow(self, seconds, share_of_rated, sensor=0):
        self.axis.loop.i_q_q15 = round(share_of_rated * 7.1 / 23.571 * 32768)
        for _ in range(round(seconds * 250)):
            self.c.thermal_step(self.thermal, self.axis.loop, sensor)
        return self.thermal.winding_q4 / 16


@pytest.fixture
def warm(c):
    return lambda *args, **params: Warm(c, *args, **params)


@pytest.mark.parametrize("share", (0.5, 1.0, 1.5))
def test_it_warms_and_cools_as_its_equations_say(warm, share):
    model, th = Model(), warm()
    for seconds, current in ((30, share), (120, share), (200, 0.0)):
        assert th.follow(seconds, current) == pytest.approx(model.follow(seconds, current), abs=0.6)


def test_rated_current_for_ever_ends_at_t_max(warm):
    th = warm(winding_tau_s=1, housing_tau_s=20)
    assert th.follow(160, 1.0) == pytest.approx(T_MAX, abs=0.6)


def test_the_limit_falls_over_the_last_ten_kelvin(warm):
    th = warm(winding_tau_s=1, housing_tau_s=1)
    factors = {}
    for _ in range(200):
        celsius = th.follow(0.1, 1.2)
        factors[celsius] = th.thermal.factor_q15 / 32768
    for celsius, factor in factors.items():
        assert factor == pytest.approx(min(1, max(0, (T_MAX - celsius) / 10)), abs=1e-4)
    assert max(factors.values()) == 1.0 and min(factors.values()) == 0.0


def test_the_warmer_of_model_and_sensor_counts(warm):
    th = warm()
    assert th.follow(0.2, 0.0, sensor=800 + 16 * 20) == AMBIENT
    assert th.follow(0.2, 0.0, sensor=800 + 16 * 125) == 125
    assert th.thermal.factor_q15 == pytest.approx(16384, abs=2)
    assert th.follow(0.2, 0.0, sensor=0) == AMBIENT, "none is fitted"


BROKEN = {"open": -55, "shorted": 300, "at the top of the range": 205, "colder than any place": -45}


@pytest.mark.parametrize("celsius", BROKEN.values(), ids=BROKEN)
def test_a_sensor_that_shows_what_cannot_be_is_told_and_the_model_protects(warm, celsius):
    """As long as it does, and two seconds on; again when it comes again."""
    th, fails = warm(), []
    codes = {"right": code(40), "wrong": code(celsius)}
    for shows in ("right", "wrong", "right", "wrong"):
        for _ in range(3):
            assert th.follow(1, 0.0, codes[shows]) == AMBIENT and th.thermal.factor_q15 == 32768
            fails.append(th.thermal.sensor_fails)
    assert fails == [False] * 3 + [False, True, True] + [True, False, False] + [False, True, True]


def test_a_sensor_that_is_lost_is_told_and_one_that_never_was_is_not(warm):
    """The fabric says 0 for none, and for one whose line is cut or shorted."""
    th = warm()
    th.follow(10, 0.0, 0)
    assert not th.thermal.sensor_fails
    th.follow(1, 0.0, code(25))
    th.follow(3, 0.0, 0)
    assert th.thermal.sensor_fails and th.thermal.winding_q4 / 16 == AMBIENT


@pytest.mark.parametrize("t_max", (90, 130, 155))
def test_a_sensor_far_from_the_model_is_told_and_surroundings_cooling_and_a_hot_start_are_not(warm, t_max):
    cold, hot = (warm(t_max_c=t_max, winding_tau_s=1, housing_tau_s=1) for _ in range(2))
    for celsius in (-39, 0, 60, t_max - 1):
        cold.follow(5, 0.0, code(celsius))
        assert not cold.thermal.sensor_fails, celsius
    cold.follow(5, 0.0, code(max(t_max + 10, 121) + 2))
    assert cold.thermal.sensor_fails and cold.thermal.factor_q15 == 0, "and it counts"
    half = (t_max + AMBIENT) / 2
    hot.follow(20, 1.0, code(half))
    assert not hot.thermal.sensor_fails and hot.thermal.winding_q4 / 16 > t_max - 1
    hot.follow(5, 1.0, code(-39))
    assert hot.thermal.sensor_fails


def test_the_warning_stands_as_long_as_the_sensor_fails_whether_on_or_off(c):
    """In the status word's bit, the warnings' words, and for the console; `on` forgets no warning that lasts."""
    axis, fabric = c.axis(), c.fabric()
    c.drive_init(axis, fabric)
    axis.fabric_untrusted, axis.state = 0, c.AXIS_SWITCH_ON_DISABLED
    for celsius, warned in ((25, False), (-55, True), (25, False)):
        fabric.adc.TEMP = code(celsius)
        for _ in range(3000):
            c.drive_step(axis)
        assert c.fault_warned(axis.reports, c.FAULT_TEMPERATURE_SENSOR) == warned
        c.fault_clear_warnings(axis.reports)
        for _ in range(100):
            c.drive_step(axis)
        assert c.fault_warned(axis.reports, c.FAULT_TEMPERATURE_SENSOR) == warned


def test_the_power_stage_has_a_body_of_its_own(warm):
    th = warm(inverter_ma=7100, inverter_tau_ms=1000)
    th.follow(2.5, 1.0)
    assert th.thermal.inverter_q20 / 2**20 == pytest.approx(0.92, abs=0.01) and th.thermal.factor_q15 == 32768
    th.follow(0.22, 1.5)
    assert 1.1 < th.thermal.inverter_q20 / 2**20 < 1.25 and th.thermal.factor_q15 == 0
    th = warm(inverter_ma=0)
    th.follow(3, 3.0)
    assert th.thermal.inverter_q20 == 0


def test_heat_outlives_a_reset_but_not_a_loss_of_the_memory(warm, c):
    memory = c.thermal_memory()
    before = warm(memory)
    hot = before.follow(60, 1.5)
    after = warm(memory)
    assert after.follow(0.2, 0.0) == pytest.approx(hot, abs=1)
    for word in range(ctypes.sizeof(memory) // 4):
        spoilt = c.thermal_memory.from_buffer_copy(memory)
        (ctypes.c_uint32 * 4).from_buffer(spoilt)[word] ^= 0x10000
        assert warm(spoilt).follow(0.2, 0.0) == AMBIENT


def test_an_impossible_current_overflows_nothing(warm):
    th = warm(i_rated_ma=10, winding_tau_s=1, housing_tau_s=1, inverter_ma=10, inverter_tau_ms=100)
    th.axis.loop.i_d_q15 = th.axis.loop.i_q_q15 = -65534
    for _ in range(5000):
        th.c.thermal_step(th.thermal, th.axis.loop, 4095)
    assert th.thermal.winding_q4 / 16 > 1000 and th.thermal.factor_q15 == 0


def test_a_power_stage_that_is_cool_leaves_a_hot_winding_its_limit(warm):
    alone, beside = (warm(inverter_ma=ma, inverter_tau_ms=1000, winding_tau_s=1, housing_tau_s=1) for ma in (0, 30000))
    for seconds, share in ((3, 1.0), (1, 1.1), (1, 1.2), (1, 1.3)):
        for th in (alone, beside):
            th.follow(seconds, share)
        assert beside.thermal.factor_q15 == alone.thermal.factor_q15
    assert beside.thermal.factor_q15 < 32768 and beside.thermal.inverter_q20 < 1 << 18
