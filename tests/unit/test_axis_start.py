# SPDX-License-Identifier: MIT
"""The way from `on` to operation, one millisecond at a time: which step comes when, what ends it, what the index keeps."""
import ctypes
import itertools

import pytest

from rigs.drive import INDEX_SEEN, World
from rigs.starting import ALIGN, CALIBRATE, CALIBRATION_MS, CATCH, CONFIRM, FOLLOW, WIRING, show_wiring

ILLEGAL, SIGNAL_LOST = 2, 4


@pytest.fixture(params=(1, 2), ids=("first", "second"))
def starting(c, request):
    """An axis whose start has just begun: the first, or that behind one that was broken off."""
    def made(aligned):
        return World(c).switch_on(starts=request.param, aligned=aligned)
    return made


def test_an_aligned_drive_needs_the_zero_of_its_sensors(c, starting):
    w = starting(False)
    w.step(CALIBRATION_MS - 1)
    assert w.axis.start.phase == CALIBRATE and w.fabric.gate.CONTROL == 0
    w.axis.start.aligned = True  # in this start, as the twin writes it
    w.step()
    assert w.axis.start.phase == FOLLOW and w.fabric.gate.CONTROL == 1 and w.axis.loop.source == c.LOOP_ENCODER
    assert w.axis.loop.kp_d_q9 > 0
    assert w.step() == "OPERATION_ENABLED" and w.fault == "NONE"


def test_a_remembered_offset_is_held_against_the_rotor(c, starting):
    """One that nothing moves is not seen, and so not believed: it is aligned."""
    w = starting(True)
    w.step(CALIBRATION_MS)
    assert w.axis.start.phase == CONFIRM and w.axis.loop.source == c.LOOP_ENCODER and w.fabric.gate.CONTROL == 1
    w.step(20)
    assert w.axis.loop.i_d_ref_q15 < 0 and w.axis.loop.i_q_ref_q15 == 0
    check = w.axis.start.check
    check.step, check.holds, check.sense, check.ms, check.still_ms = 3, True, 0, 1000, 1000  # the last push, the other way
    w.step()
    assert w.axis.start.phase == WIRING
    assert not w.axis.start.aligned and not w.axis.start.remembered


@pytest.mark.parametrize("fault, forgets", [("OFFSET", True), ("STALL", True), ("SPEED_DEVIATION", True), ("OVERSPEED", True),
                                            ("ENCODER_SLIP", True), ("OVERVOLTAGE", False), ("STO_A", False)])
def test_what_a_fault_leaves_of_a_remembered_offset(c, starting, fault, forgets):
    w = starting(True)
    w.axis.start.index_known = True
    c.start_forget_after(w.axis, getattr(c, f"FAULT_{fault}"))
    assert (w.axis.start.aligned, w.axis.start.index_known) == (not forgets, not forgets)
    found = starting(False)
    found.axis.start.aligned = found.axis.start.index_known = True
    c.start_forget_after(found.axis, getattr(c, f"FAULT_{fault}"))
    assert found.axis.start.index_known == (fault != "OFFSET"), "what this start has found is not doubted"
    assert found.axis.start.aligned == (fault not in ("OFFSET", "ENCODER_SLIP"))


@pytest.mark.parametrize("lost", (ILLEGAL, SIGNAL_LOST))
def test_signals_lost_while_it_was_off_are_no_fault_but_it_is_aligned_anew(c, lost):
    w = World(c)
    w.axis.start.index_known, w.fabric.encoder.STATUS = True, lost | INDEX_SEEN
    w.switch_on(aligned=True).step(CALIBRATION_MS)
    assert w.fault == "NONE" and w.axis.start.phase == WIRING and not w.axis.start.aligned
    assert w.fabric.encoder.STATUS & (ILLEGAL | SIGNAL_LOST | INDEX_SEEN) == 0


