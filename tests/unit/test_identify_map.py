# SPDX-License-Identifier: MIT
"""Identify's map: coupled windings, fluxes by slopes, what is refused; and a rotor that swings as the currents drive it."""
import math

import pytest

from rigs.identify_alone import (ONE, RATED_MA, V_RANGE_MV, amps, begin, fill, known, measuring, reason, result_of, rpm_q9,
                                 thought, volts)
from rigs.winding import BUS_STEPS, LAG, LENGTH, RATE_HZ, VBUS_Q15

R_OHM, FLUX_WB, PAIRS = 0.2, 30e-3, 2
LDD, LQQ, LDQ = 500e-6, 1200e-6, 150e-6
RATED_A = RATED_MA / 1000
WAVE, HALF = 2000, 16  # height; waves with i_q to one side
MAX_STEPS = 16384    # LOOP_V_D_MAX_STEPS


def accelerated(c, d, rpm_ms):
    d.ramp_mrad_s2 = c.identify_slope_mrad_s2(fill(c.measure_run(), [(0, 0, rpm_q9(rpm_ms * t)) for t in range(-10, 10)]))


@pytest.fixture
def begun(c):
    """Identify after its constant speeds, of a motor whose rated current turns it slowly."""
    d = begin(c)
    for name, value in (("RESISTANCE", R_OHM * 1e6), ("LD", 600e3), ("LQ", 3000e3), ("FLUX", FLUX_WB * 1e7)):
        result = result_of(c, d, name)
        result.state, result.value, result.interval = c.IDENTIFY_KNOWN, round(value), 1
    d.bus_nv = round(VBUS_Q15 / ONE * V_RANGE_MV * 1e6)
    d.params.pole_pairs, d.flux_e1_uwb, d.rpm_max, d.ramp_i_q15 = PAIRS, round(FLUX_WB * 1e7), 300, amps(RATED_A)
    accelerated(c, d, 0.1)
    d.burst.v_steps, d.burst.hold, d.wave_steps, d.swing_rpm = WAVE, 1, WAVE, 300
    return d


def wave(c, d, sums, axis, ldd, lqq, ldq, r_ohm=R_OHM):
    """A burst along d or q of windings that are coupled."""
    b, det = d.burst, ldd * lqq - ldq**2
    volt = b.v_steps / BUS_STEPS * VBUS_Q15 / ONE * V_RANGE_MV / 1000
    i_d = i_q = 0.0
    for k in range(-LAG, LENGTH + 1):
        along, across = (i_d, i_q) if axis == 0 else (i_q, -i_d)
        b.i_d_q15[k + LAG], b.i_q_q15[k + LAG] = amps(along), amps(across)
        u = c.burst_sign(b, k) * volt if 0 <= k < LENGTH else 0.0
        u_d, u_q = (u, 0.0) if axis == 0 else (0.0, u)
        u_d, u_q = u_d - r_ohm * i_d, u_q - r_ohm * i_q
        i_d, i_q = i_d + (lqq * u_d - ldq * u_q) / det / RATE_HZ, i_q + (ldd * u_q - ldq * u_d) / det / RATE_HZ
    c.burst_add(sums, b, VBUS_Q15)


def waves(c, d, point, ldd=LDD, lqq=LQQ, ldq=LDQ, count=HALF):
    """Both axes, i_q to either side: there the sign of what couples them is the other."""
    point.v_steps = d.burst.v_steps = WAVE
    for half, sign in ((0, 1), (1, -1)):
        for axis in (0, 1):
            for _ in range(4):
                wave(c, d, point.sums[axis][half], axis, ldd, lqq, sign * ldq)
        point.bursts[half] = count


def swings(point, psi_d, psi_q, i_q, r_v=0.4):
    """What is summed up over the speed, i_q to either side, with a resistance's and a dead time's part that stands."""
    for half, sign in ((0, 1), (1, -1)):
        speeds = [0.5 * sign * t for t in range(-60, 61)]
        fill(point.run[half][0], [(sign * amps(i_q), volts(PAIRS * w * psi_d + sign * r_v), rpm_q9(w)) for w in speeds])
        fill(point.run[half][1], [(sign * amps(i_q), volts(PAIRS * w * psi_q + 0.2), rpm_q9(w)) for w in speeds])


