# SPDX-License-Identifier: MIT
"""While the observer leads: what says that the rotor is not where it says, and for how long it has to say so."""
import ctypes
import math

import pytest

from rigs.drive import World
from rigs.motor import Motor
from rigs.motor_numbers import compute, shipped

SURE_MS = 10


@pytest.fixture
def led(c):
    """Milliseconds until the lock is lost, of an observer with this margin, error of size and EMF by a factor; or None."""
    def run(motor, emf=1.0, margin=20.0, rho=0.0, share=0.3, backwards=False, ms=40):
        p = {**shipped(motor), "angle_source": 1}
        w = World(c).put("OPERATION_ENABLED")
        a, loop = w.axis, w.axis.loop
        _, _, a.tuning = compute(c, p)
        c.current_loop_tune(loop, a.tuning)
        loop.source, loop.field_follows, loop.vbus_q15 = c.LOOP_OBSERVER, 2**32 - 1, w.fabric.adc.VBUS
        rad_s = share * p["speed_max_rpm"] / 60 * 2 * math.pi * p["pole_pairs"] * (-1 if backwards else 1)
        loop.pll.speed_q32 = round(rad_s / 2 / math.pi / 20000 * 2**32)
        i_a = 0.3 * p["i_max_ma"] / 1000
        loop.i_q_q15 = round(i_a / p["i_range_ma"] * 1000 * 32768)
        volts = p["resistance_mohm"] / 1000 * i_a + emf * rad_s * p["flux_uwb"] * 1e-6
        loop.v_q_q15 = round(volts / p["v_range_mv"] * 1000 * 32768)
        loop.flux.margin_q8, loop.flux.rho_q15 = round(margin * 256), round(rho * 32768)
        for n in range(ms):
            c.lock_watch_step(a)
            c.reaction_step(a)
            if a.faults.cause:
                assert a.faults.cause == c.FAULT_LOCK_LOST
                return n + 1
        return None
    return run


@pytest.mark.parametrize("backwards", (False, True))
def test_all_is_well(led, backwards):
    assert led("teknic_m2310p", backwards=backwards) is None


@pytest.mark.parametrize("backwards", (False, True))
@pytest.mark.parametrize("emf, lost", ((0.55, True), (0.75, False), (1.25, False), (1.5, True), (-1.0, True), (0.0, True)))
def test_an_emf_of_another_size_is_no_rotor_that_is_followed(led, emf, lost, backwards):
    assert led("teknic_m2310p", emf=emf, backwards=backwards) == (SURE_MS if lost else None)


def test_with_little_margin_more_is_allowed(led):
    assert led("teknic_m2310p", emf=0.6, margin=20) == SURE_MS and led("teknic_m2310p", emf=0.6, margin=4) is None


@pytest.mark.parametrize("emf", (0.3, 2.0))
def test_iron_that_saturates_makes_an_emf_of_its_own(led, emf):
    assert led("thor_pmsyrm", emf=emf) is None


@pytest.mark.parametrize("rho, margin, lost", ((0.28, 20, False), (0.32, 20, True), (-0.32, 20, True), (0, 1.6, False),
                                               (0, 1.4, True)))
def test_a_flux_of_another_size_or_none_that_is_seen(led, rho, margin, lost):
    assert led("teknic_m2310p", rho=rho, margin=margin) == (SURE_MS if lost else None)


ENCODER, OBSERVER, HALL = range(3)  # enum param_angle


@pytest.mark.parametrize("source, lost_ms, found", (
    (ENCODER, 0, True), (ENCODER, 3, True), (HALL, 3, True), (OBSERVER, 0, True), (OBSERVER, 1, False), (OBSERVER, 3, False)))
def test_a_current_that_is_asked_along_a_doubtful_angle_is_no_open_phase(c, source, lost_ms, found):
    """While the observer contradicts itself. What is left of an older doubt has no say where something else tells the angle."""
    m = Motor(c, 1500, 4.0).step(600)
    m.open_phase, m.axis.tuning.angle_source, m.axis.lock_watch.lost_ms = 1, source, lost_ms
    for _ in range(60):
        m.axis.supervision.phases.i_q_ref_q15 = m.axis.loop.i_q_ref_q15
        m.counts += m.rpm / 60000 * m.p.encoder_counts
        m.see()
        m.c.phase_watch_step(m.axis)
        m.c.reaction_step(m.axis)
    assert m.fault == ("OPEN_PHASE" if found else "NONE")


@pytest.mark.parametrize("source, lost_ms, cause", (
    (OBSERVER, 3, "NONE"), (OBSERVER, 0, "OPEN_PHASE"), (ENCODER, 3, "OPEN_PHASE"), (HALL, 3, "OPEN_PHASE")))
def test_a_speed_that_is_lost_waits_for_the_observers_verdict(c, source, lost_ms, cause):
    """Neither it nor a phase that may be open is named meanwhile: lock lost is, or the doubt goes by."""
    m = Motor(c, 1500, 4.0).step(600)
    m.axis.tuning.angle_source, m.axis.lock_watch.lost_ms = source, lost_ms
    m.axis.supervision.phases.missing_q15[1] = m.axis.supervision.phases.min_q15 * 3
    phase = ctypes.c_int32()
    assert c.phase_watch_suspects(m.axis, phase) == (cause != "NONE")
    m.axis.supervision.speed.deviation_q4, m.axis.supervision.speed.far_ms = -1, 100
    c.speed_watch_step(m.axis)
    c.reaction_step(m.axis)
    assert m.fault == cause