@pytest.mark.parametrize("before", ("HALL", "OBSERVER", "INJECTION", "FORCED"))
@pytest.mark.parametrize("aligned", (False, True))
def test_counts_begin_where_the_encoder_stands_whoever_led_before(c, starting, aligned, before):
    w = starting(aligned)
    loop, w.fabric.encoder.LATCHED = w.axis.loop, 1000
    w.axis.start.latched = 1000
    loop.source, loop.pll.angle_q32, loop.pll.speed_q32 = getattr(c, f"LOOP_{before}"), 0x12345678, 1 << 24
    w.step(CALIBRATION_MS)
    assert loop.source == (c.LOOP_ENCODER if aligned else c.LOOP_FORCED)
    anew = (1000 * loop.encoder_scale_q32 & 0xFFFFFFFF, 0)
    assert (loop.pll.angle_q32, loop.pll.speed_q32) == (anew if before != "FORCED" else (0x12345678, 1 << 24))


def test_an_unaligned_one_prescribes_the_field_and_looks_at_its_wiring(c, starting):
    w = starting(False)
    w.step(CALIBRATION_MS)
    assert w.axis.start.phase == WIRING and w.axis.loop.source == c.LOOP_FORCED and w.fabric.gate.CONTROL == 1
    assert w.axis.loop.kp_d_q9 == w.axis.loop.ki_q15 == 0, "a voltage is held, no current"
    w.step(400)
    assert w.fault == "OPEN_PHASE" and w.axis.faults.detail[0] == 0 and w.fabric.gate.CONTROL == 0


def test_what_is_known_of_an_encoder_ends_with_it(c, starting):
    """Neither the offset nor the index's survives a change of angle_source: each way the start is a whole one."""
    w = starting(True)
    w.axis.start.index_known = True
    w.axis.loop.angle_offset_q32 = 0x11111111
    for source, loop, phase in ((1, c.LOOP_OBSERVER, CATCH), (0, c.LOOP_FORCED, WIRING)):
        assert c.drive_switch_off(w.axis).error == c.ERROR_NONE and w.step(2) == "SWITCH_ON_DISABLED"
        w.axis.params.angle_source = source
        w.fabric.encoder.STATUS = INDEX_SEEN
        assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
        assert w.step() == "SWITCHED_ON"
        w.step(CALIBRATION_MS)
        start = w.axis.start
        assert (start.phase, w.axis.loop.source) == (phase, loop) and not start.aligned and not start.index_known
        assert w.axis.loop.angle_offset_q32 == 0
        start.aligned = start.index_known = True  # so that the way back has something to forget


def test_gains_come_with_the_alignment(c, starting):
    w = starting(False)
    w.step(CALIBRATION_MS)
    assert c.start_tuning(w.axis).contents.kp_d_q12 == 0
    w.axis.start.phase = ALIGN
    assert c.start_tuning(w.axis).contents.kp_d_q12 == w.axis.tuning.kp_d_q12 > 0
    w.axis.start.phase, w.axis.state = WIRING, c.AXIS_OPERATION_ENABLED
    w.step()
    assert w.axis.loop.kp_d_q9 > 0, "a phase that is left does not hold a voltage"


@pytest.mark.parametrize("aligned, counts, fault", ((False, 6, "ROTOR_TURNING"), (False, -6, "ROTOR_TURNING"),
                                                    (False, 5, None), (True, 6, None)))
def test_a_rotor_whose_angle_is_unknown_must_stand(starting, aligned, counts, fault):
    """Two counts and a 1024th of a turn of 4000 are at rest; eight times may it be found turning."""
    w = starting(aligned)
    w.fabric.encoder.LATCHED = 3
    w.axis.start.latched = 3
    for _ in range(8):
        w.step(CALIBRATION_MS - 1)
        w.fabric.encoder.LATCHED = (w.fabric.encoder.LATCHED + counts) % 4000
        assert w.fault == "NONE"
        w.step()
        if not fault:
            break
    assert w.fault == (fault or "NONE")
    assert fault is None or list(w.axis.faults.detail) == [6, 4000]
    assert fault is not None or w.axis.start.phase == (CONFIRM if aligned else WIRING)


def test_a_sensor_whose_zero_is_off(starting):
    w = starting(True)
    w.fabric.adc.IB = 4000
    w.step(CALIBRATION_MS)
    assert w.fault == "CURRENT_OFFSET"


ORDERS = [order for order in itertools.permutations(range(3)) if order != (0, 1, 2)]