def across(c, d, ldq=LDQ, psi_q=0.09):
    d.work.map.points = 3
    for k in range(3):
        waves(c, d, d.work.map.at[k], LDD * (1 - 0.1 * k), LQQ * (1 - 0.2 * k), ldq)
    swings(d.work.map.at[2], FLUX_WB, psi_q, RATED_A)
    return thought(c, d, "ACROSS")


def test_map_of_coupled_windings_has_the_inductances_and_not_what_a_wave_alone_sees(c, begun):
    across(c, begun)
    for k in range(3):
        ld, ld_interval = known(c, begun, f"LD_Q{k + 1}")
        lq, _ = known(c, begun, f"LQ_Q{k + 1}")
        assert ld == pytest.approx(LDD * (1 - 0.1 * k) * 1e9, rel=0.015), "alone it would be 4 to 7 % less"
        assert lq == pytest.approx(LQQ * (1 - 0.2 * k) * 1e9, rel=0.015)
        assert 0.02 * ld < ld_interval < 0.06 * ld


def test_map_interval_grows_with_the_slope_over_the_current(c, begun):
    across(c, begun)
    shares = [interval / value for value, interval in (known(c, begun, f"LQ_Q{k}") for k in (1, 2, 3))]
    step, last = 0.2 * LQQ, 0.6 * LQQ
    assert shares[2] == pytest.approx(math.hypot(shares[0], 2 * 0.015 * step * 3 / last / math.sqrt(3)), rel=0.1)
    assert shares[0] < shares[1] < shares[2]


def test_map_point_without_waves_is_refused_and_the_others_are_not(c, begun):
    begun.work.map.points = 3
    for k in range(3):
        waves(c, begun, begun.work.map.at[k], count=7 if k == 1 else HALF)
    thought(c, begun, "ACROSS")
    assert reason(c, begun, "LD_Q2") == reason(c, begun, "LQ_Q2") == c.IDENTIFY_TOO_LIGHT
    assert known(c, begun, "LD_Q1") and known(c, begun, "LQ_Q3")


def test_map_halves_that_differ_by_a_tenth_are_refused(c, begun):
    begun.work.map.points = 3
    for k in range(3):
        waves(c, begun, begun.work.map.at[k], ldq=0)
        for _ in range(4):
            wave(c, begun, begun.work.map.at[k].sums[0][1], 0, LDD * 1.4, LQQ, 0)
    thought(c, begun, "ACROSS")
    assert reason(c, begun, "LD_Q1") == c.IDENTIFY_SCATTER and known(c, begun, "LQ_Q1")


def test_map_chooses_the_current_of_most_torque_by_the_flux_across(c, begun):
    psi_q, begun.reluctant = 0.09, True
    across(c, begun, psi_q=psi_q)
    more = psi_q / RATED_A - 600e-6
    i_d = (FLUX_WB - math.sqrt(FLUX_WB**2 + 8 * (more * RATED_A)**2)) / (4 * more)
    assert begun.torque_d_q15 == pytest.approx(amps(i_d), rel=5e-3)
    assert begun.torque_q_q15 == pytest.approx(amps(math.sqrt(RATED_A**2 - i_d**2)), rel=5e-3)
    assert begun.step == c.IDENTIFY_STEP_TORQUE and result_of(c, begun, "TORQUE_ID").state == c.IDENTIFY_UNKNOWN


@pytest.mark.parametrize("reluctant, lq_h", ((True, 700e-6), (False, 9e-3)))
def test_map_refuses_a_torque_point_of_a_machine_without_saliency(c, begun, reluctant, lq_h):
    begun.reluctant = reluctant
    across(c, begun, psi_q=lq_h * RATED_A)
    for name in ("TORQUE_ID", "TORQUE_IQ", "TORQUE_FLUX", "TORQUE_ACROSS", "CROSS"):
        assert reason(c, begun, name) == c.IDENTIFY_NOT_SALIENT


def torque(c, d, psi_d=0.02, psi_q=0.06, i_d=-2.4, i_q=2.9):
    p = d.work.map.at[0]
    d.work.map.points, p.i_d_q15, p.i_q_q15 = 1, amps(i_d), amps(i_q)
    waves(c, d, p)
    swings(p, psi_d, psi_q, i_q)
    return thought(c, d, "TORQUE")


