# SPDX-License-Identifier: MIT
"""From amperes and volts to codes: scale, noise, amplifiers, shunts, what ages, what is sampled late; a range of 20.48 A makes
one code 10 mA. Modulators and their streams. What a row of the trace says of a period."""
import ctypes
import math
import random

import numpy as np
import pytest

from twin.bench import ADC, CENTI, GATE, INVERTER, PWM, STIFF, Plant, c, currents, near, ps

TURN, LSB_A = 2 * math.pi, 25 / 2048


def sensors(seed=1, **changes):
    s = c.sensors()
    c.sensors_init(s, c.sensor_params(**{**CENTI, **changes}), seed)
    return s


def sampled(s, i=(0, 0, 0), bus_v=24.0, t_s=0.0):
    c.sensors_draw_noise(s)
    return [*(c.sensors_current_code(s, k, t_s, i[k]) for k in range(3)), c.sensors_bus_code(s, bus_v)]


# ---- codes ----

@pytest.mark.parametrize("changes, inputs, codes", [
    ({}, (0, 0, 0, 0), (2048, 2048, 2048, 0)), ({}, (1.00, -2.00, 10.24, 24), (2148, 1848, 3072, 2400)),
    ({}, (0.0149, 0.0151, -0.0151, 0.0049), (2049, 2050, 2046, 0)), ({}, (20.47, 20.48, 1e3, 1e3), (4095,) * 4),
    ({}, (-20.48, -20.49, -1e3, -1), (0,) * 4), ({"adc_bits": 10}, (0.019, 0.021, 1e3, 40.95), (2048, 2052, 4092, 4092)),
    ({"i_offset_a_lsb": 7, "i_offset_b_lsb": -11, "i_offset_c_lsb": 4}, (1, 1, 1, 24), (2155, 2137, 2152, 2400)),
    ({"i_gain_a": 1.1, "i_gain_b": 0.5, "i_gain_c": -1}, (1, 1, 1, 24), (2158, 2098, 1948, 2400))])
def test_codes(changes, inputs, codes):
    assert sampled(sensors(**changes), inputs, inputs[3]) == [*codes]


def test_faults_of_a_channel():
    s = sensors()
    s.current[0].add_a, s.current[1].stuck_code = 2, 99
    assert sampled(s, (1, 1, 1)) == [2348, 99, 2148, 2400]


def test_quantisation():
    """Never further than half a step from the truth; uniform errors have a deviation of 0.289 LSB."""
    s, lsb = sensors(), np.random.default_rng(1).uniform(-2048, 2047, 5000)
    error = np.array([c.sensors_current_code(s, 0, 0, 0.01 * one) for one in lsb]) - 2048 - lsb
    assert 0.49 < np.abs(error).max() < 0.5 + 1e-9 and error.mean() == near(0, 4 * 0.289 / math.sqrt(5000))


def test_noise():
    """Four standard errors; quantisation adds 1/12 LSB^2 to the variance."""
    s, count = sensors(42, i_noise_lsb=3, v_noise_lsb=1.5), 10_000
    codes = np.array([sampled(s, (0, 1, -1)) for _ in range(count)]) - (2048, 2148, 1948, 2400)
    expected = np.sqrt(np.array((3, 3, 3, 1.5))**2 + 1 / 12)
    assert codes.mean(0) / expected == near(np.zeros(4), 4 / math.sqrt(count))
    assert codes.std(0) / expected == near(np.ones(4), 4 / math.sqrt(2 * count))
    assert np.corrcoef(codes.T) == near(np.eye(4), 5 / math.sqrt(count)), "channels are independent"


def drawn(count, stream=None, seed=12):
    r = c.random()
    c.random_seed(r, 99)
    c.random_gaussian(r)  # of a pair, whose other is forgotten
    c.random_seed(r, seed) if stream is None else c.random_seed_stream(r, seed, stream)
    return np.array([c.random_gaussian(r) for _ in range(count)])


