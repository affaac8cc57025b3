# SPDX-License-Identifier: MIT
"""Identify's arithmetic against exact and simulated windings; where it may run, what ends it, what becomes a parameter."""
import cmath
import math

import pytest

from rigs.drive import STATES, World
from rigs.identify_alone import I_RANGE_MA, ONE, RATED_MA, V_RANGE_MV, known, measuring, thought
from rigs.winding import BUS_STEPS, RATE_HZ, VBUS_Q15, inductances

LEVELS, ANGLES, MEAN_MS = 10, 6, 10
IDENTIFYING = 5  # START_IDENTIFY


# ---- numbers ----

@pytest.mark.parametrize("x", [0, 1e-6, 0.001, 0.1, 0.5, 1.0, 2.0, 4.0])
def test_logarithm(c, x):
    y = round((1 - math.exp(-x)) * 2**30)
    assert c.identify_log_q30(y) / 2**30 == pytest.approx(-math.log1p(-y / 2**30), rel=1e-7, abs=1e-8)


def test_root_and_interval(c):
    for n in [0, 1, 2, 3, 4, 10**6, 10**12 - 1, 10**12, 2**62]:
        assert c.identify_root(n) == math.isqrt(n)
    assert c.identify_interval(300, 0, 0) == 600 and c.identify_interval(-300, 0, 0) == 600
    assert c.identify_interval(0, 3000, 0) == 2 * math.isqrt(3000**2 // 3)
    assert c.identify_interval(30, 40, 50) == 2 * math.isqrt(900 + round((40**2) / 3) + round(50**2 / 3))


# ---- resistance and dead time ----

def held(d, r_ohm, dead_s, c_va, turn=lambda angle: 1.0, up=1.0):
    """The sums of legs that lose V0 - c / |i|, as identify_resistance.c states it."""
    vbus = VBUS_Q15 / ONE * V_RANGE_MV / 1000
    v0 = vbus * dead_s * RATE_HZ
    for angle in range(ANGLES):
        for n in range(1, LEVELS + 1):
            amps = RATED_MA / 1000 * n / LEVELS
            volts = turn(angle) * r_ohm * amps + 4 / 3 * v0 - 2 * c_va / amps
            steps = volts / vbus * BUS_STEPS
            for way, share in ((0, 1.0), (1, up)):
                d.work.resistance.v_sum[way][angle][n - 1] = round(share * steps * VBUS_Q15 * MEAN_MS)
    d.work.resistance.vbus_sum_q15 = ANGLES * 2 * LEVELS * MEAN_MS * VBUS_Q15


@pytest.mark.parametrize("r_ohm", [0.004, 0.3, 2.0])
@pytest.mark.parametrize("dead_s, c_va", [(1e-6, 0.0), (0.9e-6, 0.036), (1.1e-6, 0.1)])
def test_resistance_is_told_from_dead_time(c, begun, r_ohm, dead_s, c_va):
    held(begun, r_ohm, dead_s, c_va)
    thought(c, begun, "RESISTANCE")
    uohm, interval = known(c, begun, "RESISTANCE")
    assert uohm == pytest.approx(r_ohm * 1e6, rel=2e-4, abs=3)
    assert interval == pytest.approx(2 * uohm * math.hypot(0.015, 0.007) / math.sqrt(3), rel=0.05, abs=30)
    assert known(c, begun, "DEAD_TIME")[0] / 10 == pytest.approx(dead_s * 1e9, abs=0.3)


def test_what_the_slow_loop_sums_up_is_that_winding(c, begun):
    """Millisecond by millisecond, the current controller's integral as that winding behind those legs needs it."""
    r_ohm, dead_s = 0.3, 1e-6
    io, vbus = measuring(c, begun, "RESISTANCE"), VBUS_Q15 / ONE * V_RANGE_MV / 1000
    loop = io.loop.contents
    loop.vbus_q15, begun.settle_ms = VBUS_Q15, 20
    for n in range(20000):
        if c.identify_measure(begun, io):
            break
        volts = r_ohm * loop.i_d_ref_q15 / ONE * I_RANGE_MA / 1000 + 4 / 3 * vbus * dead_s * RATE_HZ
        loop.integral_d_q9 = round(volts / vbus * BUS_STEPS) << 9
    assert n == ANGLES * (300 + 120 + 2 * LEVELS * (20 + MEAN_MS)) - 1 and loop.dead_shift == 0
    thought(c, begun, "RESISTANCE")
    assert known(c, begun, "RESISTANCE")[0] == pytest.approx(r_ohm * 1e6, rel=0.01)
    assert known(c, begun, "DEAD_TIME")[0] / 10 == pytest.approx(dead_s * 1e9, rel=0.01)


def test_what_the_angles_differ_by_is_in_the_interval(c, begun):
    held(begun, 0.3, 1e-6, 0.036, turn=lambda angle: 1 + 0.05 * (-1) ** angle)
    thought(c, begun, "RESISTANCE")
    uohm, interval = known(c, begun, "RESISTANCE")
    deviation = 0.05 * uohm / math.sqrt(5) * 9 / 7
    assert uohm == pytest.approx(3e5, rel=1e-3)
    assert interval == pytest.approx(2 * math.sqrt(deviation**2 + uohm**2 * (0.015**2 + 0.007**2) / 3), rel=0.01)


def test_what_the_way_down_and_up_differ_by_is_in_the_interval(c, begun):
    held(begun, 0.3, 1e-6, 0.036, up=1.1)
    thought(c, begun, "RESISTANCE")
    uohm, interval = known(c, begun, "RESISTANCE")
    assert interval > 2 * 0.05 * uohm / math.sqrt(3)


@pytest.mark.parametrize("change, reason", [
    (dict(turn=lambda angle: 1 + 0.5 * (-1) ** angle), "SCATTER"), (dict(up=1.5), "SCATTER"),
    (dict(turn=lambda _: -1.0), "NOT_RESISTIVE")])
def test_what_is_no_resistance_is_refused(c, begun, change, reason):
    held(begun, 0.3, 1e-6, 0.036, **change)
    thought(c, begun, "RESISTANCE")
    for name in ("RESISTANCE", "DEAD_TIME"):
        result = begun.results[getattr(c, f"IDENTIFY_{name}")]
        assert (result.state, result.reason) == (c.IDENTIFY_REFUSED, getattr(c, f"IDENTIFY_{reason}"))


def test_a_rated_current_that_the_sensors_hardly_see_is_refused(c):
    p, d = c.params(), c.identify()
    c.params_init(p)
    p.i_rated_ma = 400  # a fifth of it are seven steps of the ADC
    assert c.identify_begin(d, p).error == c.ERROR_NONE
    thought(c, d, "RESISTANCE")
    assert d.results[c.IDENTIFY_RESISTANCE].reason == c.IDENTIFY_RATED_SMALL


# ---- inductance ----


@pytest.mark.parametrize("hold", [1, 3])
@pytest.mark.parametrize("l_h, r_ohm", [(27e-6, 0.32), (27e-6, 0.004), (150e-6, 0.3), (2e-3, 7.5), (30e-3, 0.6)])
def test_inductance_of_any_winding(c, begun, l_h, r_ohm, hold):
    amps = 0.4
    v_steps = round(amps / hold * l_h * RATE_HZ / (VBUS_Q15 / ONE * V_RANGE_MV / 1000) * BUS_STEPS)
    found = inductances(c, begun, l_h, r_ohm, v_steps=max(v_steps, 8), hold=hold, noise=0.8)
    for (nh, interval), true in zip(found, (l_h, 2 * l_h)):
        assert nh == pytest.approx(true * 1e9, rel=0.012), "the samples' noise is in it"
        assert interval > 0.02 * nh


def test_a_current_that_stands_and_one_that_drifts_do_not_matter(c, begun):
    (ld, _), (lq, _) = inductances(c, begun, 150e-6, 0.3, v_steps=1500, noise=0.8, stands_a=2.3, drift_v=-0.02)
    assert ld == pytest.approx(150e3, rel=0.01) and lq == pytest.approx(300e3, rel=0.01)


def test_samples_that_say_nothing_are_refused(c, begun):
    begun.work.inductance.sums[0][0].bursts = begun.work.inductance.sums[1][0].bursts = 1
    thought(c, begun, "INDUCTANCE")
    for name in ("LD", "LQ"):
        assert begun.results[getattr(c, f"IDENTIFY_{name}")].reason == c.IDENTIFY_NO_CURRENT


def axes(c, d, magnets_deg, ratio, which=("HELD", "FREE")):
    """The sums over 16 angles of a winding with its magnets there, and `ratio` times the inductance across them."""
    for name in which:
        s = d.work.axes.sums[getattr(c, f"IDENTIFY_{name}")]
        total, straight = 0j, 0.0
        for n in range(16):
            a, m = math.pi * n / 16, math.radians(magnets_deg)
            y = 40000 * ((1 + 1 / ratio) + (1 - 1 / ratio) * cmath.exp(2j * (m - a)))
            total, straight = total + y * cmath.exp(2j * a), straight + y.real
        s.re, s.im, s.straight = (round(v * ONE) for v in (total.real, total.imag, straight))
    thought(c, d, "AXES")
    return d.axis_q32 / 2**32 * 360


def off(found_deg, true_deg):
    return (found_deg - true_deg + 90) % 180 - 90


@pytest.mark.parametrize("away_deg, ratio", (*((away_deg, 1.3) for away_deg in range(-40, 41, 8)), (0, 1 / 1.3)))
def test_magnets_lie_where_they_were_pulled_whichever_inductance_is_along_them(c, begun, away_deg, ratio):
    assert abs(off(axes(c, begun, 300 + away_deg, ratio), 300 + away_deg)) < 0.1 and not begun.reluctant


def test_a_reluctant_machine_has_them_where_the_smaller_inductance_is(c, begun):
    begun.results[c.IDENTIFY_RESISTANCE].state, begun.results[c.IDENTIFY_RESISTANCE].interval = c.IDENTIFY_KNOWN, 100
    assert abs(off(axes(c, begun, 20, 5), 20)) < 0.1 and begun.reluctant
    assert begun.results[c.IDENTIFY_DEAD_TIME].reason == c.IDENTIFY_TURNED
    assert begun.results[c.IDENTIFY_RESISTANCE].interval == 300, "its rotor turned while resistance was measured"


# ---- where it may run, and what ends it ----

@pytest.mark.parametrize("state", STATES)
def test_it_begins_only_when_off(c, state):
    w = World(c).put(state)
    w.axis.loop.vbus_q15 = VBUS_Q15
    assert (c.drive_identify(w.axis).error == c.ERROR_NONE) == (state == "SWITCH_ON_DISABLED")
    assert w.axis.identify.running == (state == "SWITCH_ON_DISABLED")


@pytest.fixture
def running(c):
    w = World(c)
    w.axis.loop.vbus_q15 = VBUS_Q15
    w.fabric.adc.OFFSET_A = w.fabric.adc.OFFSET_B = w.fabric.adc.OFFSET_C = 32768
    w.axis.start.aligned = True
    assert c.drive_identify(w.axis).error == c.ERROR_NONE
    assert w.step(200) == "SWITCHED_ON" and w.fabric.gate.CONTROL == 1
    return w


def refused_as_stopped(c, w):
    return all(r.state == c.IDENTIFY_REFUSED and r.reason == c.IDENTIFY_STOPPED for r in w.axis.identify.results)


def test_it_forgets_where_the_rotor_stood(running):
    assert not running.axis.start.aligned and running.axis.identify.running


def test_off_ends_it(c, running):
    assert c.drive_switch_off(running.axis).error == c.ERROR_NONE
    assert running.step() == "SWITCH_ON_DISABLED" and running.fabric.gate.CONTROL == 0
    assert not running.axis.identify.running and running.axis.identify.fault == 0 and refused_as_stopped(c, running)


@pytest.mark.parametrize("fault", ["OVERCURRENT", "ENCODER", "OVERTEMPERATURE", "STO_A", "GATES_OFF"])
def test_a_fault_ends_it_and_stands_beside_the_step(c, running, fault):
    running.axis.identify.step = running.axis.identify.stopped_in = c.IDENTIFY_STEP_RESISTANCE
    c.fault_raise(running.axis, getattr(c, f"FAULT_{fault}"))
    assert running.step(2) == "FAULT" and running.fabric.gate.CONTROL == 0
    d = running.axis.identify
    assert (d.running, d.fault, d.stopped_in) == (False, getattr(c, f"FAULT_{fault}"), c.IDENTIFY_STEP_RESISTANCE)
    assert refused_as_stopped(c, running)


def test_at_the_end_the_bridge_is_off(c, running):
    running.axis.start.phase = IDENTIFYING
    running.axis.identify.step = c.IDENTIFY_STEP_DONE
    assert running.step() == "SWITCH_ON_DISABLED" and running.fabric.gate.CONTROL == 0 and not running.axis.identify.running


def test_nothing_is_held_while_the_thread_thinks(c, running):
    running.axis.start.phase, d, loop = IDENTIFYING, running.axis.identify, running.axis.loop
    d.step, d.evaluating = c.IDENTIFY_STEP_RESISTANCE, True
    loop.integral_d_q9, loop.i_d_ref_q15 = 10**6, 1000
    running.step()
    assert loop.integral_d_q9 == loop.i_d_ref_q15 == loop.kp_d_q9 == loop.ki_q15 == 0
    d.evaluating, d.ms = False, 0
    while d.ms == 0:
        assert loop.integral_d_q9 == loop.i_d_ref_q15 == 0, "nor until the next step begins"
        running.step()
    assert loop.kp_d_q9 > 0, "a current is regulated again"


def test_only_what_is_known_becomes_a_parameter(c, begun):
    p = c.params()
    c.params_init(p)
    before = p.lq_uh
    known_value = c.IDENTIFY_KNOWN
    for name, value in (("RESISTANCE", 286512), ("LD", 150600)):
        begun.results[getattr(c, f"IDENTIFY_{name}")].state = known_value
        begun.results[getattr(c, f"IDENTIFY_{name}")].value = value
    refused = begun.results[c.IDENTIFY_LQ]
    refused.state, refused.value = c.IDENTIFY_REFUSED, 987000
    assert c.identify_use(begun, p) == 2
    assert (p.resistance_mohm, p.ld_uh, p.lq_uh) == (287, 151, before)
    assert c.identify_use(begun, p) == 0, "nothing is left to change"


def test_ratings_that_do_not_go_together_are_refused(c):
    p, d = c.params(), c.identify()
    c.params_init(p)
    p.v_min_mv = p.v_max_mv
    assert c.identify_begin(d, p).error == c.ERROR_V_LIMITS and not d.running


def test_what_is_told_of_motor_and_loops_does_not_keep_it_from_beginning(c):
    p, d = c.params(), c.identify()
    c.params_init(p)
    p.position_bw_hz, p.speed_bw_hz, p.current_bw_hz, p.torque_mean_ms = 50, 200, 6400, 4
    p.resistance_mohm, p.ld_uh, p.lq_uh, p.flux_uwb, p.inertia_gmm2 = 100000, 1000000, 1, 10, 2100000000
    p.angle_source = 1
    assert c.identify_begin(d, p).error == c.ERROR_NONE and d.running
    assert d.tuning.angle_source == 0, "no observer of a motor that nobody knows"


@pytest.mark.parametrize("emf_percent, counts", ((-101, False), (-49, True), (49, True)))
@pytest.mark.parametrize("phase, way", enumerate((1, -1, 1, -1, 0)))
def test_the_rotor_is_pushed_forth_back_forth_and_stopped(c, begun, phase, way, emf_percent, counts):
    """From half of the largest EMF of one way to all of the other, what pushes back and forth is summed up."""
    io, most_q15 = measuring(c, begun, "PUSH"), 13670 // 25
    begun.work, begun.phase, begun.phase_ms = c.identify_work(), phase, 1
    push, loop = begun.work.push, io.loop.contents
    loop.vbus_q15, io.speed.contents.estimate.speed_rpm_q15 = 13670, 100
    push.i_q15, push.emf_q18 = 1000, (way or 1) * emf_percent * most_q15 * 8 // 100
    c.identify_measure_push(begun, io)
    pushed = loop.i_q_ref_q15
    assert (pushed > 0) - (pushed < 0) == way and (phase == 0 or abs(pushed) == 1000 * abs(way))
    assert [run.count for run in push.run] == [int(counts and phase == 1), int(counts and phase == 2)]