def test_map_of_most_torque_has_fluxes_free_of_what_stands_and_what_couples(c, begun):
    torque(c, begun)
    assert known(c, begun, "TORQUE_ID")[0] == pytest.approx(-2400, abs=2)
    assert known(c, begun, "TORQUE_IQ")[0] == pytest.approx(2900, abs=2)
    for name, right in (("TORQUE_FLUX", 0.02), ("TORQUE_ACROSS", 0.06)):
        value, interval = known(c, begun, name)
        assert value == pytest.approx(right * 1e7, rel=2e-3) and 0.02 * value < interval < 0.04 * value
    assert known(c, begun, "CROSS")[0] == pytest.approx(1000 * LDQ / LQQ, abs=2), "its sign is that of i_q"


@pytest.mark.parametrize("lost", ("run", "waves"))
def test_map_of_most_torque_is_refused_where_a_half_is_missing(c, begun, lost):
    if lost == "run":
        begun.work.map.at[0].run[1][0].count = -1000
    torque(c, begun)
    if lost == "waves":
        for name in ("TORQUE_ID", "CROSS"):
            result_of(c, begun, name).state = c.IDENTIFY_UNKNOWN
        begun.work.map.at[0].bursts[1] = 3
        thought(c, begun, "TORQUE")
    assert reason(c, begun, "TORQUE_ID") == reason(c, begun, "CROSS") == c.IDENTIFY_TOO_LIGHT


# ---- along ----

def along(c, d, points=4, ld=(400e-6, 450e-6, 550e-6, 600e-6)):
    d.work.map.points = points
    for k in range(points):
        p = d.work.map.at[k]
        p.i_d_q15 = amps(RATED_A * (-1, -0.5, 0.5, 1)[k])
        waves(c, d, p, ldd=ld[k], ldq=0)
    return d


def test_map_along_the_magnets(c, begun):
    thought(c, along(c, begun), "ALONG")
    for name, right in (("LD_D2_BACK", 400), ("LD_D1_BACK", 450), ("LD_D1", 550), ("LD_D2", 600)):
        assert known(c, begun, name)[0] == pytest.approx(right * 1e3, rel=0.015)
    assert known(c, begun, "RESISTANCE") == (round(R_OHM * 1e6), 1), "measured before, and better"


@pytest.mark.parametrize("way", (1, -1))
def test_map_of_a_reluctant_machine_has_its_resistance(c, begun, way):
    """By what two currents along the magnets differ by; i_q, across which the field turns, takes a known part of it."""
    begun.reluctant, w, r_ohm = True, way * 50.0, 0.9
    result_of(c, begun, "RESISTANCE").state, begun.rough_mohm = c.IDENTIFY_REFUSED, 200
    for k, i_q in ((0, way * 0.3), (1, way * 0.9)):
        p = along(c, begun, 2).work.map.at[k]
        v_d = r_ohm * RATED_A * (-1, -0.5)[k] - w * PAIRS * 3000e-6 * i_q + 0.3
        fill(p.run[0][0], [(amps(i_q), volts(v_d), rpm_q9(w))] * 100)
    thought(c, begun, "ALONG")
    uohm, interval = known(c, begun, "RESISTANCE")
    assert uohm == pytest.approx(r_ohm * 1e6, rel=3e-3) and 0.02 * uohm < interval < 0.1 * uohm
    assert begun.params.resistance_mohm == round(uohm / 1000)
    assert reason(c, begun, "LD_D1") == reason(c, begun, "LD_D2") == c.IDENTIFY_TURNED


def test_map_of_a_rotor_that_no_loop_could_hold_is_refused_before_it_is_driven(c, begun):
    accelerated(c, begun, 2.3)
    thought(c, along(c, begun), "ALONG")
    assert known(c, begun, "LD_D1")
    for name in ("LD_Q1", "LQ_Q3", "TORQUE_ID", "CROSS"):
        assert reason(c, begun, name) == c.IDENTIFY_TOO_LIGHT


# ---- a reluctant machine is not pulled round ----