def test_gaussian_and_the_other_laws():
    x, count = np.abs(drawn(40_000, seed=7)), 40_000
    for n, share in enumerate((0.682689, 0.954500, 0.997300), 1):
        assert (x < n).mean() == near(share, 4 * math.sqrt(share * (1 - share) / count))
    r = c.random()
    c.random_seed(r, 3)
    bell, exponential = (np.array([law(r) for _ in range(20_000)]) for law in (c.random_bell, c.random_exponential))
    assert bell.mean() == near(0, 0.03) and bell.std() == near(1, 0.03) and np.abs(bell).max() < 3.5
    assert exponential.mean() == near(1, 0.03) and exponential.std() == near(1, 0.06) and exponential.min() >= 0


def test_streams_of_a_seed_have_nothing_in_common():
    assert np.array_equal(drawn(100), drawn(100)) and not np.array_equal(drawn(100), drawn(100, seed=13))
    streams = [drawn(2000, stream) for stream in (None, 1, 2, 3)]
    for n, one in enumerate(streams):
        for other in streams[:n]:
            assert all(abs(one[:2000 - shift] @ other[shift:]) < 5 * math.sqrt(2000) for shift in range(10))


# ---- keys ----

def keys():
    n = 0
    table = ctypes.cast(ctypes.addressof(c.sensor_keys), ctypes.POINTER(c.config_key))
    while table[n].name:
        yield table[n]
        n += 1


def defaults():
    p = c.sensor_params()
    for key in keys():
        setattr(p, key.name.decode(), 20.48 if math.isnan(key.initial) else key.initial)
    return p


def test_a_key_for_each_parameter():
    names = [name for name, _ in c.sensor_params._fields_]
    assert sorted(key.name.decode() for key in keys()) == sorted(names)
    for key in keys():
        assert key.min < key.max and (math.isnan(key.initial) or key.min <= key.initial <= key.max), key.name
        assert key.offset == getattr(c.sensor_params, key.name.decode()).offset


def test_defaults_are_in_nobody_s_way():
    p, s = defaults(), c.sensors()
    assert c.sensor_conflict(p) is None
    c.sensors_init(s, p, 3)
    assert not s.follows
    for n in range(20):
        assert sampled(s, (n - 10,) * 3, t_s=n * 7.0)[:3] == [2048 + 100 * (n - 10)] * 3
        assert c.disc_edges(s.disc, TURN * n + 1e-9) == 4096 * n and c.disc_miscounts(s.disc, 4096) == 0


@pytest.mark.parametrize("changes, part", [
    ({"adc_bits": 11.5}, "whole"), ({"shunt": 0.5}, "0 or 1"), ({"skew_b_s": 1.5e-6}, "less than sensor.adc_conversion_s"),
    ({"skew_c_s": 1.9e-6}, "less than sensor.adc_conversion_s"), ({"amp_hz": 999}, "at least 1000"), ({"amp_hz": 1000}, None),
    ({"encoder_counts": 4000.5}, "whole"),
    ({"encoder_index_counts": 1.5}, "whole"), ({"encoder_index_counts": 4096}, "less than sensor.encoder_counts"),
    ({"encoder_phase": -0.25}, "0.25"), ({"encoder_asymmetry": 0.125}, "0.25"), ({"encoder_lost_per_rev": 4097}, "at most"),
    ({"encoder_extra_per_rev": 4097}, "at most"), ({"encoder_counts": 4001}, None),
    ({"encoder_counts": 4001, "encoder_asymmetry": 0.01}, "")])
def test_conflicts(changes, part):
    p = defaults()
    for name, value in changes.items():
        setattr(p, name, value)
    message = c.sensor_conflict(p)
    assert message is None if part is None else part in message.decode() and b"\n" not in message


# ---- a sine among the measured currents ----

@pytest.mark.parametrize("angle", [-3, -1.6, 0, 0.7, 2.5])
def test_a_sine_s_direction_and_phase(angle):
    s = sensors()
    c.sensors_inject(s, 6, 400, angle, 0.25)
    for t in np.arange(0.25, 0.2525, 0.31e-3):
        along = 600 * math.sin(TURN * 400 * (t - 0.25))
        assert sampled(s, t_s=t)[:3] == near(2048 + along * np.cos(angle - np.arange(3) * TURN / 3), 0.51)
    c.sensors_inject(s, 0, 0, 0, 0.26)
    assert sampled(s, t_s=0.261)[:3] == [2048] * 3