def judged(starting, turned=0, **shown):
    """What the test shows both times, the rotor so many counts away; a wrong sign or order is looked at again."""
    w = starting(False)
    w.step(CALIBRATION_MS)
    w.fabric.encoder.LATCHED = turned
    wiring = w.axis.start.wiring
    for patient in (False, True):
        if wiring.slow == patient:
            wiring.along, wiring.v_256ths, wiring.ms = 3, 0, 101
            show_wiring(wiring, w.axis.tuning.wiring_i_q15, **shown)
            w.step()
    return w.fault, w.axis.faults.detail[0]


def test_what_looks_wrong_once_is_looked_at_again(starting):
    for first in (dict(sensors=((1, 1), (0, 1), (2, 1))), dict(sensors=((0, 1), (1, -1), (2, 1)))):
        w = starting(False)
        w.step(CALIBRATION_MS)
        wiring = w.axis.start.wiring
        for shown in (first, {}):
            assert w.fault == "NONE" and w.axis.start.phase == WIRING
            wiring.along, wiring.v_256ths, wiring.ms = 3, 0, 101
            show_wiring(wiring, w.axis.tuning.wiring_i_q15, **shown)
            w.step()
        assert w.fault == "NONE" and w.axis.start.phase == ALIGN


# (the winding's saliency, the rotor's angle): resistance alone, and inductances up to three times as large across as along
WINDINGS = [(0.0, 0), *((saliency, angle) for saliency in (0.25, 0.5) for angle in range(0, 180, 15))]


@pytest.mark.parametrize("order", ORDERS)
def test_sensors_that_are_exchanged_are_named_with_their_order(starting, order):
    """Whatever the rotor's angle, and with a reversed sensor besides."""
    shown = int("".join(str(phase + 1) for phase in order))
    for saliency, angle in WINDINGS:
        for reversed_one in (None, 0, 1, 2):
            sensors = [(phase, -1 if sensor == reversed_one else 1) for sensor, phase in enumerate(order)]
            found = judged(starting, sensors=sensors, saliency=saliency, angle_deg=angle)
            assert found == ("SENSORS_EXCHANGED", shown), sensors


@pytest.mark.parametrize("wrong", range(3))
def test_other_causes_are_not_taken_for_exchanged_sensors(starting, wrong):
    """A sensor that is reversed, shows little, or shows a tenth more or less: at any angle of any rotor."""
    def with_gain(gain):
        return [(k, gain if k == wrong else 1) for k in range(3)]
    for saliency, angle in WINDINGS:
        rotor = dict(saliency=saliency, angle_deg=angle)
        assert judged(starting, sensors=with_gain(0.1), **rotor) == ("OPEN_PHASE", wrong + 1), rotor
        assert all(judged(starting, sensors=with_gain(gain), **rotor)[0] == "NONE" for gain in (0.9, 1.1)), rotor
        assert judged(starting, sensors=with_gain(-1), **rotor) == ("SENSOR_SIGN", wrong + 1), rotor


@pytest.mark.parametrize("turned, named", ((0, "SENSOR_SIGN"), (333, "SENSOR_SIGN"), (334, "LOAD_TOO_HIGH"),
                                           (4000 - 333, "SENSOR_SIGN"), (4000 - 334, "LOAD_TOO_HIGH")))
def test_what_the_wiring_looks_like_on_a_driven_rotor_is_the_loads(starting, turned, named):
    """Of 4000 counts and 4 pole pairs a third of an electrical turn: test currents do not do that."""
    assert judged(starting, sensors=((0, 1), (1, -1), (2, 1)), turned=turned)[0] == named


def test_gates_that_do_not_let_go_are_the_fabrics(c, starting):
    w = starting(True)
    w.step(CALIBRATION_MS - 1)
    w.fabric.adc.SEQUENCE += 20
    w.fabric.gate.STATUS = 1
    c.drive_step(w.axis)
    assert w.fault == "FABRIC"