def test_three_angles_tell_a_reluctant_machine_whose_resistance_is_left_for_later(c, begun):
    for turned_deg, ratio, expected in ((0, 1.3, False), (37, 1.3, False), (0, 4, True), (73, 4, True), (140, 4, True)):
        for k in range(3):
            away = math.radians(2 * (turned_deg - 120 * k))
            s = begun.work.pulses.sums[k]
            s.count, s.ud = 100, round(40000 * ((1 + 1 / ratio) + (1 - 1 / ratio) * math.cos(away)))
            s.uq = round(40000 * (1 - 1 / ratio) * math.sin(away))
            s.vbus_q15, s.bursts = VBUS_Q15, 1
        thought(c, begun, "PULSES")
        assert begun.reluctant == expected, (turned_deg, ratio)
    thought(c, begun, "RESISTANCE")
    assert reason(c, begun, "RESISTANCE") == reason(c, begun, "DEAD_TIME") == c.IDENTIFY_TURNED
    assert begun.step == c.IDENTIFY_STEP_AXES


# ---- measuring ----

class Swinging:
    """A rotor that turns as the q current drives it, seen once a millisecond; currents are there in two."""

    def __init__(self, c, d, accel_rpm_ms):
        self.c, self.d, self.accel = c, d, accel_rpm_ms
        self.io = measuring(c, d, "ALONG")
        self.loop, self.speed = self.io.loop.contents, self.io.speed.contents
        c.speed_loop_init(self.speed)
        c.speed_loop_tune(self.speed, d.tuning)
        self.loop.vbus_q15, self.rpm, self.seen = VBUS_Q15, 0.0, []

    def play(self, step, most_ms=20000):
        self.d.step, self.d.work = getattr(self.c, f"IDENTIFY_STEP_{step}"), self.c.identify_work()
        self.d.ms = self.d.phase = self.d.phase_ms = 0
        for _ in range(most_ms):
            done = self.c.identify_measure(self.d, self.io)
            self.loop.i_q_q15 += (self.loop.i_q_ref_q15 - self.loop.i_q_q15) // 2
            self.loop.i_d_q15 = self.loop.i_d_ref_q15
            self.rpm += self.accel * self.loop.i_q_q15 / amps(RATED_A)
            self.speed.estimate.speed_rpm_q15 = round(self.rpm * 32768)
            self.speed.speed_rpm_q4 = round(self.rpm * 16)
            self.loop.angle_offset_q32 = (self.loop.angle_offset_q32 + round(self.rpm / 60000 * PAIRS * 2**32)) % 2**32
            self.seen.append((self.rpm, self.loop.i_d_ref_q15, self.loop.i_q_ref_q15))
            if done:
                return True
        return False