def test_a_sine_beside_other_faults():
    """Gain and stuck code act on it as on any current."""
    s = sensors(i_gain_b=0.5)
    s.current[0].add_a, s.current[2].stuck_code = 1, 2000
    c.sensors_inject(s, 8, 1000, 0, 0)
    assert sampled(s, t_s=0.25e-3)[:3] == near(np.array((2948, 1848, 2000)), 0.5)


def test_a_sine_through_the_low_pass():
    """From rest: the stationary answer and what decays."""
    lag, w = 1 / (TURN * 5e3), TURN * 2000
    s = sensors(amp_hz=5e3)
    c.sensors_inject(s, 10, 2000, 0, 0)
    for t in np.arange(1, 400) * 5e-6:
        y = 10 / (1 + (w * lag)**2) * (math.sin(w * t) - w * lag * math.cos(w * t) + w * lag * math.exp(-t / lag))
        assert (sampled(s, t_s=t)[0] - 2048) * 0.01 == near(y, 0.0051)


def test_a_sine_in_the_plant():
    """With the phases blind: a shunt's amplifier is given it all the same."""
    p = Plant(sensors={"shunt": 1})
    p.write(GATE.CONTROL, 0)
    p.run(1e-3)
    c.sensors_inject(p.sensors, 5, 700, 1, 1e-3)
    for _ in range(20):
        row, codes = p.convert()
        along = 5 / LSB_A * math.sin(TURN * 700 * (row.t_s - 1e-3))
        assert codes[:2] == near(along * np.cos(1 - np.arange(2) * TURN / 3), 0.51)
        p.run(20e-6)


# ---- phases sampled one after the other, and a calibration that ages ----

RISE = 2 / 3 * 24 / 30e-6


def on_a_slope(skew_b_s, skew_c_s):
    """A alone at the supply while the trigger comes: a current that rises in A, and falls by half of that in B and C, which
    would be equal if all were sampled at once."""
    p = Plant((1000, 200, 200), {"ld_h": 30e-6, "lq_h": 30e-6, "resistance_ohm": 1e-4}, inverter={**STIFF, "r_on_ohm": 1e-4},
              sensors={"skew_b_s": skew_b_s, "skew_c_s": skew_c_s})
    c.motor_lock(p.motor, True)
    p.trigger_at(2100)
    p.run(70e-6)
    return p


@pytest.mark.parametrize("skew", [(0, 0), (0.6e-6, 0), (0, 1.2e-6), (0.4e-6, 0.8e-6), (0.5e-6, 0.5e-6)])
def test_skew(skew):
    row, codes = on_a_slope(*skew).convert()
    assert row.i_a[0] > 0.5
    assert np.array(codes) * LSB_A == near(np.array(row.i_a) - RISE / 2 * np.array((0, *skew)), 0.6 * LSB_A)


def test_the_conversion_s_end_is_the_same_whatever_the_skew():
    p = on_a_slope(0.4e-6, 1.4e-6)
    p.write(ADC.CONTROL, 1)
    end = p.next_trigger() + ps(1.5e-6)
    for at, eoc in ((end - 1, 0), (end, 1)):
        p.to(at)
        assert p.read(ADC.STATUS) == eoc


def test_a_reset_forgets_the_samples_to_come():
    p = on_a_slope(1.2e-6, 1.2e-6)
    p.write(ADC.CONTROL, 1)
    while p.next_sample == 2**63 - 1:
        p.run(0.1e-6)
    c.plant_reset_fabric(p.p)
    assert p.next_sample == 2**63 - 1
    p.run(100e-6)
    assert p.read(ADC.SEQUENCE) == 0


