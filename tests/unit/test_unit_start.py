# SPDX-License-Identifier: MIT
"""The start's decisions: load angle against the torque function, counts against pole pairs, and whole alignments of a rotor on
a perfect current source (host/rotor.c): every angle, load, inertia and everything that can be told wrongly."""
import math
from types import SimpleNamespace

import pytest

from rigs.aligning import MOTORS, TURN, params_of


def wrapped(angle_q32):
    return ((int(angle_q32) + TURN // 2) % TURN - TURN // 2) * 360 / TURN


# ---- load angle ----

def torque(current, saliency, angle):
    return current * math.sin(angle) * (1 - saliency * current * math.cos(angle))


def angle_of(wanted, current, saliency):
    """Below the pull-out, where the torque rises with the angle."""
    low, high = -math.pi / 3, math.pi / 3
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if torque(current, saliency, middle) < wanted else (low, middle)
    return low


@pytest.mark.parametrize("saliency", [0, 0.15, 0.4])
@pytest.mark.parametrize("ratio", [0.5, 0.6])
def test_the_offset_is_free_of_load_and_friction(c, saliency, ratio):
    for load in (-0.3, -0.12, 0, 0.05, 0.3):
        for friction in (0, 0.08):
            for offset_deg in (-170, 3, 91):
                solver = c.load_angle()
                solver.ratio_q15, solver.saliency_q15 = round(ratio * 32768), round(saliency * 32768)
                for less, current in enumerate((1, ratio)):
                    for way, into in ((1, solver.forward_q32), (-1, solver.back_q32)):
                        lead = math.degrees(angle_of(load + way * friction, current, saliency))
                        into[less] = round((offset_deg + lead) / 360 * TURN) % TURN
                c.load_angle_start(solver)
                steps = 1
                while not c.load_angle_step(solver):
                    steps += 1
                offset = (solver.centre_q32 + solver.low_q32) % TURN
                assert steps == 40 and solver.high_q32 - solver.low_q32 == pytest.approx(TURN / 3 / 2**20, rel=0.01)
                assert abs(wrapped(offset - offset_deg / 360 * TURN)) < 0.15, (load, friction, offset_deg)
                largest = max(abs(math.degrees(angle_of(load + way * friction, 1, saliency))) for way in (1, -1))
                assert c.load_angle_largest_q32(solver) * 360 / TURN == pytest.approx(largest, abs=0.15)


def test_the_torque_is_that_of_the_machine(c):
    for current in (16384, 32768):
        for saliency in (0, 8000, 16384):
            for degrees in range(0, 360, 7):
                seen = c.load_angle_torque_q15(current, saliency, round(degrees / 360 * TURN))
                assert seen == pytest.approx(32768 * torque(current / 32768, saliency / 32768, math.radians(degrees)), abs=6)


# ---- counts ----

@pytest.fixture
def named(c):
    """What is said of a motor of the first two numbers, told the others; `error` of the measurement."""
    return lambda true_p, true_n, told_p, told_n, error=0.0: c.encoder_fit(
        round(32 * true_n / true_p * (1 + error)), told_p, told_n)


def test_right_ones_fit_up_to_one_percent(c, named):
    for p in range(1, 51):
        for n in (1024, 4000, 8192, 20000, 65536):
            if n / p >= 100:
                for error in (-0.009, 0, 0.009):
                    assert named(p, n, p, n, error).verdict == c.ENCODER_FITS, (p, n, error)


def test_wrong_pole_pairs_are_named_with_those_that_fit(c, named):
    for p in range(1, 51):
        for told in range(1, min(2 * p, 50) + 1):
            if told != p:
                verdict = named(p, 10000, told, 10000)
                assert (verdict.verdict, verdict.pole_pairs) == (c.ENCODER_POLE_PAIRS, p), (p, told)
                assert verdict.encoder_counts == pytest.approx(10000 * told / p, rel=0.012, abs=3) or told * 10000 / p > 65536


@pytest.mark.parametrize("ratio, pairs", ((4.86, 5), (4.83, 0), (5.14, 5), (5.17, 0)))
def test_pole_pairs_are_named_where_they_are_whole_to_a_tenth(c, named, ratio, pairs):
    verdict = named(ratio, 10000, 2, 10000)
    assert verdict.pole_pairs == pairs and verdict.verdict == (c.ENCODER_POLE_PAIRS if pairs else c.ENCODER_COUNTS)


def test_wrong_counts_are_named_with_those_that_fit(c, named):
    for p in range(1, 51):
        for n in (2048, 4000, 10000):
            for factor in (0.98, 1.02, 1.1, 1.37, 2):
                told = round(n * factor)
                for error in (-0.004, 0, 0.004):
                    verdict = named(p, n, p, told, error if abs(factor - 1) > 0.03 else 0)
                    assert verdict.verdict != c.ENCODER_FITS, (p, n, told)
                    if n / p >= 100:
                        assert verdict.encoder_counts == n, (p, n, told, error)
                    if verdict.verdict == c.ENCODER_POLE_PAIRS:  # then pole pairs explain it as well
                        assert abs(p * factor - verdict.pole_pairs) < 0.16 + 0.01 * p, (p, n, told)


def test_four_times_the_counts_are_lines(c, named):
    verdict = named(4, 4096, 4, 1024)
    assert (verdict.verdict, verdict.encoder_counts) == (c.ENCODER_COUNTS, 4096)


# ---- whole alignments on a rotor ----


def align(c, name, start_deg=30, inertia=None, told_inertia=1, hoist=0.0, coulomb=0.0, told=None, **wrong):
    """Loads in parts of rated torque; inertia in those of the rotor."""
    pairs, counts, ohm, ld, lq, flux, whole, rotor, *_, rated, friction, cogging, per_rev, _ = MOTORS[name]
    case, outcome = c.rotor_case(), c.rotor_outcome()
    inertia = whole if inertia is None else round(rotor * inertia)
    for key, value in dict(pole_pairs=pairs, counts=wrong.pop("counts", counts), resistance_mohm=ohm, flux_uwb=flux, ld_uh=ld,
                           lq_uh=lq, inertia_gmm2=inertia,
                           start_deg=start_deg, hoist_unm=round(hoist * rated), friction_unm=round(coulomb * rated) + friction,
                           cogging_unm=cogging, cogging_per_rev=per_rev, **wrong).items():
        setattr(case, key, value)
    whole = inertia + wrong.get("load_gmm2", 0)
    params = params_of(c, name, inertia_gmm2=max(1, round(whole * told_inertia)), **(told or {}))
    c.rotor_align(case, params, outcome)
    name = next(key for key, value in c.enums["alignment_result"].items() if value == outcome.result)
    return SimpleNamespace(name=name, **{member: getattr(outcome, member) for member, _ in outcome._fields_})


ANGLES = sorted({*range(0, 360, 15), 89, 91, 179, 181, 269, 271, 359, 1})


@pytest.mark.parametrize("name", MOTORS)
def test_from_every_angle(c, name):
    for degrees in ANGLES:
        seen = align(c, name, degrees)
        assert seen.name == "ALIGNMENT_DONE" and abs(seen.error_mdeg) < 1500, (degrees, seen.name, seen.error_mdeg)
        assert seen.moved_mturn <= (4000 if name == "dys" else 2600), "docs/design.md states the bound"


@pytest.mark.parametrize("name", MOTORS)
@pytest.mark.parametrize("counts", [64, 100, 128, 200, 256, 512])
def test_with_few_counts(c, name, counts):
    """From 16 in an electrical turn on, below which a parameter is refused: as well as half a count lets it be known."""
    pairs = MOTORS[name][0]
    if counts < 16 * pairs:
        assert c.tuning_compute(params_of(c, name, encoder_counts=counts), c.tuning()).error == c.ERROR_ENCODER_COARSE
        return
    for degrees in ANGLES[::2]:
        seen = align(c, name, degrees, told=dict(encoder_counts=counts), counts=counts)
        assert seen.name == "ALIGNMENT_DONE", (degrees, seen.name, list(seen.detail))
        assert abs(seen.error_mdeg) < 2500 + 180e3 * pairs / counts, (degrees, seen.error_mdeg)


@pytest.mark.parametrize("start_deg", (10, 130, 250))
def test_a_machine_that_shows_no_axis_is_told_by_the_passes_or_says_so(c, start_deg):
    """Told a saliency that it does not have; the current source of this rotor answers no voltage."""
    seen = align(c, "teknic", start_deg, told={"lq_uh": 700})
    assert seen.name == "ALIGNMENT_LOAD" or (seen.name == "ALIGNMENT_DONE" and abs(seen.error_mdeg) < 2000), seen
    assert start_deg == 250 or seen.name == "ALIGNMENT_DONE"


def test_few_counts_that_are_silent_are_a_dead_encoder(c):
    for name in MOTORS:
        counts = 16 * MOTORS[name][0]
        seen = align(c, name, 95, coulomb=0.05, dead=True, counts=max(64, counts), told=dict(encoder_counts=max(64, counts)))
        assert seen.name == "ALIGNMENT_ENCODER_DEAD", (name, seen.name)


@pytest.mark.parametrize("name", MOTORS)
@pytest.mark.parametrize("along, across", [(1, 0), (-1, 0), (0.6, 0.6), (0.6, -0.6), (-0.6, -0.6)])
def test_dead_time_does_not_turn_the_encoder_round(c, name, along, across):
    """Voltages that are off by as much as the magnets induce at the speed of the pull."""
    pairs, flux, speed_max = MOTORS[name][0], MOTORS[name][5], MOTORS[name][-1]
    emf_mv = flux * 1e-3 * pairs * 0.016 * speed_max * math.tau / 60
    for degrees in range(0, 360, 20):
        seen = align(c, name, degrees, along_mv=round(along * emf_mv), across_mv=round(across * emf_mv))
        assert seen.name == "ALIGNMENT_DONE" and abs(seen.error_mdeg) < 1500, (degrees, seen.name, seen.error_mdeg)


@pytest.mark.parametrize("name", ["teknic", "maxon_ec22", "dys"])
@pytest.mark.parametrize("told", [0.2, 1, 5])
@pytest.mark.parametrize("inertia", [0.5, 1, 10, 100])
def test_with_any_inertia_that_is_told_wrongly(c, name, told, inertia):
    for degrees in (10, 100, 181, 300):
        seen = align(c, name, degrees, inertia, told)
        assert seen.name == "ALIGNMENT_DONE" and abs(seen.error_mdeg) < 3000, (degrees, seen.name, seen.error_mdeg)


@pytest.mark.parametrize("name", MOTORS)
@pytest.mark.parametrize("load", [dict(coulomb=0.2), dict(coulomb=0.5), dict(hoist=0.2), dict(hoist=-0.2), dict(hoist=0.5),
                                  dict(hoist=-0.5), dict(hoist=0.25, coulomb=0.25)])
@pytest.mark.parametrize("inertia, told", [(None, 1), (0.5, 1), (1, 0.2), (1, 5), (None, 0.2)])
def test_under_load_it_is_right_or_says_so(c, name, load, inertia, told):
    """Rotors that stick and slip: what the two currents say then does not agree, and the drive does not trust it."""
    done, right = 0, (inertia, told) == (None, 1)
    for degrees in range(0, 360, 45) if right else (0, 30, 150, 180, 240, 300):
        seen = align(c, name, degrees, inertia, told, **load)
        assert not right or seen.name in ("ALIGNMENT_DONE", "ALIGNMENT_LOAD", "ALIGNMENT_BLOCKED"), (degrees, seen.name)
        assert seen.name != "ALIGNMENT_DONE" or abs(seen.error_mdeg) < 3000, (degrees, seen.error_mdeg, list(seen.detail))
        done += seen.name == "ALIGNMENT_DONE"
    assert not right or done == 8 or abs(load.get("hoist", 0)) > 0.1, "friction alone hinders nobody"


@pytest.mark.parametrize("name", MOTORS)
@pytest.mark.parametrize("ratio, refused", ((1, 0), (5, 0), (30, 0.25)))
def test_a_load_on_a_coupling_is_not_shaken(c, name, ratio, refused):
    """Damping that comes a millisecond late drives what swings at hundreds of hertz; so does a current that follows the speed.
    A share of those with much load may be refused."""
    ends = []
    for hz in (60, 125, 220, 350, 530, 800):
        for degrees in (10, 130, 250):
            for backwards in (False, True):
                seen = align(c, name, degrees, inertia=1, coupling_hz=hz, load_gmm2=MOTORS[name][7] * ratio,
                             backwards=backwards)
                ends.append(seen.name)
                good = "ALIGNMENT_DIRECTION" if backwards else "ALIGNMENT_DONE"
                assert seen.name in (good, "ALIGNMENT_LOAD"), (hz, degrees, backwards, seen.name, list(seen.detail))
                assert seen.name != "ALIGNMENT_DONE" or abs(seen.error_mdeg) < 3000, (hz, degrees, seen.error_mdeg)
    assert ends.count("ALIGNMENT_LOAD") <= refused * len(ends)


@pytest.mark.parametrize("coulomb", (0, 0.02))
@pytest.mark.parametrize("name", MOTORS)
def test_what_is_wrong_is_named_before_the_rotor_is_fast(c, name, coulomb):
    """That is a twentieth of speed_max; fewer pole pairs pull it further in a step."""
    pairs, counts, speed_max = MOTORS[name][0], MOTORS[name][1], MOTORS[name][-1]
    paired, counted = ("ALIGNMENT_POLE_PAIRS",), ("ALIGNMENT_POLE_PAIRS", "ALIGNMENT_COUNTS")
    wrong = [(("ALIGNMENT_DIRECTION",), dict(backwards=True), None, None)]
    wrong += [(counted, dict(told=dict(encoder_counts=round(counts * factor))), 1, counts) for factor in (0.98, 1.02)]
    wrong += [(paired, dict(told=dict(pole_pairs=told)), 0, pairs)
              for told in {max(1, pairs - 1), pairs + 1, 2 * pairs} - {pairs}]
    for degrees in (5, 50, 95, 140, 185, 230, 275, 320):
        assert align(c, name, degrees, coulomb=0.05, dead=True).name == "ALIGNMENT_ENCODER_DEAD", degrees
        assert align(c, name, degrees, locked=True).name == "ALIGNMENT_BLOCKED", degrees
        for names, how, at, true in wrong:
            seen = align(c, name, degrees, coulomb=coulomb, **how)
            assert seen.name in names and (at is None or seen.detail[at] == true), (degrees, how, seen.name, list(seen.detail))
            assert seen.fastest_mrpm < 50 * speed_max or how.get("told", {}).get("pole_pairs", pairs) < pairs, (degrees, how)


@pytest.mark.parametrize("name", ("hoverboard", "dys"))
def test_one_pole_pair_told_is_no_dead_encoder(c, name):
    """The rotor turns by a fifteenth of what is expected, and less."""
    pairs = MOTORS[name][0]
    seen = align(c, name, 50, told=dict(pole_pairs=1))
    assert seen.name in ("ALIGNMENT_POLE_PAIRS", "ALIGNMENT_COUNTS") and seen.detail[0] == pairs, (seen.name, seen.detail)


# What the rotor's speed may reach where something is told or connected wrongly: a twentieth of speed_max.
# ---- the speed of the pull ----

def pulled(c, share, motor="teknic", v_d_q15=0, steps=100):
    """A struct pull_speed that has seen so much of the speed allowed, and the tuning."""
    tuning, speed, loop = c.tuning(), c.pull_speed(), c.current_loop()
    c.tuning_compute(params_of(c, motor), tuning)
    loop.v_d_q15 = v_d_q15
    for _ in range(steps):
        c.pull_speed_step(speed, loop, tuning, round(share * tuning.align_speed_q32))
    return speed, tuning


@pytest.mark.parametrize("way", [1, -1])
def test_the_current_fades_with_the_speed(c, way):
    for share, current in ((0, 1000), (0.4, 1000), (0.75, 500), (1.01, 0), (3, 0)):
        assert c.pull_speed_current_q15(*pulled(c, way * share), 1000) == pytest.approx(current, abs=20), share


def test_past_the_field_the_current_brakes(c):
    """The voltage that the magnets induce along the field is against it there; without speed that says nothing."""
    assert c.pull_speed_current_q15(*pulled(c, 1.5, v_d_q15=-400), 1000) == 1000
    assert c.pull_speed_current_q15(*pulled(c, 1.5, v_d_q15=400), 1000) == 0
    assert not pulled(c, 0.3, v_d_q15=-400)[0].brakes


def test_a_rotor_that_gains_speed_is_not_braked(c):
    speed, tuning = pulled(c, 1, v_d_q15=-400)
    loop = c.current_loop()
    for _ in range(20):
        c.pull_speed_step(speed, loop, tuning, 3 * tuning.align_speed_q32)
    assert not speed.brakes and c.pull_speed_current_q15(speed, tuning, 1000) == 0


def falls(c, way, last_share, steps=200):
    """Whether it falls once the speed has risen evenly to so much of what is allowed."""
    speed, tuning = pulled(c, 0)
    for step in range(steps):
        share = way * last_share * (step + 1) / steps
        c.pull_speed_step(speed, c.current_loop(), tuning, round(share * tuning.align_speed_q32))
    return c.pull_speed_falls(speed, tuning)


@pytest.mark.parametrize("way", [1, -1])
def test_a_load_makes_it_faster_than_a_field_does(c, way):
    assert not falls(c, way, 1.9)
    assert falls(c, way, 2.2)


@pytest.mark.parametrize("way", [1, -1])
def test_a_speed_that_the_pull_has_left_is_no_fall(c, way):
    assert not c.pull_speed_falls(*pulled(c, 3 * way))


def test_a_resistance_told_wrongly_is_no_braking(c):
    """Twice too large, half of R i is not there; that looks as if the magnets drove."""
    tuning, speed, loop = c.tuning(), c.pull_speed(), c.current_loop()
    c.tuning_compute(params_of(c, "hoverboard"), tuning)
    loop.i_d_q15 = tuning.align[0].i_q15
    loop.v_d_q15 = (loop.i_d_q15 * tuning.r_q12 >> 12) // 2
    for _ in range(100):
        c.pull_speed_step(speed, loop, tuning, round(0.7 * tuning.align_speed_q32))
        assert not speed.brakes


def test_a_resistance_that_cannot_be_overflows_nothing(c):
    tuning, speed, loop, sense = c.tuning(), c.pull_speed(), c.current_loop(), c.encoder_sense()
    c.tuning_compute(params_of(c, "teknic"), tuning)
    c.encoder_sense_start(sense)
    tuning.r_q12, loop.i_d_q15, loop.v_d_q15, loop.v_q_q15 = 32767, 32767, -19000, 19000
    for step in range(200):
        c.pull_speed_step(speed, loop, tuning, tuning.align_speed_q32)
        c.encoder_sense_step(sense, speed.e_d_q15, loop.v_q_q15, step << 25, step << 24, 1)
    assert speed.e_d_q15 == -32768


def test_a_field_that_moves_is_no_braking(c):
    speed, tuning = pulled(c, 1.5, v_d_q15=-400)
    assert speed.brakes
    c.pull_speed_field_moves(speed)
    assert c.pull_speed_current_q15(speed, tuning, 1000) == 0


def pulling(c, stage, motor="teknic"):
    """An alignment in a stage, all its current flowing, the rotor on the field; and the tuning."""
    tuning, loop, a = c.tuning(), c.current_loop(), c.alignment()
    c.tuning_compute(params_of(c, motor), tuning)
    c.current_loop_init(loop)
    c.current_loop_tune(loop, tuning)
    c.alignment_start(a, loop, tuning, 0)
    a.stage, a.current_q15, a.rotor.sense = stage, a.target_q15, 1
    return a, loop, tuning


def test_a_field_that_jumps_forgets_the_braking(c):
    a, _, tuning = pulling(c, c.STAGE_SECOND)
    a.speed.brakes, a.stage_ms = True, 1
    c.alignment_step_pull(a, tuning, 0)
    assert not a.speed.brakes


@pytest.mark.parametrize("stage, following", (("STAGE_PULL", "STAGE_SECOND"), ("STAGE_SECOND", "STAGE_PASS")))
def test_each_angle_is_left_when_the_rotor_rests_on_it(c, stage, following):
    """Settled, or after ten periods; twenty while nothing is known that could damp it. And not before the current flows."""
    def left_after_ms(quiet_ms, sense, share):
        a, _, tuning = pulling(c, c.enums["stage"][stage])
        period_ms = a.period_ms
        a.current_q15, a.rotor.sense = round(a.target_q15 * share), sense
        a.stage_ms = 8 + period_ms // 4  # behind the field's jump
        while a.stage == c.enums["stage"][stage] and a.stage_ms < 40 * period_ms:
            a.stage_ms += 1
            a.rotor.quiet_ms, ms = quiet_ms, a.stage_ms
            c.alignment_step_pull(a, tuning, 0)
        return ms, period_ms, a.stage == c.enums["stage"][following]

    ms, period_ms, left = left_after_ms(10**6, 1, 1)
    assert left and ms == 9 + period_ms // 4
    assert left_after_ms(0, 1, 1) == (10 * period_ms + 60, period_ms, True)
    assert left_after_ms(0, 0, 1) == (20 * period_ms + 60, period_ms, True)
    assert not left_after_ms(10**6, 1, 0.5)[2]


def test_a_rotor_that_falls_is_gripped_once_and_only_while_it_is_pulled(c):
    for stage, reluctant, gripped in (("PULL", 0, True), ("SECOND", 0, True), ("PASS", 0, False), ("PULL", 1, False)):
        a, _, tuning = pulling(c, c.enums["stage"]["STAGE_" + stage])
        tuning.reluctant = reluctant
        assert not c.alignment_check_external_drive(a, tuning) and not a.held_firmly
        a.speed.speed_q32, a.speed.let_go_q32, a.swing_ms = 3 * tuning.align_speed_q32, tuning.align_speed_q32, 5
        c.alignment_check_external_drive(a, tuning)
        most = tuning.align[tuning.align_levels - 1].i_q15
        assert (a.held_firmly, a.rotor.sense == 0, a.target_q15 == most, a.swing_ms == 0) == (gripped,) * 4, (stage, reluctant)
        a.swing_ms = 5
        c.alignment_check_external_drive(a, tuning)
        assert a.swing_ms == 5


def test_a_reluctant_rotor_that_never_stands_is_waited_for_two_seconds(c):
    a, loop, tuning = pulling(c, c.STAGE_PULL)
    tuning.reluctant = True
    c.alignment_start(a, loop, tuning, 0)
    results = [c.alignment_step(a, loop, tuning, ms % 2) for ms in range(1, 2003)]
    assert results.index(c.ALIGNMENT_LOAD) == 2000 and a.detail[0] == 180


@pytest.mark.parametrize("forth_deg, back_deg, told", (
    (-70, -70, True), (70, 70, True), (-47, -83, True),  # friction, either way of a mean of 65 degrees
    (-75, -84, True), (-75, -88, False), (-81, -82, False), (-74, -87, False), (81, 82, False)))
@pytest.mark.parametrize("offset_deg", (0, 130))
def test_friction_may_hold_a_reluctant_rotor_nearer_to_90_degrees_than_a_load(c, forth_deg, back_deg, told, offset_deg):
    """The mean of both ways tells which end of the axis is north: a load shifts it, friction does not."""
    a, loop, tuning = pulling(c, c.STAGE_AXIS)
    tuning.reluctant, a.turned, a.attempt, a.axis.angle = True, True, 1, 16
    a.axis.sums.re, a.axis.sums.im = (round(1e6 * of(math.radians(2 * offset_deg))) for of in (math.cos, math.sin))
    a.axis.sums.straight = 2 * 10**6
    a.first_offset_q32 = round(offset_deg / 360 * 2**32)
    a.load.forward_q32[0], a.load.back_q32[0] = (
        round((offset_deg + lead_deg) / 360 * 2**32) % 2**32 for lead_deg in (forth_deg, back_deg))
    result = c.alignment_step_axis(a, loop, tuning, 0)
    assert result == (c.ALIGNMENT_DONE if told else c.ALIGNMENT_LOAD)
    off_deg = (loop.angle_offset_q32 / 2**32 * 360 - offset_deg + 180) % 360 - 180
    assert abs(off_deg) < 0.1 if told else a.detail[0] == pytest.approx(max(abs(forth_deg), abs(back_deg)), abs=1)


def test_a_current_that_changes_is_no_braking(c):
    speed, tuning = pulled(c, 1.5)
    loop = c.current_loop()
    loop.v_d_q15 = -400
    for step in range(20):
        loop.i_d_q15 = tuning.align[0].i_q15 // 8 * ((step + 1) % 2)
        c.pull_speed_step(speed, loop, tuning, round(1.5 * tuning.align_speed_q32))
        assert not speed.brakes


def test_a_count_that_jumps_does_not_overflow(c):
    for moved in (2**31 - 1, -2**31):
        speed, tuning = pulled(c, 0)
        c.pull_speed_step(speed, c.current_loop(), tuning, moved)
        assert abs(speed.speed_q32) <= 2**29


USUAL_LINES = (100, 120, 125, 128, 180, 200, 250, 256, 300, 360, 400, 500, 512, 600, 625, 720, 800, 900, 1000, 1024, 1080,
               1200, 1250, 1440, 1500, 1600, 1800, 2000, 2048, 2250, 2400, 2500, 2880, 3000, 3600, 4000, 4096, 5000, 7200,
               8192, 10000)


@pytest.mark.parametrize("lines", USUAL_LINES)
def test_lines_that_makers_offer_are_named_exactly(named, lines):
    """The measurement is some thousandths off: what it means is the number that there is."""
    near = min(abs(other / lines - 1) for other in USUAL_LINES if other != lines)
    for error in (-0.006, -0.003, 0.003, 0.006):
        if abs(error) < near / 2:
            assert named(2, 4 * lines, 2, round(4 * lines * 1.37), error).encoder_counts == 4 * lines


@pytest.mark.parametrize("away", [2**31, 2**31 - 1, 2**31 + 1, 0, 1, 2**32 - 1, 2**30])
def test_a_lead_of_any_size_has_its_magnitude(c, away):
    """Half a turn is the largest, not none: a rotor that lies opposite to the field is not aligned."""
    solver = c.load_angle()
    solver.forward_q32[0] = away  # from an offset of 0
    assert c.load_angle_largest_q32(solver) == min(away, TURN - away)