@pytest.mark.parametrize("blind", (None, 2))
def test_a_good_wiring_leads_to_the_alignment_unless_a_sensor_shows_nothing_in_every_second_sample(starting, blind):
    w = starting(False)
    w.step(CALIBRATION_MS)
    wiring = w.axis.start.wiring
    wiring.along, wiring.ms = 3, 99
    if blind is not None:
        wiring.blind[blind] = True
    show_wiring(wiring, w.axis.tuning.wiring_i_q15)
    w.step()
    assert (w.axis.start.phase == ALIGN and w.fault == "NONE") if blind is None else (
        w.fault == "OPEN_PHASE" and w.axis.faults.detail[0] == blind + 1)


def test_the_second_sample_is_looked_at_before_it_is_trusted(c, starting):
    """Once, by a drive that is aligned, too; which keeps its alignment."""
    w = starting(True)
    assert c.drive_switch_off(w.axis).error == c.ERROR_NONE and w.step(2) == "SWITCH_ON_DISABLED"
    p = w.axis.params
    p.pwm_samples, p.pwm_update, p.low_side_shunts, w.fabric.pwm.MODE = 2, 2, 0, 2
    for phase in (WIRING, CONFIRM):
        assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
        w.fabric.adc.SEQUENCE += w.axis.loop.loops_per_slow - 20
        w.step()
        for _ in range(CALIBRATION_MS):
            w.fabric.adc.SEQUENCE += 20
            w.step()
        assert w.axis.start.phase == phase and w.axis.start.aligned and w.fault == "NONE"
        wiring = w.axis.start.wiring
        wiring.along, wiring.ms = 3, 99
        show_wiring(wiring, w.axis.tuning.wiring_i_q15)
        w.fabric.adc.SEQUENCE += 20
        w.step()
        assert w.axis.start.phase == CONFIRM and not w.axis.start.recheck_wiring
        assert c.drive_switch_off(w.axis).error == c.ERROR_NONE
        w.fabric.adc.SEQUENCE += 20
        w.step()


def test_the_index_is_learnt_once_by_an_aligned_drive(c, starting):
    """It is looked for in one of four milliseconds."""
    w = starting(True)
    scale = w.axis.loop.encoder_scale_q32
    w.axis.loop.angle_offset_q32 = 0x11111111
    w.step(4)
    assert not w.axis.start.index_known, "it has not been seen"
    w.fabric.encoder.STATUS, w.fabric.encoder.INDEX = INDEX_SEEN, 123
    w.step(4)
    assert w.axis.start.index_known and w.axis.start.index_offset_q32 == (0x11111111 + 123 * scale) % 2**32
    w.fabric.encoder.INDEX = 456
    w.step(4)
    assert w.axis.start.index_offset_q32 == (0x11111111 + 123 * scale) % 2**32
    unaligned = starting(False)
    unaligned.fabric.encoder.STATUS = INDEX_SEEN
    unaligned.step(4)
    assert not unaligned.axis.start.index_known


@pytest.mark.parametrize("seen, known, aligned", ((1, True, True), (0, True, False), (1, False, False)))
def test_the_offset_comes_back_with_the_index(c, seen, known, aligned):
    w = World(c)
    w.axis.start.index_known, w.axis.start.index_offset_q32 = known, 0x40000000
    w.fabric.encoder.STATUS, w.fabric.encoder.INDEX = INDEX_SEEN * seen, 50
    w.axis.loop.vbus_q15, w.axis.loop.angle_offset_q32 = 13670, 7
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    w.step()
    assert w.axis.start.aligned == aligned
    assert w.axis.loop.angle_offset_q32 == ((0x40000000 - 50 * w.axis.loop.encoder_scale_q32) % 2**32 if aligned else 7)


@pytest.mark.parametrize("result, fault", (
    ("ENCODER_DEAD", "ENCODER_DEAD"), ("DIRECTION", "ENCODER_DIRECTION"), ("POLE_PAIRS", "POLE_PAIRS"),
    ("COUNTS", "ENCODER_COUNTS"), ("BLOCKED", "ROTOR_BLOCKED"), ("LOAD", "LOAD_TOO_HIGH")))
def test_each_result_of_the_alignment_has_its_fault(c, result, fault):
    table = ctypes.cast(c.address_of_static("fault_of_alignment", "host_primask"), ctypes.POINTER(ctypes.c_uint32))
    assert table[c.enums["alignment_result"]["ALIGNMENT_" + result]] == c.enums["fault"]["FAULT_" + fault]