@pytest.mark.parametrize("t", np.arange(0, 30, 3.7))
def test_drift(t):
    """A and B apart; C stays."""
    aged = sampled(sensors(i_offset_a_lsb=5, i_offset_drift_lsb_s=2), t_s=t)[:3]
    assert aged == near(2048 + np.array((5 + 2 * t, -2 * t, 0)), 0.5)
    gained = sampled(sensors(i_gain_drift_per_s=1e-2), (10, 10, 10), t_s=t)[:3]
    assert gained == near(2048 + 1000 * np.array((1 + 0.01 * t, 1 - 0.01 * t, 1)), 0.5)


def test_drift_in_the_plant():
    p = Plant(sensors={"i_offset_drift_lsb_s": 1000})
    p.write(GATE.CONTROL, 0)
    p.run(20e-3)
    row, codes = p.convert()
    assert codes[:2] == near(1000 * row.t_s * np.array((1, -1)), 0.5) and row.t_s == near(0.02, 5e-5)


# ---- amplifiers ----

def ramped(y, start, end, dt, lag):
    """y' = (u - y) / lag, u linear: the closed form."""
    slope = (end - start) / dt
    return end - slope * lag + (y - start + slope * lag) * math.exp(-dt / lag)


def test_low_pass_of_any_pieces():
    a, y, lag, draw = c.amplifier(), 0.0, 0.3e-6, random.Random(1)
    c.amplifier_init(a)
    for _ in range(2000):
        start, end, dt = draw.uniform(-20, 20), draw.uniform(-20, 20), draw.uniform(1e-9, 3e-6)
        y = ramped(y, start, end, dt, lag)
        c.amplifier_follow(a, c.leg_view(start, end, draw.randint(-1, 1)), dt, lag, math.exp(-dt / lag))
        assert a.out_a == near(y, 1e-9)


def test_no_time_at_all():
    """Events may come so close to each other that rounding leaves nothing between them, or a denormal number."""
    a, lag = c.amplifier(), 0.3e-6
    c.amplifier_init(a)
    for n, dt in enumerate((1e-3, 0, 1e-320, 1e-18)):
        c.amplifier_follow(a, c.leg_view(3, 3 + 1e-9 * n, 1), dt, lag, math.exp(-dt / lag))
        assert a.out_a == near(3, 1e-9)


LASTING = {"resistance_ohm": 1e-3, "ld_h": 20e-3, "lq_h": 20e-3}


def carrying(into_a=True, **sensors_):
    """A locked rotor that carries a nearly constant current, all legs at half: the low sides turn on at count 3850, the high
    sides off at 3750. Into the motor the current comes through the lower diode from then on, out of the motor only when the
    switch is on."""
    p = Plant((4500, 500, 500) if into_a else (500, 4500, 4500), LASTING, inverter={**STIFF, "diode_v": 0}, sensors=sensors_)
    c.motor_lock(p.motor, True)
    p.run(10e-3)
    p.legs(2500, 2500, 2500)
    p.run(100e-6)
    return p


def converted_at(p, count):
    p.trigger_at(count)
    p.run(150e-6)
    row, codes = p.convert()
    return np.array(row.i_a), np.array(codes)


def test_settling_after_the_edge():
    lsb, hz = 10 / 2048, 300e3
    p = carrying(shunt=1, amp_hz=hz, i_range_a=10)
    for after in range(10, 400, 74):
        i, codes = converted_at(p, 3850 + after)
        settled = 1 - np.exp(-TURN * hz * np.array(((after + 100) * 10e-9, after * 10e-9)))
        assert i[0] > 5 and codes[:2] * lsb == near(i[:2] * settled, 0.6 * lsb), "from the diode on, and from the switch on"
    i, codes = converted_at(p, 1150 + 30)
    assert codes[1] * lsb == near(i[1] * math.exp(-TURN * hz * 0.3e-6), 0.6 * lsb), "off: what is left of the shunt's current"
    i, codes = converted_at(carrying(shunt=1, i_range_a=10), 3860)
    assert codes[1] * lsb == near(i[1], 0.6 * lsb), "ideal: settled at once"


