# SPDX-License-Identifier: MIT
"""The sweep finds a loop that is known: an integrator with a gain, whose closed loop is g / (z - 1 + g)."""
import cmath
import ctypes
import math

import pytest

GAIN, RATE_HZ, SLOW_HZ = 0.3, 20000, 1000
AMPLITUDE_MA = 1000


@pytest.fixture
def bench(c):
    axis, sweep = c.axis(), c.sweep()
    c.params_init(axis.params)
    axis.state, axis.mode = c.AXIS_OPERATION_ENABLED, c.AXIS_MODE_SPEED
    axis.loop.loops_per_slow, axis.loop.status_max = RATE_HZ // SLOW_HZ, 0
    sweep.axis = ctypes.pointer(axis)
    return axis, sweep


def closed(hz, rate_hz, gain=GAIN):
    return gain / (cmath.exp(2j * math.pi * hz / rate_hz) - 1 + gain)


def swept(c, sweep):
    return [(p.millihertz / 1000, complex(p.re_q14, p.im_q14) / 16384) for p in sweep.points[:sweep.count]]


def begin(c, sweep, loop, milliamp=AMPLITUDE_MA):
    return c.sweep_begin(sweep, getattr(c, f"SWEEP_{loop}"), milliamp)


def run_current(c, axis, sweep, axes="q", base=0, overwritten=0, missed=()):
    """The current follows its reference; now and then the slow loop sets that anew."""
    assert begin(c, sweep, axes.upper()).error == c.ERROR_NONE
    ref, current = f"i_{axes}_ref_q15", f"i_{axes}_q15"
    setattr(axis.loop, ref, base)
    exact, k, since = float(base), 0, 1
    while sweep.state == c.SWEEP_RUNS:
        setattr(axis.loop, current, round(exact))
        served = getattr(axis.loop, ref)
        if k in missed:
            since += 1
        else:
            c.sweep_sample(sweep, since)
            since = 1
        exact += GAIN * (served - exact)
        k += 1
        if overwritten and k % overwritten == 0:
            setattr(axis.loop, ref, base)
        c.sweep_poll(sweep)
    return swept(c, sweep)


def test_a_sweep_begins_at_the_crest(c, bench):
    _, sweep = bench
    begin(c, sweep, "Q")
    assert sweep.cos_q15 == 32768


@pytest.mark.parametrize("axes, base, overwritten", (("q", 0, 0), ("d", 0, 0), ("q", 5000, 20), ("d", -3000, 20)))
def test_the_closed_loop_of_a_current(c, bench, axes, base, overwritten):
    axis, sweep = bench
    points = run_current(c, axis, sweep, axes, base, overwritten)
    assert len(points) == len(sweep.points) and sweep.state == c.SWEEP_DONE
    for hz, found in points:
        assert abs(found - closed(hz, RATE_HZ)) < 0.01, hz
    assert points[0][0] == pytest.approx(125, abs=10) and points[-1][0] == pytest.approx(8000, rel=0.02)
    assert getattr(axis.loop, f"i_{axes}_ref_q15") == base, "as if nothing had been"


def analytic(rate_hz):
    hz = [n / 100 for n in range(100, 50 * rate_hz)]
    def first(holds):
        return next((f for f in hz if holds(closed(f, rate_hz))), 0)
    crossover = first(lambda t: t.real <= 0.5)
    open_loop = closed(crossover, rate_hz) / (1 - closed(crossover, rate_hz))
    return (first(lambda t: abs(t) ** 2 <= 0.5), first(lambda t: t.real <= 0), crossover,
            180 + math.degrees(cmath.phase(open_loop)))


@pytest.mark.parametrize("loop, rate_hz", (("q", RATE_HZ), ("speed", SLOW_HZ)))
def test_what_a_bode_plot_is_read_for(c, bench, loop, rate_hz):
    axis, sweep = bench
    run_current(c, axis, sweep) if loop == "q" else run_speed(c, axis, sweep)
    found = c.sweep_summary(sweep)
    bandwidth, lag, crossover, margin = analytic(rate_hz)
    assert found.bandwidth_mhz / 1000 == pytest.approx(bandwidth, rel=0.01)
    assert found.lag_mhz / 1000 == pytest.approx(lag, rel=0.01)
    assert found.crossover_mhz / 1000 == pytest.approx(crossover, rel=0.01)
    assert found.margin_ddeg / 10 == pytest.approx(margin, abs=0.5)


