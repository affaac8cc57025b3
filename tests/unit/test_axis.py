# SPDX-License-Identifier: MIT
"""One motor's drive, step by step: what starts it, what each state does to fabric and loops, and what a fault keeps."""
import ctypes
import tomllib
from pathlib import Path

import pytest

from rigs.drive import INDEX_SEEN, World


@pytest.fixture
def fresh(c):
    """An axis as it is after power-up: its registers take their values at once."""
    w = World(c)
    c.drive_init(w.axis, w.fabric)
    return w


def test_the_first_state_touches_no_register(c):
    axis, fabric = c.axis(), c.fabric()
    ctypes.memset(ctypes.addressof(fabric), 0xA5, ctypes.sizeof(fabric))
    c.drive_init(axis, fabric)
    assert bytes(fabric) == b"\xA5" * ctypes.sizeof(fabric)
    assert axis.state == c.AXIS_NOT_READY and axis.fabric_untrusted == 0xD0B7FABC and axis.faults.cause == c.FAULT_NONE
    assert axis.torque.map.torque_max_q15 in (0, axis.tuning.i_max_q15)  # built here, or at the first `on`
    assert axis.loop.encoder_scale_q32 == axis.tuning.encoder_scale_q32 == round(4 * 2**32 / 4000)
    assert axis.loop.status_max == 2**32 - 1 and axis.speed.kp_q16 == axis.tuning.speed_kp_q16 > 0
    assert axis.thermal.factor_q15 == 32768 and axis.thermal.max_q4 == 130 * 16
    assert axis.reactions.choice[c.FAULT_VOLTAGE_LIMIT] == c.REACTION_WARN


def test_the_speed_is_told_in_sixteenths(world):
    w = world("SWITCH_ON_DISABLED")
    for ms in range(1, 4):
        w.fabric.encoder.LATCHED = 50 * ms
        w.fabric.encoder.EDGE_TIME = w.fabric.encoder.LATCH_TIME = 100_000 * ms
        w.step()
    speed = w.axis.speed
    assert speed.speed_rpm_q4 == speed.estimate.speed_rpm_q15 >> 11 and abs(speed.speed_rpm_q4 - 750 * 16) <= 1


def test_start_brings_up_encoder_pwm_and_adc(c, fresh):
    w = fresh
    c.drive_start(w.axis, c.FAULT_NONE)
    assert (w.axis.state, w.axis.faults.cause, w.axis.fabric_untrusted) == (c.AXIS_SWITCH_ON_DISABLED, c.FAULT_NONE, 0)
    assert (w.fabric.encoder.COUNTS, w.fabric.encoder.CONTROL) == (4000, 1)
    assert w.fabric.pwm.PERIOD == 2500 and w.fabric.pwm.CONTROL == 1 and w.fabric.gate.CONTROL == 0
    assert w.fabric.adc.CONTROL == 3 and w.fabric.gate.CONTROL == 0


def registers(access):
    """{(block of struct fabric, register): reset value} by the contract, registers.toml."""
    contract = tomllib.loads(Path("drivers/fabric/registers.toml").read_text())
    named = {"PWM": "pwm", "ADC": "adc", "ENC": "encoder", "GATE": "gate"}
    return {(named[block["name"]], register["name"]): register["reset"]
            for block in contract["block"] for register in block["register"] if register["access"] == access}


def test_start_leaves_nothing_of_what_it_finds_in_the_fabric(c, fresh):
    """Each register holds ones; what the start does not set up is then as a reset leaves it, the rest as at a cold start."""
    cold, warm = fresh, World(c)
    for (block, register), value in registers("RW").items():
        setattr(getattr(cold.fabric, block), register, value)
        setattr(getattr(warm.fabric, block), register, 0xFFFFFFFF)
    for block, register in registers("RW1C"):
        setattr(getattr(warm.fabric, block), register, 0xFFFE0000)  # bits that none of them has
    c.drive_init(warm.axis, warm.fabric)
    warm.fabric.pwm.STATUS = cold.fabric.pwm.STATUS = 0
    for w in (cold, warm):
        c.drive_start(w.axis, c.FAULT_NONE)
    assert len(registers("RW")) > 25
    for block, register in registers("RW"):
        assert getattr(getattr(warm.fabric, block), register) == getattr(getattr(cold.fabric, block), register), register
    assert warm.fabric.gate.CONTROL == 0