def test_in_line_the_low_pass_follows_the_staircase():
    """A leads B and C by 15 us on either side of the middle of the period, less the dead time, in which the current out of B
    and C takes their terminals up at once."""
    lag, step_a = 1 / (TURN * 20e3), 2 / 3 * 24 / 1e-3 * 14e-6
    p = Plant((4000, 1000, 1000), {"resistance_ohm": 1e-4, "ld_h": 1e-3, "lq_h": 1e-3},
              inverter={**STIFF, "diode_v": 0, "r_on_ohm": 1e-4}, sensors={"amp_hz": 20e3, "i_range_a": 10})
    c.motor_lock(p.motor, True)
    p.run(0.9e-3)
    row, codes = p.convert()
    i = y = 0
    for _ in range(18):
        for rises, dt in ((0, 5e-6), (1, 14e-6), (0, 12e-6), (1, 14e-6), (0, 5e-6)):
            y, i = ramped(y, i, i + rises * step_a, dt, lag), i + rises * step_a
    assert 0.03 < i - y < 0.2 and row.i_a[0] - codes[0] * 10 / 2048 == near(i - y, 0.6 * 10 / 2048)


RING = {"ring_lsb": 200, "ring_hz": 3e6, "ring_tau_s": 0.4e-6}


def follow(s, level_a, level_b, dt):
    c.sensors_follow(s, (c.leg_view * 3)(*(c.leg_view(1, 1, level) for level in (level_a, level_b, -1))), dt or 1e-15)


def off(s, k):
    return c.sensors_current_code(s, k, 0, 1) - 2148


def test_ringing_after_its_own_edges():
    s = sensors(**RING)
    follow(s, 1, 1, 0)
    assert s.follows and off(s, 0) == 0, "the first level is no edge"
    follow(s, 1, 1, 1e-3)
    follow(s, -1, 1, 0)
    assert off(s, 0) == 200
    for t in 23e-9 * np.arange(1, 40):
        follow(s, -1, 1, 23e-9)
        assert off(s, 0) == near(200 * math.exp(-t / 0.4e-6) * math.cos(TURN * 3e6 * t), 0.51) and off(s, 1) == 0
    for level, rings in ((-1, 0), (1, 200)):
        follow(s, 0, 1, 1e-3)
        follow(s, level, 1, 0)
        assert off(s, 0) == rings, "to the other rail alone, with a pause between"


@pytest.mark.parametrize("n", range(4))
def test_noise_after_any_edge(n):
    s, count = sensors(9, edge_noise_lsb=100, edge_noise_tau_s=1e-6), 5000
    follow(s, 1, 1, 1e-3)
    follow(s, 1, -1, 0.7e-6 * n)
    codes = np.array([sampled(s, (1, 1, 1))[0] for _ in range(count)]) - 2148
    expected = math.hypot(100 * math.exp(-0.7 * n), math.sqrt(1 / 12))
    assert s.follows and math.sqrt((codes**2).mean()) == pytest.approx(expected, rel=4 / math.sqrt(2 * count))


def test_sources_of_noise_do_not_shift_each_other():
    noise = {"i_noise_lsb": 10, "v_noise_lsb": 10}
    a, alone = sensors(77, **noise), drawn(4000, seed=77)
    b = sensors(77, **noise, edge_noise_lsb=100, edge_noise_tau_s=1e-6, encoder_lost_per_rev=50, encoder_extra_per_rev=50)
    differ = 0
    for n in range(1000):
        c.disc_miscounts(b.disc, 100)
        codes = sampled(a, (1, 1, 1))
        assert codes == [*np.floor((2148.5, 2148.5, 2148.5, 2400.5) + 10 * alone[4 * n:4 * n + 4])]
        c.sensors_draw_noise(b)
        follow(b, 1 if n % 2 else -1, 1, 1e-3 if n % 3 else 1e-7)
        others = [c.sensors_current_code(b, k, 0, 1) for k in range(3)]
        assert others == codes[:3] or n % 3 == 0, "long after an edge"
        differ += others != codes[:3]
    assert differ > 300


# ---- shunts: what comes through the low side; in line with the phase, all of it ----

