# SPDX-License-Identifier: MIT
"""The reference for speed loops, against closed forms."""
import math

import best_loop
import best_loop_twin
import numpy as np
import present_loop
import pytest
from best_loop import Gains, Sampled, Shaft

from launcher.drive import load_drive

RIGID = Shaft(2e-3)
SPRUNG = Shaft(1e-3, 3e-3, 400.0, 0.02)  # 116 Hz
W = 2 * math.pi * 60


# ---- margin ----------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("late_periods", (0, 1, 3))
@pytest.mark.parametrize("rate_hz", (1000, 4000))
def test_the_margin_of_a_rigid_mass_and_a_delay(rate_hz, late_periods):
    """A proportional gain on a speed that is the way of a period: |L| = w T / 2 cot(x / 2) and 90 degrees less x and the delay,
    with x the angle of a period."""
    found = best_loop.figures(RIGID, rate_hz, late_periods / rate_hz, Gains(RIGID.rotor_kgm2 * W / 2, 0.0))
    x = 2 * math.atan(W / 2 / rate_hz / 2)
    assert found.crossover_hz == pytest.approx(x * rate_hz / (2 * math.pi), rel=2e-3)
    assert found.phase_margin_deg == pytest.approx(90 - math.degrees(x * (1 + late_periods)), abs=0.2)


def test_the_margin_of_a_pi_is_the_firmwares_rule():
    """margins.h: a memory of a quarter crosses over at 1.0291 w and takes 13.65 degrees; the rest is delay."""
    late_s = 1.175e-3
    found = best_loop.figures(RIGID, 100e3, late_s, Gains(RIGID.rotor_kgm2 * W, RIGID.rotor_kgm2 * W * W / 4))
    assert found.crossover_hz == pytest.approx(1.0291 * 60, rel=2e-3)
    assert found.phase_margin_deg == pytest.approx(90 - 13.65 - 360 * 1.0291 * 60 * (late_s + 1e-5), abs=0.2)


@pytest.mark.parametrize("beyond, stable", ((0.98, True), (1.02, False)))
def test_it_swings_where_the_delay_takes_all_the_margin(beyond, stable):
    """Three periods of delay and the angle of one: 180 degrees where that angle is 22.5."""
    gain = 2 * math.tan(math.radians(22.5 / 2)) * 1000 * RIGID.rotor_kgm2
    sampled = Sampled(RIGID, 1000, 3e-3)
    assert sampled.is_stable(Gains(beyond * gain, 0.01 * gain)) is stable
    assert sampled.ring_hz(Gains(1.02 * gain, 0.01 * gain)) == pytest.approx(1000 * 22.5 / 360, rel=0.02)


def test_a_disk_margin_of_a_half_is_a_gain_of_five_thirds_and_28_degrees():
    for gain in (5 / 3, np.exp(1j * 2 * math.atan(0.25))):
        assert best_loop.disk_margin(np.array([-1 / gain])) == pytest.approx(0.5)


def test_a_mean_of_periods_hears_nothing_of_what_comes_once_in_it():
    for mean in ((4, 1), (4, 2), (4, 4)):
        sampled = Sampled(RIGID, 4000, 0.2e-3, mean)
        loop = sampled.loop(np.array([100.0, 1000.0]), np.ones(2), Gains(1.0, 0.0))
        assert abs(loop[1]) < 1e-9 < abs(loop[0])


# ---- dip -------------------------------------------------------------------------------------------------------------

def test_the_dip_of_a_rigid_mass():
    """T / J t e^(-w t / 2) with a memory of a quarter: the most is 2 / (e w)."""
    found = best_loop.figures(RIGID, 50e3, 0.0, Gains(RIGID.rotor_kgm2 * W, RIGID.rotor_kgm2 * W * W / 4))
    assert found.dip_s == pytest.approx(2 / math.e / W, rel=0.01)


@pytest.mark.parametrize("shaft", (RIGID, SPRUNG))
def test_a_dip_is_that_of_a_fine_integration(shaft):
    """Euler's steps of a 500th of a period, speed and torque by hand."""
    gains, late_s, steps = Gains(0.3, 20.0), 0.3e-3, 500
    dt, largest, torque, asked = 1e-3 / steps, 0.0, 0.0, 0.0
    rotor, load = shaft.rotor_kgm2, shaft.load_kgm2
    angle = before = speed = load_speed = twist = 0.0
    for n in range(400 * steps):
        if n % steps == 0:
            asked, before = -gains.kp_nms * (angle - before) / 1e-3 - gains.ki_nm * angle, angle
        if n % steps == round(late_s / dt):
            torque = asked
        spring = shaft.stiffness_nm_rad * twist + shaft.damping_nms * (speed - load_speed)
        if shaft.is_rigid:
            speed += dt * (torque - 1) / rotor
        else:
            speed += dt * (torque - spring) / rotor
            load_speed += dt * (spring - 1) / load
            twist += dt * (speed - load_speed)
        angle += dt * speed
        largest = max(largest, abs(speed))
    assert Sampled(shaft, 1000, late_s).dip_s(gains) == pytest.approx(largest * shaft.total_kgm2, rel=0.01)