@pytest.mark.parametrize("cause", ("WATCHDOG", "EXCEPTION", "STACK_GUARD"))
def test_start_with_a_fault_that_leaves_the_fabric_alone(c, fresh, cause):
    w = fresh
    c.drive_start(w.axis, c.enums["fault"]["FAULT_" + cause])
    assert w.axis.faults.cause == c.enums["fault"]["FAULT_" + cause] and w.fabric.adc.CONTROL == 3
    assert w.axis.state == c.AXIS_SWITCH_ON_DISABLED and w.step(3) == "FAULT"


@pytest.mark.parametrize("cause", ("CLOCK", "FABRIC"))
def test_start_with_a_fabric_in_doubt_writes_nothing(c, fresh, cause):
    w = fresh
    before = bytes(w.fabric)
    c.drive_start(w.axis, c.enums["fault"]["FAULT_" + cause])
    assert bytes(w.fabric) == before and w.axis.state == c.AXIS_FAULT and w.axis.fabric_untrusted == 0xD0B7FABC
    c.drive_step(w.axis)
    assert w.axis.time_ms == 1 and bytes(w.fabric) == before, "the clock goes on, and nothing else"


def test_each_step_ends_a_round_of_proofs_to_the_fabric(c, world):
    """The last word of it is seen; that both come, and in their order, the fabric of the twin sees."""
    w = world("SWITCH_ON_DISABLED")
    for next_word, proof in ((7, 0xA5E83C07), (0x107, 0xA5E83C07), (0xFF, 0xA5E83CFF)):
        w.fabric.gate.WATCH, w.fabric.gate.PROOF = next_word, 0
        c.drive_step(w.axis)
        assert w.fabric.gate.PROOF == proof, next_word


def test_the_snapshot_is_of_everything(c, world):
    w = world("OPERATION_ENABLED")
    adc, loop = w.fabric.adc, w.axis.loop
    adc.IA, adc.IB, adc.IC, adc.VBUS = -11, 22, -33, 14444
    loop.i_d_q15, loop.i_q_q15, loop.pll.angle_q32, loop.angle_offset_q32 = 55, -66, 0x70000000, 0x10000000
    w.axis.speed.speed_rpm_q4, w.axis.time_ms, w.axis.time_wraps = -777, 888, 1
    w.fabric.gate.STATUS = 0x81
    c.fault_raise_with(w.axis, c.FAULT_ENCODER_SLIP, 30, -40)
    s = w.axis.faults.snapshot
    assert (s.i_a_q15, s.i_b_q15, s.i_c_q15, s.vbus_q15, s.i_d_q15, s.i_q_q15) == (-11, 22, -33, 14444, 55, -66)
    assert (s.speed_rpm_q4, s.up_ms, s.angle_u16, s.gate_status) == (-777, 2**32 + 888, 0x8000, 0x81)
    assert s.state == c.AXIS_OPERATION_ENABLED and list(w.axis.faults.detail) == [30, -40]
    adc.IA = 99
    c.fault_raise_with(w.axis, c.FAULT_STALL, 1, 2)
    assert s.i_a_q15 == -11 and list(w.axis.faults.detail) == [30, -40], "the first one stays"


@pytest.mark.parametrize("cause, spoils", (("ENCODER", True), ("ENCODER_SLIP", True), ("ENCODER_DEAD", True),
                                           ("ENCODER_COUNTS", True), ("OVERCURRENT", False), ("STALL", False)))