@pytest.mark.parametrize("state, i, low_a, level", [
    ("LOW", 3, 3, -1), ("LOW", -3, -3, -1), ("HIGH", 3, 0, 1), ("HIGH", -3, 0, 1), ("DIODE_LO", 3, 3, -1),
    ("DIODE_HI", -3, 0, 1), ("BLOCKED", 0, 0, 0), ("JUST_OFF", 3, 3, 0), ("JUST_OFF", -3, 0, 0), ("SWING", 3, 1.5, 0),
    ("BOTH", 3, 1.5 - 12 / 5e-3, 0)])
def test_the_low_side_s_current(state, i, low_a, level):
    inv = c.inverter()
    c.inverter_init(inv, c.inverter_params(**INVERTER))
    inv.leg[1] = getattr(c, f"LEG_{state}")
    assert c.bench_low_side_a(inv, 1, i) == near(low_a, 1e-9) and c.bench_level(inv, 1) == level


@pytest.mark.parametrize("shunt", [0, 1])
@pytest.mark.parametrize("what, into_a, seen", [
    ("low sides on", True, (1, 1, 1)), ("A at 100 %", True, (0, 1, 1)), ("dead time after", True, (1, 0, 0)),
    ("dead time after", False, (0, 1, 1)), ("dead time before", True, (1, 0, 0)), ("dead time before", False, (0, 1, 1)),
    ("gates off", True, (1, 0, 0))])
def test_what_a_sensor_sees(what, into_a, seen, shunt):
    p = carrying(into_a, shunt=shunt)
    if what == "A at 100 %":
        p.legs(2500, 4700, 4700)
        p.compares(2500, p.read(PWM.COMPARE_B), p.read(PWM.COMPARE_C))
    elif what == "gates off":
        p.write(GATE.CONTROL, 0)
    elif what != "low sides on":
        p.trigger_at(1200 if "after" in what else 3800)
    p.run(200e-6)
    row, codes = p.convert()
    assert abs(row.i_a[1]) > 2
    assert np.array(codes) * LSB_A == near(np.array(row.i_a) * (seen if shunt else 1), 0.6 * LSB_A)


# ---- a row of the trace: values of a period ----

class Ripple:
    """Legs that switch without dead time on a stiff bus: A on from count 0, B and C low. The locked rotor's current along A
    goes up and down between two voltages, exponentially. Left-aligned, so that the trigger finds the valley and no mean."""
    def __init__(self, on_counts, electrical_rad=0.0):
        r, l, end, on_s = 0.3 + 5e-3, 60e-6, 2 / 3 * 24 / (0.3 + 5e-3), on_counts * 10e-9
        up, down = math.exp(-on_s * r / l), math.exp(-(50e-6 - on_s) * r / l)
        self.crest = end * (1 - up) / (1 - up * down)
        self.valley = self.crest * down
        t = 50e-6 * (np.arange(200_000) + 0.5) / 200_000
        self.i = np.where(t < on_s, end + (self.valley - end) * np.exp(-t * r / l), self.crest * np.exp(-(t - on_s) * r / l))
        compare = (on_counts + 1) // 2
        self.p = p = Plant(motor={"ld_h": l, "lq_h": l, "initial_angle_rad": electrical_rad / 4},
                           inverter={**STIFF, "diode_v": 0})
        c.motor_lock(p.motor, True)
        p.write(PWM.CONTROL, 0)
        p.run(1e-6)
        p.write(PWM.DEAD, 1)
        p.compares(compare, 0, 0)
        p.write(PWM.TRIGGER_1, compare - 1 | 1 << 16)
        p.write(PWM.CONTROL, 1)
        p.run(6e-3)


@pytest.mark.parametrize("on_counts", [1001, 2701])
def test_currents_with_their_ripple(on_counts):
    r = Ripple(on_counts)
    row, rms, scale = r.p.row, math.sqrt((r.i**2).mean()), 1e-3 * r.crest
    assert row.i_a[0] == near(r.valley, scale) and row.i_rms_a[:] == near(rms * np.array((1, 0.5, 0.5)), scale)
    assert row.i_mean_a[:] == near(r.i.mean() * np.array((1, -0.5, -0.5)), scale)
    assert row.i_peak_a[:] == near(r.crest * np.array((1, 0.5, 0.5)), scale) and 1.05 * r.valley < rms < 0.98 * r.crest
    r.p.write(GATE.CONTROL, 0)
    r.p.run(1e-3)
    assert r.p.row.i_rms_a[0] + r.p.row.i_peak_a[0] == near(0, 1e-9), "nothing of the periods before"


