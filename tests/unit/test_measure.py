# SPDX-License-Identifier: MIT
"""What measurements are made of, and the script of identify: which step needs what, and what becomes of the rest."""
import ctypes
import math
import random

import pytest

from rigs.identify_alone import measuring, reason, result_of, thought

STEPS = ("PULSES", "HOLD", "RESISTANCE", "AXES", "INDUCTANCE", "TURN", "PUSH", "INDEX", "RAMPS", "SPEEDS", "ALONG", "ACROSS",
         "TORQUE")


PACE_MS = 16  # IDENTIFY_PACE_MS


# ---- primitives ----

@pytest.mark.parametrize("turn", (64, 4000, 8192, 65536))
def test_measure_counts_the_shorter_way_round(c, turn):
    for at in (0, 1, turn // 3, turn - 1):
        for moved in (0, 1, -1, turn // 2 - 1, 1 - turn // 2):
            assert c.measure_counts(at, (at + moved) % turn, turn) == moved


@pytest.mark.parametrize("v_q15", (0, 400, -400, 9000))
def test_measure_holds_a_voltage_in_a_frame_that_stands(c, v_q15):
    loop = c.current_loop()
    loop.vbus_q15, loop.field_speed_q32 = 16384, 77
    steps = c.measure_steps(loop, v_q15)
    assert steps == pytest.approx(v_q15 / 16384 * 40000, abs=abs(v_q15) / 100 + 1)
    c.measure_hold_voltage(loop, 0x12345678, steps, -5)
    assert (loop.integral_d_q9, loop.integral_q_q9) == (steps << 9, -5 << 9)
    assert (loop.field_angle_q32, loop.field_speed_q32) == (0x12345678, 0)


def test_measure_spin_says_when_the_reference_has_arrived_and_keeps_to_its_current(c, begun):
    io = measuring(c, begun, "SPEEDS")
    c.speed_loop_init(io.speed)
    c.speed_loop_tune(io.speed, begun.tuning)
    speed, loop, arrived = io.speed.contents, io.loop.contents, []
    io.tuning.contents.ramp_q16, loop.i_d_ref_q15 = 2 * 65536, 500
    for _ in range(30):
        arrived.append(c.measure_spin(io, 30, 700))
        speed.estimate.speed_rpm_q15, speed.speed_rpm_q4 = speed.ref_rpm_q16 // 2, speed.ref_rpm_q16 >> 12
    assert arrived == [False] * 14 + [True] * 16, "two rpm a millisecond, and once there it stays"
    assert loop.i_d_ref_q15 == 0 and 0 <= loop.i_q_ref_q15 <= 700
    speed.estimate.speed_rpm_q15, speed.speed_rpm_q4 = -300 * 32768, -300 * 16
    assert [c.measure_spin(io, 30, 40) for _ in range(50)] and loop.i_q_ref_q15 == 40, "one that lags gets all of it"


@pytest.mark.parametrize("axis_deg", range(0, 180, 13))
def test_measure_axes_finds_where_the_response_is_largest(c, axis_deg):
    """Whatever the size of the sums: they are narrowed to what an arctangent takes."""
    for size in (20, 1000, 10**6):
        s = c.measure_axes()
        for n in range(16):
            angle = n / 16 * math.pi
            y = size * (1 + 0.4 * math.cos(2 * (math.radians(axis_deg) - angle)))
            x = size * 0.4 * math.sin(2 * (math.radians(axis_deg) - angle))
            c.measure_axes_add(s, round(n / 32 * 2**32), round(y), round(x))
        off = c.measure_axes_angle_q32(s) / 2**32 * 360 - axis_deg
        assert abs((off + 90) % 180 - 90) < (3 if size == 20 else 0.1)


def test_measure_run_has_the_sums_of_its_samples(c, begun):
    io, rng, run, samples = measuring(c, begun, "RAMPS"), random.Random(5), c.measure_run(), []
    for _ in range(300):
        i, v, x = rng.randint(-9000, 9000), rng.randint(-9000, 9000), rng.randint(-2**24, 2**24)
        io.loop.contents.i_q_q15, io.speed.contents.estimate.speed_rpm_q15 = i, x
        c.measure_run_add(run, io, v)
        samples.append((i, v, x >> 6))
    assert run.count == 300 and (run.i, run.v, run.x) == tuple(map(sum, zip(*samples)))
    assert run.tx == sum(t * x for t, (_, _, x) in enumerate(samples))
    assert (run.xx, run.xv) == (sum(x * x for _, _, x in samples), sum(x * v for _, v, x in samples))


def test_a_thread_that_was_stopped_stops_thinking(c, begun):
    begun.evaluating, begun.running = True, False
    c.identify_evaluate(begun)
    assert not begun.evaluating


def test_the_next_step_begins_in_the_same_millisecond_however_long_the_thread_thinks(c, begun):
    io = measuring(c, begun, "RAMPS")

    def begins_ms(thinks_ms):
        begun.total_ms = begun.ms = 0
        begun.evaluating = begun.pausing = begun.retuned = True
        while begun.ms == 0:
            begun.evaluating = begun.total_ms < thinks_ms
            c.identify_step(begun, io)
            assert begun.ms == 0 or c.identify_takes_over(begun), "the take-over has come first"
            if begun.pausing:
                assert not c.identify_takes_over(begun) and io.loop.contents.i_q_ref_q15 == 0
        return begun.total_ms

    assert {begins_ms(thinks_ms) for thinks_ms in range(1, PACE_MS)} == {PACE_MS + 1}
    assert begins_ms(PACE_MS) == 2 * PACE_MS + 1


# ---- the script ----

def test_the_scripts_lines_are_the_steps_and_each_has_a_name(c):
    name = lambda step: ctypes.string_at(c.identify_step_name(step)).decode()
    assert [getattr(c, f"IDENTIFY_STEP_{step}") for step in STEPS] == list(range(1, 14))
    names = [name(step) for step in range(c.IDENTIFY_STEPS)]
    assert names[0] == "none" and names[-1] == "done" and len(set(names)) == 15 and name(99) == "unknown"


@pytest.mark.parametrize("step", STEPS)
def test_a_step_begins_with_nothing_of_the_one_before_it(c, begun, step):
    begun.work.map.at[3].run[1][1].xv = 5  # beyond what the others have
    begun.phase, begun.phase_ms, begun.ms, begun.reluctant = 3, 44, 55, True
    thought(c, begun, step)
    assert bytes(begun.work) == bytes(ctypes.sizeof(begun.work))
    assert (begun.phase, begun.phase_ms, begun.ms) == (0, 0, 0)


@pytest.mark.parametrize("reluctant", (False, True))
@pytest.mark.parametrize("step", STEPS)
def test_currents_are_regulated_but_for_pulses_and_what_would_turn_a_reluctant_rotor(c, begun, step, reluctant):
    begun.step, begun.reluctant = getattr(c, f"IDENTIFY_STEP_{step}"), reluctant
    at = ctypes.cast(c.identify_tuning(begun), ctypes.c_void_p).value
    regulated = at == ctypes.addressof(begun.tuning)
    assert regulated == (step != "PULSES" and not (step == "RESISTANCE" and reluctant))
    begun.evaluating = True
    assert ctypes.cast(c.identify_tuning(begun), ctypes.c_void_p).value != ctypes.addressof(begun.tuning)


def test_a_step_that_ends_it_names_itself_and_refuses_the_rest_for_its_reason(c, begun):
    for name in ("RESISTANCE", "DEAD_TIME", "LD", "LQ"):
        result_of(c, begun, name).state = c.IDENTIFY_KNOWN
    thought(c, begun, "TURN")
    assert begun.step == c.IDENTIFY_STEP_DONE and begun.stopped_in == c.IDENTIFY_STEP_TURN
    assert reason(c, begun, "LD") is None and reason(c, begun, "CROSS") == c.IDENTIFY_NOT_FOLLOWED


@pytest.mark.parametrize("step, first", (("ALONG", "LD_D2_BACK"), ("ACROSS", "LD_Q1"), ("TORQUE", "TORQUE_ID")))
def test_what_is_refused_already_is_neither_measured_nor_thought_about(c, begun, step, first):
    result = result_of(c, begun, first)
    result.state, result.reason = c.IDENTIFY_REFUSED, c.IDENTIFY_LOADED
    io = measuring(c, begun, step)
    c.speed_loop_init(io.speed)
    c.speed_loop_tune(io.speed, begun.tuning)
    assert any(c.identify_measure(begun, io) for _ in range(100)) and begun.work.map.points == 0
    thought(c, begun, step)
    assert begun.step == getattr(c, f"IDENTIFY_STEP_{step}") + 1 and reason(c, begun, first) == c.IDENTIFY_LOADED
