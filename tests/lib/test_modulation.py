# SPDX-License-Identifier: MIT
"""Space-vector modulation by min-max injection, and the reciprocal of the bus voltage."""
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

BUSES = (4096, 8192, 13107, 24000, 32767)
ANGLE = np.arange(0, 65536, 7) * (2 * np.pi / 65536)


def three_phases(amplitude):
    """Sampled balanced voltages; they sum to 0 within a rounding, as invclarke_q15() makes them."""
    a, b = (np.rint(amplitude * np.cos(ANGLE - shift)).astype(int) for shift in (0, 2 * np.pi / 3))
    return a, b, -a - b


def recip(vbus):
    return round(2**29 / vbus)


def duties(lib, phases, vbus):
    return np.array(lib.svm(*phases, recip(vbus)))


def test_line_to_line_is_preserved(lib):
    """The zero sequence cancels: differences of duty are differences of voltage, two roundings and the reciprocal's."""
    for vbus in BUSES:
        phases = three_phases(0.99 * vbus / np.sqrt(3))
        duty = duties(lib, phases, vbus)
        for x, y in ((0, 1), (1, 2), (2, 0)):
            ideal = (phases[x] - phases[y]) / vbus * 32768
            assert np.abs(duty[x] - duty[y] - ideal).max() <= 1 + 32768 * 0.5 / recip(vbus)


def test_linear_up_to_the_whole_hexagon(lib):
    """An amplitude of vbus/sqrt(3) = 2/sqrt(3) * vbus/2 just fits; plain sine would end at vbus/2."""
    for vbus in BUSES:
        duty = duties(lib, three_phases(vbus / np.sqrt(3)), vbus)
        assert duty.min() >= 0 and duty.min() <= 4 + 2 * 32768 // vbus
        assert duty.max() <= 32767 and duty.max() >= 32767 - 4 - 2 * 32768 // vbus
    beyond = duties(lib, three_phases(1.02 * 24000 / np.sqrt(3)), 24000)
    assert beyond.min() == 0 and beyond.max() == 32767


def test_centred(lib):
    """Largest and smallest duty lie symmetrically about one half: the zero time is shared equally."""
    for vbus in BUSES:
        duty = duties(lib, three_phases(0.5 * vbus), vbus)
        assert np.abs(duty.max(axis=0) + duty.min(axis=0) - 32768).max() <= 1


def test_zero_gives_one_half_exactly(lib):
    for vbus in BUSES:
        assert np.all(duties(lib, (np.zeros(1, int),) * 3, vbus) == 16384)


@given(v=st.tuples(*[st.integers(-37000, 37000)] * 3), vbus=st.integers(4096, 32767), common=st.integers(-20000, 20000))
def test_exact_saturated_and_blind_to_the_common_mode(lib, v, vbus, common):
    scale = recip(vbus)
    if (max(v) - min(v)) * scale > 2.99 * 2**29:
        return
    duty = [int(x[0]) for x in lib.svm(*v, scale)]
    for got, x in zip(duty, v):
        exact_q30 = 2**29 + (2 * x - max(v) - min(v)) * scale
        assert got == max(0, min(32767, (exact_q30 + 2**14) >> 15))
    assert [int(x[0]) for x in lib.svm(*(x + common for x in v), scale)] == duty


def settle(lib, start, vbus, steps):
    value = np.broadcast_to(start, np.shape(vbus)).astype(np.int64)
    for _ in range(steps):
        value = lib.recip(value, vbus)
    return value


def test_reciprocal_settles_on_every_bus_from_anywhere(lib):
    vbus = np.arange(4096, 32768)
    exact = 2**29 / vbus
    tolerance = np.maximum(1, exact * 2.0**-16) + 0.5
    for start in (4, 1000, 16384, 40000, 131072):
        value = settle(lib, start, vbus, 120)
        assert np.all(np.abs(value - exact) <= tolerance)
        for _ in range(4):  # and stays there
            value = lib.recip(value, vbus)
            assert np.all(np.abs(value - exact) <= tolerance)


def test_reciprocal_squares_the_error(lib):
    vbus = np.arange(5000, 32768, 11)
    exact = 2**29 / vbus
    start = np.rint(exact * 1.02).astype(int)
    assert np.all(np.abs(lib.recip(start, vbus) / exact - 1) <= 0.02**2 + 2**-14)


def test_reciprocal_of_a_dead_bus_stays_bounded(lib):
    assert np.all(settle(lib, np.array([4, 16384, 131072]), np.zeros(3, int), 200) == 131072)
    assert np.all(lib.recip([4, 16384, 131072, 131072], [32767, 32767, 32767, 4096]) >= 4)


def test_reciprocal_follows_a_falling_bus(lib):
    """Half the bus gone in 5 ms at 20 kHz: never more than 1 % behind."""
    value = recip(30000)
    for vbus in np.linspace(30000, 15000, 100).astype(int):
        value = int(lib.recip(value, vbus)[0])
        assert abs(value * vbus / 2**29 - 1) < 0.01