def test_mean_torque():
    """T = 3/2 p psi i_q, i_q = -i sin(angle): linear in the current, so its mean is that of the mean current."""
    r = Ripple(1001, -1.1)
    nm_per_a, row = 6 * 7.5e-3 * math.sin(1.1), r.p.row
    assert row.torque_nm == pytest.approx(nm_per_a * r.valley, rel=2e-3)
    assert row.torque_mean_nm == pytest.approx(nm_per_a * r.i.mean(), rel=1e-3) and row.torque_mean_nm > 1.05 * row.torque_nm


def test_a_row():
    p = Plant((3000, 2400, 1800))
    c.motor_lock(p.motor, True)
    p.motor.load_nm = 0.25
    p.run(5e-3 + 2e-6)
    row = p.row
    assert row.duty[:] == near(np.array((0.6, 0.48, 0.36)), 1e-9) and sum(row.v_mean_v) == near(0, 1e-9)
    assert row.bus_v == near(p.inverter.bus_v, 0.01) and row.bus_v < 23.99, "which the supply's resistance lowers"
    assert row.torque_nm == near(c.motor_torque_nm(p.motor), 0.01) and row.load_nm == 0.25
    assert row.gates == 0x2A and row.live and row.winding_c == near(25, 0.1) and row.magnet_c == near(25, 1e-3)
    c.motor_spin(p.motor, 33)
    p.run(100e-6)
    assert p.row.load_speed_rad_s == p.row.speed_rad_s == near(33, 1e-9), "the load turns with the motor"


def test_currents_are_those_of_the_legs():
    """Two joined terminals draw a current that never reaches the motor."""
    p = Plant((4000, 1000, 1000), inverter=STIFF)
    c.motor_lock(p.motor, True)
    c.inverter_short(p.inverter, 0, 1, 10)
    p.run(110e-6)
    assert p.row.i_peak_a[0] == near(abs(currents(p.motor)[0]) + 24 / 10, 0.5) and p.row.i_peak_a[0] > abs(p.row.i_a[0]) + 1


def test_the_meter_alone():
    """Pieces of which the integral is known, and the moment when no time has passed."""
    m, r, three = c.meter(), c.meter_reading(), ctypes.c_double * 3
    c.meter_add(m, 2, three(0, 1, -3), three(6, 1, 3), 4)
    c.meter_read(m, r)
    assert r.i_rms_a[:] == near(np.array((6 / math.sqrt(3), 1, 3 / math.sqrt(3))), 1e-12) and r.i_peak_a[:] == [6, 1, 3]
    assert r.i_mean_a[:] == near(np.array((3, 1, 0)), 1e-12) and r.torque_mean_nm == near(2, 1e-12)
    c.meter_read(m, r)
    assert (r.i_rms_a[:], r.i_mean_a[:], r.torque_mean_nm) == ([6, 1, 3], [6, 1, 3], 4), "without time: the last ones"
    c.meter_add(m, 1, three(1, -2, 0), three(1, 0, 0), 4)
    c.meter_read(m, r)
    assert r.i_peak_a[0] + r.i_rms_a[0] == near(2, 1e-12) and r.i_peak_a[1] == 2, "each reading starts anew"


# ---- modulators ----

SCALE = 4096  # inputs are whole numbers of it, so that a double holds everything exactly


def test_every_bit_is_that_of_exact_arithmetic():
    draw = random.Random(1)
    for run in range(100):
        m, level, first, second, bit, ones = c.modulator(), draw.randint(-3200, 3200) if run else 0, 0, 0, 0, 0
        count = draw.randint(1, 1500)
        for _ in range(count):
            back = SCALE if bit else -SCALE
            first += level - back
            second += first - back
            bit = second >= 0
            ones += bit
            assert c.modulator_clock(m, level / SCALE) == bit
        assert abs((2 * ones - count) - count * level / SCALE) <= 6, "the mean of n bits is the input within 6 / n"