def test_an_encoder_fault_makes_the_alignment_void(c, world, cause, spoils):
    w = world("OPERATION_ENABLED")
    w.axis.start.aligned, w.fabric.encoder.STATUS = True, INDEX_SEEN
    c.fault_raise(w.axis, c.enums["fault"]["FAULT_" + cause])
    w.step(2)
    assert w.axis.start.aligned != spoils and w.fabric.encoder.STATUS == (0 if spoils else INDEX_SEEN)


def running(w, speed_rpm=1000):
    w.axis.speed.ref_rpm_q16 = w.axis.speed.target_rpm_q16 = speed_rpm * 65536
    w.axis.loop.radius_q15 = 12000
    return w


def test_quick_stop_brakes_with_four_times_the_ramp(c, world):
    w = running(world("OPERATION_ENABLED"))
    assert c.drive_quick_stop(w.axis).error == c.ERROR_NONE
    assert w.step() == "QUICK_STOP" and w.axis.speed.target_rpm_q16 == 0
    w.axis.speed.at_limit = False
    before = w.axis.speed.ref_rpm_q16
    w.step()
    assert before - w.axis.speed.ref_rpm_q16 == 4 * w.axis.tuning.ramp_q16


@pytest.mark.parametrize("limited, ends_ms", ((False, 5000), (True, 7000)))
def test_quick_stop_ends_in_time(c, world, limited, ends_ms):
    """5 s without braking as hard as it may; and stop_max_ms whatever it does."""
    w = running(world("OPERATION_ENABLED"))
    w.axis.params.stop_max_ms = 7000
    c.drive_quick_stop(w.axis)
    if not limited:  # a speed loop that asks for nothing
        w.axis.speed.kp_q16 = w.axis.speed.ki_q16 = w.axis.tuning.speed_accel_q8 = w.axis.tuning.speed_ki_min_q16 = 0
    for ms in range(1, 8000):
        w.axis.speed.ref_rpm_q16 = 1000 * 65536
        c.supervision_begin(w.axis)
        if w.step() != "QUICK_STOP":
            break
    assert ms == ends_ms and w.state == "SWITCH_ON_DISABLED" and w.fabric.gate.CONTROL == 0