@pytest.mark.parametrize("reluctant", (False, True))
def test_map_swings_between_two_speeds_until_both_ways_have_waves_and_sums(c, begun, reluctant):
    begun.reluctant = reluctant
    rotor = Swinging(c, begun, 2.0)
    assert rotor.play("ACROSS") and begun.work.map.points == 3
    for k, thirds in enumerate((1, 2, 3)):
        p = begun.work.map.at[k]
        assert list(p.bursts) == [HALF, HALF] and p.rpm == 100 * thirds and p.v_steps == WAVE
        assert all((p.run[half][0].count > 20) == (p.run[half][1].count > 20) == (reluctant and k == 2) for half in (0, 1))
        assert all(p.sums[axis][half].bursts == HALF // 2 for axis in (0, 1) for half in (0, 1))
    assert not reluctant or begun.work.map.at[2].run[0][0].i > 0 > begun.work.map.at[2].run[1][0].i
    assert max(abs(rpm) for rpm, _, _ in rotor.seen) < 300 + 5 * 2.0, "no further than a current needs to turn round"
    assert max(abs(i_q) for _, _, i_q in rotor.seen) <= amps(RATED_A)
    assert all(i_d == 0 for _, i_d, _ in rotor.seen) and rotor.seen[-1][2] != amps(RATED_A)


def test_map_waves_are_halved_beside_a_small_current_that_ripples_alone(c, begun):
    """Below two fifths of the rated one: a third across; the negative ones along are not small."""
    begun.ripple_q10 = 50
    rotor = Swinging(c, begun, 0.4)
    for step, heights in (("ALONG", [WAVE] * 4), ("ACROSS", [WAVE // 2, WAVE, WAVE])):
        assert rotor.play(step, 60000)
        assert [p.v_steps for p in begun.work.map.at[:begun.work.map.points]] == heights


def test_map_of_most_torque_rides_on_the_chosen_current(c, begun):
    begun.torque_d_q15, begun.torque_q_q15 = -amps(2.4), amps(2.9)
    rotor = Swinging(c, begun, 2.0)
    assert rotor.play("TORQUE") and list(begun.work.map.at[0].bursts) == [HALF, HALF]
    assert min(i_d for _, i_d, _ in rotor.seen) == -amps(2.4) and rotor.seen[-1][1] == 0


def test_map_gives_up_on_a_rotor_that_turns_round_too_soon(c, begun):
    rotor = Swinging(c, begun, 400.0)
    assert rotor.play("ACROSS")
    assert all(begun.work.map.at[k].bursts[0] + begun.work.map.at[k].bursts[1] < HALF for k in range(3))
    thought(c, begun, "ACROSS")
    assert reason(c, begun, "LD_Q1") == c.IDENTIFY_TOO_LIGHT


@pytest.mark.parametrize("reluctant, levels", ((False, (-12, -6, 6, 12)), (True, (-12, -6))))
def test_map_along_turns_slowly_with_each_current(c, begun, reluctant, levels):
    begun.reluctant = reluctant
    rotor = Swinging(c, begun, 0.4)
    assert rotor.play("ALONG") and begun.work.map.points == len(levels)
    for k, level in enumerate(levels):
        p = begun.work.map.at[k]
        assert p.i_d_q15 == pytest.approx(amps(RATED_A) * level / 12, abs=2) and list(p.bursts) == [HALF, HALF]
        assert p.sums[0][0].bursts == p.sums[0][1].bursts == HALF and p.sums[1][0].bursts == 0
        assert p.run[0][0].count == (128 if reluctant else 0)
    assert max(abs(rpm) for rpm, _, _ in rotor.seen) < 160


def test_map_is_measured_without_compensation_in_the_frame_that_the_constant_speeds_have_found(c, begun):
    begun.tuning.ripple_q10, begun.taken, begun.ahead_q32 = 77, True, 1000
    c.identify_replace(begun)
    assert begun.retuned and begun.tuning.ripple_q10 == begun.ripple_q10 == 77, "a handler serves that knows dead_shift"
    loop = c.current_loop()
    loop.angle_offset_q32 = 123456789
    assert c.identify_angle_q32(begun, loop) == 123456789 - 1000
    c.identify_taken(begun)
    assert c.identify_angle_q32(begun, loop) == 123456789, "once"
    rotor = Swinging(c, begun, 0.0)
    rotor.loop.ripple_q10 = 1
    rotor.play("ALONG", 1)
    assert rotor.loop.ripple_q10 == 0 and rotor.loop.dead_shift == 31
    begun.ripple_q10, rotor.loop.dead_shift = 0, 0
    rotor.play("ALONG", 1)
    assert rotor.loop.dead_shift == 0, "where ripple does not count another handler serves"


@pytest.mark.parametrize("rippled", (False, True))
def test_map_waves_wait_until_the_current_lies_near_to_a_phase(c, begun, rippled):
    begun.ripple_q10, near_deg = (50, 10) if rippled else (0, 18)
    rotor = Swinging(c, begun, 0.4)
    rotor.play("ALONG", 350)
    p, begun.phase = begun.work.map.at[0], 0
    rotor.speed.integral_q29 = 0
    for degrees in range(0, 360, 3):
        rotor.loop.angle_offset_q32 = round(degrees / 360 * 2**32)
        p.bursts[0] = p.bursts[1] = begun.phase = 0
        begun.phase_ms = 100
        c.identify_measure(begun, rotor.io)
        away = abs((degrees + 30) % 60 - 30)
        if abs(away - near_deg) > 6:  # a little current across holds the speed
            assert (p.bursts[0] + p.bursts[1] > 0) == (away <= near_deg), degrees


@pytest.mark.parametrize("held, fits", ((0, WAVE), (MAX_STEPS - WAVE, WAVE), (MAX_STEPS - WAVE // 3, WAVE // 3),
                                        (MAX_STEPS, 1)))
def test_map_waves_leave_room_for_the_voltage_that_holds_the_current(c, begun, held, fits):
    """A wave that the limit of v_d clips was taken for a whole one: L_d came out 16 % too large (lot 112)."""
    rotor = Swinging(c, begun, 0.4)
    rotor.play("ALONG", 350)
    p, begun.phase, begun.phase_ms = begun.work.map.at[0], 0, 100
    p.v_steps, p.bursts[0], p.bursts[1] = WAVE, 0, 0
    rotor.loop.angle_offset_q32, rotor.speed.integral_q29 = 0, 0
    rotor.loop.integral_d_q9, rotor.loop.integral_q_q9 = held // 2 * 512, (held - held // 2) * 512
    c.identify_measure(begun, rotor.io)
    assert p.bursts[0] + p.bursts[1] == 1 and p.v_steps == begun.burst.v_steps == fits
    rotor.loop.integral_d_q9, begun.phase_ms, rotor.loop.angle_offset_q32 = MAX_STEPS * 512, 100, 0
    c.identify_measure(begun, rotor.io)
    assert p.bursts[0] + p.bursts[1] == (1 if fits > 1 else 2), "a later one waits until it fits"


@pytest.mark.parametrize("ripple_q10, level, hidden", ((0, 1, False), (1500, 1, True), (1500, 3, False)))
def test_map_of_a_current_that_ripples_has_no_inductance_across_a_small_one(c, begun, ripple_q10, level, hidden):
    """There the phases that the wave goes through change their signs."""
    begun.ripple_q10, begun.work.map.points = ripple_q10, 3
    for k in range(3):
        waves(c, begun, begun.work.map.at[k])
        begun.work.map.at[k].i_q_q15, begun.work.map.at[k].rpm = amps(RATED_A * (k + 1) / 3), 100
    begun.params.resistance_mohm = 200
    thought(c, begun, "ACROSS")
    assert (reason(c, begun, f"LD_Q{level}") == c.IDENTIFY_RIPPLED) == hidden
    assert known(c, begun, f"LQ_Q{level}"), "that wave goes through the phase that carries most"


def test_map_is_not_measured_where_it_is_refused_already(c, begun):
    for name in ("LD_D2_BACK", "LD_Q1", "TORQUE_ID"):
        result_of(c, begun, name).state = c.IDENTIFY_REFUSED
    rotor = Swinging(c, begun, 1.0)
    for step in ("ALONG", "ACROSS", "TORQUE"):
        assert rotor.play(step, 200) and all(i_d == 0 for _, i_d, _ in rotor.seen)
        assert begun.work.map.points == 0 and not any(begun.work.map.at[0].bursts)


# ---- use ----

def use(c, d):
    p = c.params()
    c.params_init(p)
    return p, c.identify_use(d, p)


def know(c, d, **values):
    for name, value in values.items():
        result = result_of(c, d, name)
        result.state, result.value, result.interval = c.IDENTIFY_KNOWN, value, 1


def test_use_takes_the_map_of_a_reluctant_machine(c, begun):
    begun.reluctant = True
    know(c, begun, LD_Q3=470000, LQ_Q3=540000, TORQUE_ID=-2400, TORQUE_IQ=2900, TORQUE_FLUX=200000, TORQUE_ACROSS=600000,
         CROSS=110)
    p, changed = use(c, begun)
    assert (p.ld_uh, p.lq_uh, p.lq_rest_uh, p.cross_pm) == (470, 540, 3000, 110)
    assert p.ld_apparent_uh == round((FLUX_WB - 0.02) / 2.4 * 1e6) and p.lq_apparent_uh == round(0.06 / 2.9 * 1e6)
    assert changed == 8 and c.identify_use(begun, p) == 0


def test_use_leaves_what_the_map_has_refused_and_the_loops_of_others_as_they_were(c, begun):
    p, _ = use(c, begun)
    assert (p.ld_uh, p.lq_uh, p.lq_rest_uh, p.ld_apparent_uh, p.lq_apparent_uh) == (600, 3000, 0, 0, 0)
    know(c, begun, LD_Q3=470000, LQ_Q3=540000)
    p, _ = use(c, begun)
    assert (p.ld_uh, p.lq_uh, p.lq_rest_uh) == (600, 3000, 0), "not a reluctant machine"


def test_use_keeps_what_is_made_of_both_within_its_parameters(c, begun):
    begun.reluctant = True
    know(c, begun, TORQUE_ID=-2400, TORQUE_IQ=2900, TORQUE_FLUX=400000, TORQUE_ACROSS=-5, CROSS=-300)
    p, _ = use(c, begun)
    assert (p.ld_apparent_uh, p.lq_apparent_uh, p.cross_pm) == (1, 1, -249)