@pytest.mark.parametrize("millivolts, density, within", [
    (0, 0.5, 1e-3), (250, 0.8906, 1e-3), (-250, 0.1094, 1e-3), (320, 127 / 128, 1e-9), (-400, 1 / 128, 1e-9)])
def test_density_of_ones_by_the_data_sheet(millivolts, density, within):
    """SBAS734"""
    m = c.modulator()
    assert np.mean([c.modulator_clock(m, millivolts / 320) for _ in range(12_800)]) == near(density, within)


def test_after_full_scale_it_works_as_before():
    m = c.modulator()
    bits = [c.modulator_clock(m, 2 if n < 1000 else 0.25) for n in range(3000)]
    assert np.mean(bits[1100:]) == near(0.625, 5e-3)


def bits_of(streams, count, from_ps=0.0):
    bits = (ctypes.c_uint8 * count)()
    c.bench_bits(streams, from_ps, count, bits)
    return np.frombuffer(bits, np.uint8)


def streams(noise, seed, level=None):
    s = c.bit_streams()
    c.bit_streams_init(s, noise, seed)
    if level is not None:
        c.bit_streams_follow(s, c.stretch(0, 1e12, (level,) * 3, (level,) * 3))
    return s


@pytest.mark.parametrize("osr", [16, 32, 64, 128, 256])
def test_noise_behind_a_sinc3_filter(osr):
    """Quantisation noise of 1/3, white, leaves the loop by (1 - 1/z)^2, which takes two of the filter's three sums away: taps
    of 1, -2, 1 over OSR bits each, by OSR cubed, 6 / OSR^5 in squares. One bit is overloaded now and then, which a constant
    gain knows nothing of: by half as much again is usual. Of white noise at the input, the squares of the taps."""
    one, white, draw = np.ones(osr) / osr, 3e-3, np.random.default_rng(osr)
    taps = np.convolve(np.convolve(one, one), one)

    def rms(noise):
        errors = []
        for seed, level in enumerate(draw.uniform(-0.7, 0.7, 40)):
            bits = bits_of(streams(noise, seed, level), int(draw.integers(50, 150)) + 30 * len(taps))
            values = np.where(bits[-30 * len(taps):] & 1, 1, -1).reshape(30, -1) @ taps
            errors.extend(values - level)
        return math.sqrt(np.mean(np.square(errors)))
    of_bits = rms(0)
    assert 0.7 < of_bits / math.sqrt(2 / osr**5) < 2
    assert rms(white) == pytest.approx(math.hypot(white * math.sqrt((taps**2).sum()), of_bits), rel=0.1)


def test_streams_of_a_ramp():
    """Up over 100 us in unequal steps: what is listed is a straight line. Too much of it is told."""
    s, at = streams(0, 1), 0.0
    for n in range(40):
        length = 4e6 if n % 2 else 1e6
        start, end = at / 100e6 - 0.5, (at + length) / 100e6 - 0.5
        c.bit_streams_follow(s, c.stretch(at, at + length, (start, -start, 0.25), (end, -end, 0.25)))
        at += length
    bits, ramp = bits_of(s, 2000), (np.arange(2000) * 50e3 / 100e6 - 0.5).sum()
    assert [np.where(bits >> k & 1, 1, -1).sum() for k in range(3)] == near(np.array((ramp, -ramp, 500)), 6)
    assert not c.bit_streams_forgot(s, 0)
    for _ in range(4096 + 5):
        c.bit_streams_follow(s, c.stretch(at, at + 1e3, (0,) * 3, (0,) * 3))
        at += 1e3
    assert c.bit_streams_forgot(s, 100e6) and not c.bit_streams_forgot(s, at)


@pytest.mark.parametrize("other, differ", [(7, False), (8, True)])
def test_streams_by_seed(other, differ):
    different = (bits_of(streams(1e-3, 7, 0.1), 5000) != bits_of(streams(1e-3, other, 0.1), 5000)).sum()
    assert different > 500 if differ else different == 0