def turn(w, rpm, ms):
    for _ in range(ms):
        w.fabric.encoder.LATCH_TIME = w.fabric.encoder.EDGE_TIME = (w.fabric.encoder.LATCH_TIME + 100000) % 2**32
        w.fabric.encoder.LATCHED = (w.fabric.encoder.LATCHED + rpm * 4000 // 60000) % 4000
        w.step()


def test_a_quick_stop_out_of_torque_control_takes_up_speed_and_torque(c, world):
    w = world()
    turn(w, 600, 30)
    w.put("OPERATION_ENABLED")
    assert abs(w.axis.speed.speed_rpm_q4 - 600 * 16) <= 16
    w.axis.mode, w.axis.torque.torque_q15, w.axis.torque_command_q15 = c.AXIS_MODE_TORQUE, -2000, -2000
    w.axis.request = c.AXIS_REQUEST_QUICK_STOP
    w.axis.stopping_ms = w.axis.unlimited_braking_ms = 4000
    turn(w, 600, 1)
    assert w.state == "QUICK_STOP" and w.axis.mode == c.AXIS_MODE_SPEED and w.axis.stopping_ms <= 1
    assert abs(w.axis.speed.ref_rpm_q16 / 65536 - 600) < 25 and abs(w.axis.speed.integral_q29 / 2**14 + 2000) < 500


def test_it_stands_below_thirty_rpm_with_the_reference_at_zero(c, world):
    w = world("QUICK_STOP")
    w.axis.speed.ref_rpm_q16 = 0
    assert w.step() == "SWITCH_ON_DISABLED"
    assert w.axis.torque.torque_q15 == 0 and w.axis.torque.burn_q15 == 0


def test_operation_begins_at_rest_in_speed_control(c, world):
    w = world("SWITCHED_ON")
    w.axis.mode, w.axis.speed.target_rpm_q16, w.axis.command_ms = c.AXIS_MODE_TORQUE, 999, 0
    w.axis.speed.integral_q29, w.axis.supervision.speed.far_ms = 77777, 3
    w.axis.start.phase, w.axis.loop.source, w.axis.start.aligned = 3, c.LOOP_ENCODER, True
    assert w.step() == "OPERATION_ENABLED"
    assert w.axis.mode == c.AXIS_MODE_SPEED and w.axis.speed.target_rpm_q16 == 0 and w.axis.speed.integral_q29 == 0
    assert w.axis.command_ms == 0, "who is silent since before the start is silent for as long"
    assert w.axis.supervision.speed.deviation_q4 == 4000 * 16 // 5


def test_torque_control_asks_for_the_command_within_the_limits(c, world):
    w = running(world("OPERATION_ENABLED"), 0)
    c.torque_build(w.axis.torque, w.axis.params, w.axis.tuning, 16384)
    assert c.drive_command_current(w.axis, -3000).error == c.ERROR_NONE
    w.step()
    expected = -3000 * 32768 / w.axis.params.i_range_ma
    assert abs(w.axis.loop.i_q_ref_q15 - expected) <= 2 and w.axis.loop.i_d_ref_q15 == 0
    assert c.drive_command_speed(w.axis, 100).error == c.ERROR_NONE
    c.set_point_take(w.axis)
    assert w.axis.mode == c.AXIS_MODE_SPEED and w.axis.speed.integral_q29 == w.axis.torque.torque_q15 << 14


@pytest.mark.parametrize("vbus, rpm_q4, error", [
    (13670, 0, "NONE"), (10253, 0, "NONE"), (10252, 0, "BUS_LOW"), (20506, 0, "NONE"), (20507, 0, "BUS_HIGH"),
    (13670, 480, "NONE"), (13670, 481, "TURNING"), (13670, -481, "TURNING")])
def test_what_is_measured_forbids_on(c, world, vbus, rpm_q4, error):
    w = world()
    assert (w.axis.tuning.v_min_q15, w.axis.tuning.v_max_q15) == (10253, 20506)
    w.axis.loop.vbus_q15, w.axis.speed.speed_rpm_q4 = vbus, rpm_q4
    assert c.switch_on_at_once(w.axis).error == c.enums["error"]["ERROR_" + error]
    assert w.axis.request == (c.AXIS_REQUEST_ON if error == "NONE" else c.AXIS_REQUEST_NONE)


def test_on_adopts_the_parameters_and_nothing_before(c, world):
    w = world()
    w.axis.params.i_max_ma, w.axis.params.t_max_c, w.axis.params.speed_bw_hz = 8000, 100, 30
    w.step()
    before = w.axis.tuning.i_max_q15
    w.axis.start.aligned = True
    assert before == round(10650 * 32768 / 23571)
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE and w.axis.tuning.i_max_q15 == before
    w.step()
    assert w.axis.tuning.i_max_q15 == round(8000 * 32768 / 23571) == w.axis.torque.map.torque_max_q15
    assert w.axis.thermal.max_q4 == 1600 and w.axis.speed.kp_q16 == w.axis.tuning.speed_kp_q16
    assert w.axis.start.aligned, "the encoder is the same"


def test_another_encoder_makes_the_alignment_void(c, world):
    w = world()
    w.axis.start.aligned = w.axis.start.index_known = True
    w.axis.params.encoder_counts = 8000
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    w.step()
    assert not w.axis.start.aligned and not w.axis.start.index_known
    assert w.fabric.encoder.COUNTS == 8000
    assert w.axis.loop.encoder_scale_q32 == round(4 * 2**32 / 8000)


def test_what_clear_needs(c, world):
    w = world("FAULT")
    w.fabric.encoder.STATUS = 7  # an index, an illegal change, a lost signal
    w.fabric.gate.ID = 1
    assert c.drive_clear_fault(w.axis).error == c.ERROR_FABRIC
    w.fabric.gate.ID = 0x464F4332
    assert c.drive_clear_fault(w.axis).error == c.ERROR_NONE and w.axis.request == c.AXIS_REQUEST_CLEAR
    assert w.fabric.encoder.STATUS == 1, "latches whose causes are gone are cleared, and only those"
    assert w.step() == "SWITCH_ON_DISABLED"
    assert c.drive_clear_fault(w.axis).error == c.ERROR_NO_FAULT


def test_status_is_of_everything(c, world):
    w = world("OPERATION_ENABLED")
    loop, speed = w.axis.loop, w.axis.speed
    loop.i_d_q15, loop.i_q_q15, loop.i_d_ref_q15, loop.i_q_ref_q15, loop.vbus_q15 = 1, 2, 3, 4, 5
    speed.speed_rpm_q4, speed.speed_ref_rpm_q4, w.axis.time_ms = 6, 7, 8
    s = c.drive_status(w.axis)
    assert (s.i_d_q15, s.i_q_q15, s.i_d_ref_q15, s.i_q_ref_q15, s.vbus_q15, s.speed_rpm_q4, s.speed_ref_rpm_q4, s.up_ms) == (
        1, 2, 3, 4, 5, 6, 7, 8)
    assert (s.state, s.fault) == (c.AXIS_OPERATION_ENABLED, c.FAULT_NONE)


def test_the_heartbeat_is_not_listened_to_in_the_first_two_milliseconds(c):
    w = World(c)
    w.axis.time_ms = 0
    for ms in (1, 2, 3):
        c.drive_step(w.axis)
        assert (w.axis.faults.cause == c.FAULT_LOOP_STOPPED) == (ms == 3)


@pytest.mark.parametrize("identifies, most", ((None, 1), (False, 1), (True, 10)))
@pytest.mark.parametrize("way", (1, -1))
def test_the_heartbeat_bears_half_a_millisecond_while_the_other_axis_identifies(c, identifies, most, way):
    """And two milliseconds behind: its bursts hold up the slow loop of both."""
    other, w = World(c), World(c)
    if identifies is not None:
        w.axis.other_axis, other.axis.identify.running = ctypes.pointer(other.axis), identifies
    for off, late_ms, bears in ((most, 0, True), (most, 1, True), (most + 1, 0, False)):
        w.axis.faults.cause, other.axis.identify.running = 0, bool(identifies)
        w.step(3)
        for _ in range(late_ms):
            other.axis.identify.running = False
            w.step()
        w.fabric.adc.SEQUENCE += way * off
        w.step()
        assert (w.axis.faults.cause == 0) == bears and w.axis.faults.cause in (0, c.FAULT_LOOP_STOPPED)


def test_heat_lowers_the_limit_of_both_modes(c, world):
    for mode in (c.AXIS_MODE_SPEED, c.AXIS_MODE_TORQUE):
        w = running(world("OPERATION_ENABLED"), 0)
        c.torque_build(w.axis.torque, w.axis.params, w.axis.tuning, 16384)
        w.axis.mode, w.axis.thermal.factor_q15 = mode, 16384
        w.step()
        assert w.axis.torque.i_limit_q15 == w.axis.tuning.i_max_q15 // 2
        assert w.axis.torque.limits.high <= w.axis.tuning.i_max_q15 // 2 + 1


@pytest.mark.parametrize("update", (0, 1, 2))
def test_switching_on_tells_the_pwm_when_voltages_act(c, world, update):
    """While the gates are off. What it is set to already stays untouched."""
    w = world("SWITCH_ON_DISABLED")
    w.axis.params.pwm_update, pwm = update, w.fabric.pwm
    pwm.MODE, pwm.PERIOD, pwm.COUNT, pwm.PHASE, pwm.STATUS = 1, 2500, 1000, 77, 0
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    assert w.step() == "SWITCHED_ON" and w.fabric.gate.CONTROL == 0
    assert (pwm.MODE, pwm.PHASE, pwm.CONTROL) == ((1, 77, pwm.CONTROL) if update == 1 else (update, 1000, 1))
    assert w.axis.tuning.delay_halves == 3 - update


def test_switching_on_tells_the_pwm_how_often_to_sample(c, world):
    """Half a dead time behind the peak as well; and the heartbeat is given two milliseconds to become another."""
    w = world("SWITCH_ON_DISABLED")
    p, pwm = w.axis.params, w.fabric.pwm
    p.pwm_update, p.pwm_samples, p.low_side_shunts, pwm.MODE, pwm.DEAD = 2, 2, 0, 2, 100
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    assert w.step() == "SWITCHED_ON" and pwm.TRIGGER_2 == 50 | 1 << 17
    for conversions, cause in ((40, 0), (20, 0), (40, 0), (39, 0), (41, 0), (20, c.FAULT_LOOP_STOPPED)):
        w.fabric.adc.SEQUENCE += conversions - 20
        w.step()
        assert w.axis.faults.cause == cause
    w = world("SWITCH_ON_DISABLED")
    w.fabric.pwm.TRIGGER_2 = 50 | 1 << 17
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    assert w.step() == "SWITCHED_ON" and w.fabric.pwm.TRIGGER_2 == 0


def test_switching_on_chooses_where_currents_come_from(c, world):
    """Registers as docs/fabric.md has them; the trigger comes 1.5 OSR bits early, at 5 clocks a bit."""
    w = world("SWITCH_ON_DISABLED")
    p, pwm, adc = w.axis.params, w.fabric.pwm, w.fabric.adc
    p.low_side_shunts, pwm.DEAD, pwm.PERIOD, adc.CONTROL = 0, 100, 2500, 3
    for osr, setting, trigger in ((64, 0x511, 2500 - 430 | 1 << 17), (32, 0x510, 2500 - 190 | 1 << 17),
                                  (256, 0x513, 2500 - 1870 | 1 << 17), (0, 0x513, 2450 | 1 << 16)):
        p.modulator_osr = osr
        assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
        assert w.step() == "SWITCHED_ON"
        assert (adc.CONTROL, adc.MODULATOR, pwm.TRIGGER_1) == (0xB if osr else 3, setting, trigger)
        assert adc.MODULATOR_TRIP == w.axis.tuning.modulator_trip_q15 > w.axis.tuning.i_trip_q15
        assert c.drive_switch_off(w.axis).error == c.ERROR_NONE and w.step(2) == "SWITCH_ON_DISABLED"


@pytest.mark.parametrize("shunts, control, settle", ((1, 7, 20), (0, 3, 0)))
def test_switching_on_says_how_long_a_shunt_takes_to_settle(c, world, shunts, control, settle):
    """1.2 us, less the dead time: 20 clocks, and what has not settled is reconstructed. Sensors in line always see."""
    w = world("SWITCH_ON_DISABLED")
    w.axis.params.low_side_shunts, w.fabric.adc.CONTROL, w.fabric.adc.SETTLE = shunts, 3, 77
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    assert w.step() == "SWITCHED_ON" and (w.fabric.adc.CONTROL, w.fabric.adc.SETTLE) == (control, settle)


def test_a_pwm_that_takes_no_other_mode_is_a_fault(c, world):
    w = world("SWITCH_ON_DISABLED")
    w.axis.params.pwm_update, w.fabric.pwm.STATUS = 2, 1  # it goes on running
    assert c.switch_on_at_once(w.axis).error == c.ERROR_NONE
    w.step(3)
    assert w.axis.faults.cause == c.FAULT_FABRIC and w.fabric.gate.CONTROL == 0 and w.fabric.pwm.MODE == 0