def run_speed(c, axis, sweep):
    """A torque moves the shaft, whose speed the controller answers."""
    assert begin(c, sweep, "SPEED").error == c.ERROR_NONE
    speed = 0.0
    while sweep.state == c.SWEEP_RUNS:
        axis.torque.torque_q15 = axis.torque.probe_q15 - round(speed)  # the controller's gain is 1
        c.sweep_step(sweep)
        speed += GAIN * axis.torque.torque_q15
        c.sweep_poll(sweep)
    return swept(c, sweep)


def test_the_closed_loop_of_the_speed(c, bench):
    axis, sweep = bench
    for hz, found in run_speed(c, axis, sweep):
        assert abs(found - closed(hz, SLOW_HZ)) < 0.015, hz
    assert axis.torque.probe_q15 == 0, "as if nothing had been"


def test_a_sample_that_was_missed_does_not_shift_the_rest(c, bench):
    axis, sweep = bench
    for hz, found in run_current(c, axis, sweep, missed=range(7, 60000, 997)):
        assert abs(found - closed(hz, RATE_HZ)) < 0.03, hz


@pytest.mark.parametrize("loop, milliamp, error, value", [
    ("Q", 0, "SWEEP_AMPLITUDE", 1331), ("D", 1332, "SWEEP_AMPLITUDE", 1331), ("Q", 1331, "NONE", 0),
    ("SPEED", -1, "SWEEP_AMPLITUDE", 1331)])
def test_an_amplitude_that_limits_would_answer_is_refused(c, bench, loop, milliamp, error, value):
    outcome = begin(c, bench[1], loop, milliamp)
    assert (outcome.error, outcome.value) == (getattr(c, f"ERROR_{error}"), value)


def test_only_what_controls_is_swept(c, bench):
    axis, sweep = bench
    axis.mode = c.AXIS_MODE_TORQUE
    assert begin(c, sweep, "SPEED").error == c.ERROR_SWEEP_MODE and begin(c, sweep, "Q").error == c.ERROR_NONE
    c.sweep_end(sweep)
    axis.state = c.AXIS_SWITCH_ON_DISABLED
    assert begin(c, sweep, "Q").error == c.ERROR_NOT_OPERATING


@pytest.mark.parametrize("loop", ("Q", "SPEED"))
def test_it_ends_when_the_drive_does(c, bench, loop):
    axis, sweep = bench
    begin(c, sweep, loop)
    axis.torque.probe_q15 = 5
    axis.state = c.AXIS_FAULT
    assert c.sweep_poll(sweep) and sweep.state == c.SWEEP_ENDED and not c.sweep_poll(sweep)
    assert axis.torque.probe_q15 == (0 if loop == "SPEED" else 5)


def test_it_leaves_a_loop_alone_that_is_off(c, bench):
    axis, sweep = bench
    begin(c, sweep, "Q")
    axis.loop.status_max = 2**32 - 1
    for _ in range(100):
        c.sweep_sample(sweep, 1)
    assert axis.loop.i_q_ref_q15 == 0


def test_the_console_says_what_was_found_and_what_was_not(c, scoped):
    sweep, names = scoped.scope.sweep, ("closed loop, -3 dB", "closed loop, -90 degrees", "open loop, crossover")
    assert scoped("sweep read")[1:] == [f"{name}: not among these frequencies" for name in names]
    for n, (hz, answer) in enumerate(((100, 1), (200, 0.5 - 0.5j), (400, -0.1 - 0.2j))):
        point, sweep.count = sweep.points[n], n + 1
        point.millihertz, point.re_q14, point.im_q14 = hz * 1000, round(answer.real * 16384), round(answer.imag * 16384)
    found, said = c.sweep_summary(sweep), scoped("sweep read")
    assert said[2] == "200.000 Hz: 0.707, -45.000 deg" and found.crossover_mhz > 0
    assert said[4:] == [f"{name}: {mhz / 1000:.3f} Hz" for name, mhz in zip(
        names, (found.bandwidth_mhz, found.lag_mhz, found.crossover_mhz))] + [
            f"phase margin: {found.margin_ddeg / 10:.3f} degrees"]