def test_a_step_at_the_end_of_a_period_is_one_at_the_beginning():
    sampled, gains = Sampled(SPRUNG, 1000, 0.3e-3), Gains(0.3, 20.0)
    assert sampled.dip_s(gains, 1.0 - 1e-9) == pytest.approx(sampled.dip_s(gains, 0.0), rel=1e-6)
    assert sampled.dip_s(gains, 0.5) != pytest.approx(sampled.dip_s(gains, 0.0), rel=1e-3)


# ---- shaft and sensor ------------------------------------------------------------------------------------------------

def test_two_masses_ring_where_they_should():
    poles = np.linalg.eigvals(SPRUNG.rates()[:4, :4])
    assert abs(poles.imag).max() / (2 * math.pi) == pytest.approx(SPRUNG.resonance_hz, rel=0.01)
    stiff = Shaft(1e-3, 1e-3, 1e9, 10.0)
    assert best_loop.figures(stiff, 1000, 0.2e-3, Gains(0.5, 40.0)).dip_s == pytest.approx(
        best_loop.figures(RIGID, 1000, 0.2e-3, Gains(0.5, 40.0)).dip_s, rel=1e-3)


@pytest.mark.parametrize("counts", (200, 400, 1600))
def test_the_lag_of_edges(counts):
    """A shaft that speeds up: the way between the last edges, by their time, lags by this much, whenever it is read."""
    drive = load_drive("teknic_m2310p", {"motor": {"encoder": {"counts_per_rev": counts}}})
    turn_s = present_loop.turn_s(drive)
    w, gains = 2 * math.pi / turn_s, 4.0  # rad/s^2: little in the time that is looked at
    edge_rad, lags, period_s = 2 * math.pi / counts, [], 1e-3
    when = [(-w + math.sqrt(w * w + 2 * gains * k * edge_rad)) / gains for k in range(20000)]
    at = np.arange(0.1, 0.3, 0.37e-3 * math.sqrt(2) / 3)
    for now in at:
        last = np.searchsorted(when, now) - 1
        first = min(last - 1, np.searchsorted(when, now - period_s) - 1)
        speed = (last - first) * edge_rad / (when[last] - when[first])
        lags.append((w + gains * now - speed) / gains)
    told = present_loop.sensor_lag_s(drive, present_loop.ENCODER, 1 / period_s)
    assert np.mean(lags) == pytest.approx(period_s / 2 + told, rel=0.05)


def test_the_loop_is_read_back_from_a_step():
    """The twin's trace is read so: here the model's own answer."""
    sampled, gains, parts = Sampled(RIGID, 1000, 0.21e-3), Gains(RIGID.rotor_kgm2 * W, RIGID.rotor_kgm2 * W * W / 4), 20
    row, closed = sampled.answer(gains), sampled.closed(gains)
    rows = np.array([(matrix + np.outer(now, row))[1] for matrix, now in
                     (sampled.within(1e-3 * k / parts) for k in range(parts))])
    state, speeds = np.eye(sampled.size)[sampled.load], []
    for _ in range(250):
        speeds, state = speeds + list(rows @ state), closed @ state
    t_s = np.arange(len(speeds)) * 1e-3 / parts
    found = best_loop.crossovers(best_loop_twin.HZ, best_loop_twin.loop_of(t_s, np.array(speeds), RIGID))[0]
    hz = sampled.frequencies()
    assert found == pytest.approx(best_loop.crossovers(hz, sampled.loop(hz, sampled.response(hz), gains))[0], rel=0.02)


# ---- the best --------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("shaft", (RIGID, SPRUNG))
def test_the_best_keeps_its_margins_and_more_gain_does_not(shaft):
    for rate_hz in (1000, 4000):
        best = best_loop.best(shaft, rate_hz, 0.2e-3)
        others = [Sampled(shaft.stiffened(by), rate_hz, 0.2e-3, best.mean) for by in (0.8, 1.25)]
        assert best.disk_margin >= best_loop.MARGIN and all(other.is_stable(best.gains) for other in others)
        less = Gains(best.gains.kp_nms / 1.5, best.gains.ki_nm / 1.5)
        assert best_loop.figures(shaft, rate_hz, 0.2e-3, less, best.mean).dip_s > best.dip_s
        more = Gains(1.5 * best.gains.kp_nms, 1.5 * best.gains.ki_nm)
        assert best_loop.figures(shaft, rate_hz, 0.2e-3, more, best.mean).disk_margin < best_loop.MARGIN


def test_without_a_mean_a_quicker_loop_is_worse_on_a_stiff_coupling(monkeypatch):
    """A period of 1 ms averages out what a period of 0.25 ms hears."""
    stiff = present_loop.shaft_of(load_drive("maxon_ec45flat").motor)
    assert best_loop.best(stiff, 4000, 0.2e-3).dip_s < 1.05 * best_loop.best(stiff, 1000, 0.2e-3).dip_s
    monkeypatch.setattr(best_loop, "MEANS", [(1, 1)])
    assert best_loop.best(stiff, 4000, 0.2e-3).dip_s > 2 * best_loop.best(stiff, 1000, 0.2e-3).dip_s


def test_no_gain_is_said():
    with pytest.raises(best_loop.NoGain):
        best_loop.best(Shaft(1e-6, 1.0, 1.0, 0.0), 1000, 20e-3)
