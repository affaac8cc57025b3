# SPDX-License-Identifier: MIT
"""What the console says to each command, to the letter: each value at its place, with its unit, and each refusal."""
import ctypes
import re

import pytest

from rigs.console import SAID, VERSION


def test_the_greeting(operator):
    assert operator.greeting == (f"\r\n{VERSION}, 'help' lists the commands\r\n"
                                 "settings: none stored, initial values\r\n> ")


# ---- what outlives power-off -----------------------------------------------------------------------------------------

def off(operator):
    params = operator.axis.params  # the bench's ranges do not hold together with the rest
    operator.c.params_init(params)


def test_save_load_defaults(operator):
    off(operator)
    assert operator("load") == ["error: no settings are stored"]
    assert operator("get --changed") == []
    assert operator("set learn_rpm 77") == operator("set retry_count 3") == ["ok"]
    changed = ["set learn_rpm 77", "set retry_count 3"]
    assert operator("get --changed") == changed
    assert operator("save") == ["ok", "slot A, save 1; writes of its pages so far: about 1"]
    assert operator("defaults") == ["ok"] and operator("get --changed") == []
    assert operator("load") == ["settings: slot A, save 1, loaded"] and operator("get --changed") == changed
    assert operator("save")[1] == "slot B, save 2; writes of its pages so far: about 1"
    assert operator("save")[1] == "slot A, save 3; writes of its pages so far: about 2"


def test_the_start_says_what_was_found(operator, c):
    off(operator)
    operator("save")
    slots, kept = operator.slots, operator.kept
    assert c.drive_load(operator.axis, slots, kept).error == c.ERROR_NONE
    session = operator.console.session
    c.host_said_bytes.value = 0
    c.console_start(operator.console, session)
    assert operator.heard().split("\r\n")[2:-1] == ["settings: slot A, save 1, loaded"]


def test_load_says_what_is_wrong(operator, c):
    off(operator)
    operator("save")
    operator("save")
    raw = (ctypes.c_uint8 * 4096).from_address(ctypes.addressof(operator.c.host_bench.envm.array) + 0x3D000)
    raw[130] ^= 1
    assert operator("load") == [
        "settings: slot A, save 1, loaded",
        "warning: slot B is damaged, or its save was cut short; these may be the settings before it"]
    raw = (ctypes.c_uint8 * 4096).from_address(ctypes.addressof(operator.c.host_bench.envm.array) + 0x3C000)
    raw[130] ^= 1
    assert operator("load") == ["error: no settings are stored",
                                "warning: slot A is damaged, or its save was cut short",
                                "warning: slot B is damaged, or its save was cut short"]


def test_load_says_what_it_refuses(operator):
    from rigs.settings import PARAMETER, number, record, slot

    def store(*records):
        raw = slot(records, 7)
        ctypes.memmove(ctypes.addressof(operator.c.host_bench.envm.array) + 0x3C000, raw, len(raw))
    off(operator)
    store(record(PARAMETER, "learn_rpm", number(0)))
    assert operator("load") == ["settings: slot A, save 7",
                                "error: settings refused, nothing has changed: learn_rpm: a stored value is outside its range"]
    store(record(PARAMETER, "speed_bw_hz", number(200)))
    assert re.fullmatch(r"error: settings refused, nothing has changed: .*\d+.*", operator("load")[1])
    store(record(PARAMETER, "no_such_ma", number(0)), record(PARAMETER, "learn_rpm", number(9)))
    said = operator("load")
    assert said[0] == "settings: slot A, save 7, loaded" and said[1] == (
        "1 stored records are unknown to this firmware and were passed over, the first is no_such_ma")
    assert re.fullmatch(r"\d+ parameters are not stored and have their initial values", said[2]) and len(said) == 3


def test_not_while_the_bridge_is_on(operator, c):
    operator.axis.state = c.AXIS_OPERATION_ENABLED
    for line in ("load", "defaults"):
        assert operator(line) == ["error: parameters can change only while the drive is off"]
    assert operator("save") == ["error: settings are saved only while the drive is off: 'off' first"]


def fill(axis):
    """Every value another one."""
    loop, speed = axis.loop, axis.speed
    speed.speed_rpm_q4, speed.speed_ref_rpm_q4 = -24001, 16 * 1600 + 8
    loop.i_d_q15, loop.i_q_q15, loop.i_d_ref_q15, loop.i_q_ref_q15 = -101, 2002, -303, 4004
    loop.vbus_q15 = 12000
    axis.thermal.winding_q4, axis.thermal.factor_q15 = 16 * 83 + 15, 32768
    axis.time_ms, axis.time_wraps = 5017, 0


def test_status(operator, c):
    fill(operator.axis)
    operator.axis.state, operator.axis.faults.cause = c.AXIS_QUICK_STOP, c.FAULT_OVERTEMPERATURE
    operator.type(b"")  # announced
    assert operator("status") == [
        "state: quick stop active", "fault: over-temperature", "commanded by: nobody",
        "speed: -1500.062 rpm, reference 1600.500 rpm",
        "mode: pv (profile velocity), position: 0 counts",
        "current: d -0.101 A, q 2.002 A, reference d -0.303 A, q 4.004 A", "bus: 24.000 V, winding: 83 degC",
        "current loop: 217 cycles", "PWM update: at the valley", "watchdog: 32.212 s",
        "memory errors corrected: 0", "up: 5.017 s"]
    operator.axis.tuning.update, operator.axis.loop.fell_back = c.PWM_UPDATE_ENDS, 77
    operator.type(b"")
    assert operator("status")[8] == "PWM update: at both ends"
    operator.axis.tuning.update = c.PWM_UPDATE_ONCE
    waited = ", milliseconds in which one had to wait for the next end: 77"
    assert operator("status")[8] == "PWM update: at once" + waited
    operator.axis.tuning.samples = 2
    assert operator("status")[8] == "PWM update: at once, two samples a period" + waited


def test_status_of_a_hot_motor_that_was_warned_of(operator, c):
    operator.axis.thermal.factor_q15 = 32767
    assert ", current limit held to 99 %" in operator("status")[6]
    operator.axis.thermal.factor_q15 = 8192
    operator.axis.time_wraps = 1
    for cause in (c.FAULT_VOLTAGE_LIMIT, c.FAULT_LIMIT_CYCLE):
        c.fault_warn(operator.axis, cause)
    operator.type(b"")
    said = operator("status")
    assert said[6].endswith(" degC, current limit held to 25 %")
    assert said[7:9] == ["warning: voltage limit", "warning: limit cycle"] and said[-1] == "up: 4294967.296 s"


def test_fault(operator, c):
    axis = operator.axis
    axis.faults.cause, axis.faults.detail[0], axis.faults.detail[1] = c.FAULT_ENCODER_DEAD, -3, 1000
    snapshot = axis.faults.snapshot
    snapshot.up_ms, snapshot.state = 2**32 + 1, c.AXIS_OPERATION_ENABLED
    snapshot.i_a_q15, snapshot.i_b_q15, snapshot.i_c_q15 = 1001, -2002, 3003
    snapshot.i_d_q15, snapshot.i_q_q15, snapshot.vbus_q15 = -4004, 5005, 6000
    snapshot.speed_rpm_q4, snapshot.angle_u16, snapshot.gate_status = 24008, 49152, 0x89ABCDEF
    operator.type(b"")
    assert operator("fault") == [
        "fault: encoder dead", "found: -3 counts in an electrical turn, instead of 1000",
        "look at: the motor turned and no counts came: encoder cable, supply, coupling; or the shaft was held",
        "at: 4294967.297 s, state operation enabled",
        "phase currents: a 1.001 A, b -2.002 A, c 3.003 A; d -4.004 A, q 5.005 A",
        "bus: 12.000 V, speed: 1500.500 rpm, angle: 270 deg, gate status: 0x89abcdef"]
    axis.faults.cause = c.FAULT_STALL
    operator.type(b"")
    assert not any(line.startswith("found") for line in operator("fault")), "a stall has nothing to add"


def test_fault_of_a_fabric_in_doubt_has_no_values(operator, c):
    operator.axis.fabric_untrusted, operator.axis.faults.cause = 0xD0B7FABC, c.FAULT_FABRIC
    operator.type(b"")
    assert operator("fault") == ["fault: fabric", "look at: the FPGA does not carry the design of docs/fabric.md"]


def died(life):
    life.valid, life.exception, life.frame_valid, life.exc_return = True, 5, True, 0xFFFFFFF9
    for number, name in enumerate(("r0", "r1", "r2", "r3", "r12", "lr", "pc", "xpsr")):
        setattr(life.frame, name, 0x11111111 * (number + 1))
    life.cfsr, life.hfsr, life.mmfar, life.bfar, life.edac = 0xA0, 0xB1, 0xC2, 0xD3, 0xE4


def test_registers_of_the_last_life(operator):
    died(operator.last_run)
    assert operator("fault") == [
        "processor exception before the last reset: bus fault (5)", "  pc 0x77777777 lr 0x66666666 xpsr 0x88888888",
        "  r0 0x11111111 r1 0x22222222 r2 0x33333333 r3 0x44444444 r12 0x55555555",
        "  cfsr 0x000000a0 hfsr 0x000000b1 mmfar 0x000000c2 bfar 0x000000d3 exc_return 0xfffffff9 edac 0x000000e4",
        "fault: none"]
    operator.last_run.frame_valid = False
    assert operator("fault")[1] == "  no frame: the stack was not usable"


@pytest.mark.parametrize("number, name", [
    (2, "NMI"), (3, "hard fault"), (4, "memory fault"), (5, "bus fault"), (6, "usage fault"), (7, "unexpected interrupt"),
    (16 + 23, "the MSS PLL lost its lock"), (16 + 32, "the fabric's PLL lost its lock"),
    (16 + 29, "a memory error that cannot be corrected"), (16 + 30, "unexpected interrupt"),
    (16 + 8, "a block was put back into reset: traffic on FIC_0, or the design")])
def test_names_of_exceptions(operator, number, name):
    died(operator.last_run)
    operator.last_run.exception = number
    assert operator("fault")[0] == f"processor exception before the last reset: {name} ({number})"


@pytest.mark.parametrize("causes, said", [
    (0, []), (0xFF, []), (1, []), (2, ["System Controller"]), (4, ["System Controller"]), (8, ["software"]), (16, ["lock-up"]),
    (32, ["watchdog"]), (64, ["the design"]), (128, ["the design"]), (48, ["lock-up", "watchdog"]), (0x100, [])])
def test_what_reset_the_device(operator, causes, said):
    operator.last_run.reset_causes = causes
    assert operator("fault") == [f"last reset by: {cause}" for cause in said] + ["fault: none"]


@pytest.mark.parametrize("line, answer", [
    ("on", "error: the bus voltage is below v_min_mv, 18000 mV; see 'status'"), ("off", "ok"), ("version", SAID),
    ("quickstop", "error: the drive is not in operation; use 'on' and wait for it"), ("clear", "error: no fault is latched"),
    ("speed 100", "error: the drive is not in operation; use 'on' and wait for it"),
    ("torque 1", "error: the drive is not in operation; use 'on' and wait for it"),
    ("speed 1.5", "error: 1.5: not a whole number of rpm"), ("torque x", "error: x: not a current in amperes, like 1.5"),
    ("speed", "error: usage: speed RPM"), ("speed 1 2", "error: usage: speed RPM"), ("on now", "error: usage: on"),
    ("get", "error: usage: get PARAM"), ("set a", "error: usage: set PARAM VALUE"),
    ("set a 1 2", "error: usage: set PARAM VALUE"),
    ("set a 1 2 3 4", "error: usage: set PARAM VALUE"), ("bogus", "error: bogus: unknown command; 'help' lists them"),
    ("x" * 80, "error: " + "x" * 80 + ": unknown command; 'help' lists them"),
    ("speed 99999999999999999999", "error: 99999999999999999999: not a whole number of rpm"),
    ("speed --5", "error: --5: not a whole number of rpm"), ("torque -", "error: -: not a current in amperes, like 1.5"),
    ("torque 1.2345", "error: 1.2345: not a current in amperes, like 1.5"),
    ("set pole_pairs 0", "error: pole_pairs must be 1...50"), ("set pole_pairs 51", "error: pole_pairs must be 1...50"),
    ("set pole_pairs -2147483648", "error: -2147483648: not a whole number"), ("set ramp_rpm_s +5", "ok")])
def test_answers(operator, line, answer):
    assert operator(line) == [answer]


@pytest.mark.parametrize("setting, complaint", [
    ("i_max_ma 20000", "i_max_ma must be at most 85 % of i_trip_ma"), ("v_min_mv 50000", "v_min_mv must be below v_max_mv"),
    ("i_trip_ma 23000", "i_trip_ma must be at most 95 % of i_range_ma"), ("lq_uh 1000000", "current gain out of range"),
    ("speed_max_rpm 30000", "speed_max_rpm must be below overspeed_rpm"),
    ("v_min_mv 30000", "the bus voltage is below v_min_mv")])
def test_parameters_that_do_not_fit_together_keep_the_drive_off(operator, c, setting, complaint):
    axis = operator.axis
    axis.params.i_range_ma, axis.params.v_range_mv, axis.loop.vbus_q15 = 23571, 57528, 13670
    assert operator(f"set {setting}") == ["ok"] and operator("on")[0].startswith("error: " + complaint)
    assert axis.state == c.AXIS_SWITCH_ON_DISABLED and axis.request == c.AXIS_REQUEST_NONE


def test_what_works_is_passed_on(operator, c):
    axis = operator.axis
    axis.state = c.AXIS_OPERATION_ENABLED
    assert operator("speed -1234") == ["ok"] and axis.speed.target_rpm_q16 == -1234 * 65536
    assert operator("speed 4001") == ["error: beyond speed_max_rpm: at most 4000 rpm"]
    assert operator("torque -1.5") == ["ok"] and axis.mode == c.AXIS_MODE_TORQUE and axis.torque_command_q15 < 0
    assert operator("quickstop") == ["ok"] and axis.request == c.AXIS_REQUEST_QUICK_STOP
    axis.request, axis.state = c.AXIS_REQUEST_NONE, c.AXIS_SWITCH_ON_DISABLED
    axis.loop.vbus_q15 = 19000
    axis.params.i_range_ma, axis.params.v_range_mv = 23571, 57528
    assert operator("on") == ["ok", "phase margin of the current loop: 62 degrees"] and axis.request == c.AXIS_REQUEST_ON


@pytest.mark.parametrize("volt, warns", [(34.5, False), (34.6, True), (35.9, True)])
def test_on_warns_of_a_bus_within_four_percent_of_v_max(operator, volt, warns):
    axis = operator.axis
    axis.params.i_range_ma, axis.params.v_range_mv, axis.params.v_max_mv = 23571, 57528, 36000
    axis.loop.vbus_q15 = round(volt / 57.528 * 2**15)
    said = operator("on")
    assert said[0] == "ok" and len(said) == 2 + warns
    if warns:
        told = re.fullmatch(r"warning: bus at ([0-9.]+) V: the windings must burn what braking returns; "
                            r"v_max_mv (\d+) leaves room",
                            said[2])
        assert float(told[1]) == pytest.approx(volt, abs=2e-3) and int(told[2]) == pytest.approx(1050 * volt, abs=3)


def test_two_samples_a_period_where_every_second_one_is_for_nothing(operator):
    operator("set pwm_samples 2")
    blind = "error: pwm_samples 2 needs sensors in line with the phases: low_side_shunts see nothing at every second sample"
    assert operator("on") == [blind]
    operator("set low_side_shunts 0")
    unanswered = "error: pwm_samples 2 needs pwm_update 1 or 2: at the valley every second sample goes unanswered"
    assert operator("on") == [unanswered]
    operator("set pwm_update 2")
    operator("set current_bw_hz 6367")
    assert operator("on") == ["error: current_bw_hz leaves too little phase margin with this pwm_update: at most 6366"]
    assert operator("set pwm_samples 3") == ["error: pwm_samples must be 1...2"]


def test_help_has_a_line_for_each_command(operator):
    lines = operator("help")
    assert [line.split(":")[0] for line in lines] == [
        "help", "help TOPIC", "status", "on", "take", "identify", "identify show|use", "off", "quickstop", "speed RPM",
        "torque A", "pv RPM", "pp COUNTS", "pp by COUNTS", "hm index|block", "csp COUNTS", "csv RPM", "cst A",
        "learn cogging|hall", "zero", "fault", "clear", "angle encoder|observer|hall", "forget", "get PARAM",
        "set PARAM VALUE", "save", "load", "defaults",
        "reaction", "reaction FAULT off|stop|warn|carry", "machine on|off",
        "scope trigger SIGNAL above|below|rises|falls VALUE",
        "scope signals A,B,...|values A,B,...|every TICKS|before SAMPLES|trigger never",
        "scope list|arm|fire|off|read|fault", "scope",
        "stream MS BAUD", "sweep d|q|speed A", "sweep read|off", "sweep", "version"]
    assert all(len(line.split(": ", 1)[1]) > 5 for line in lines)


def test_blanks_and_empty_lines(operator):
    assert operator("   version  ") == [SAID] and operator("") == [] and operator("   ") == []
    assert operator("  get   pole_pairs ") == ["pole_pairs = 4  (1...50)"]


@pytest.mark.parametrize("end, count", ((b"\r", 1), (b"\n", 1), (b"\r\n", 1), (b"\n\r", 2), (b"\n\n", 2), (b"\r\r", 2)))
def test_ends_of_lines(operator, end, count):
    assert operator.type(end).count("> ") == count
    assert operator.type(b"version" + end).count(VERSION) == 1


def test_lines_that_are_not_carried_out(operator, c):
    ok, long = "version" + " " * 73, "version" + " " * 74
    assert len(ok) == 80 and "mssfoc" in operator.type(ok.encode() + b"\r")
    assert operator.type(long.encode() + b"\r").endswith("error: line longer than 80 characters; ignored\r\n> ")
    for odd in (b"\x1f", b"\x00"):
        assert operator.type(odd + b"version\r").endswith("error: line with unprintable characters; ignored\r\n> ")
    operator.console.incomplete = True
    assert operator.type(b"version\r").endswith("error: characters were lost; line ignored\r\n> ")
    assert "mssfoc" in operator.type(b"version\r"), "the next line is another"


def test_lost_output_is_said(operator):
    operator.console.session.out.lost = True
    assert operator.type(b"\r") == "\r\n(output was lost: the line did not take it)\r\n> "
    assert operator.type(b"\r") == "\r\n> "


def test_a_fault_is_announced_once_and_the_line_stays(operator, c):
    operator.type(b"stat")
    operator.axis.faults.cause = c.FAULT_STALL
    assert operator.type(b"") == "\r\nfault: stall; see 'fault', then 'clear'\r\n> stat"
    assert operator.type(b"") == ""
    operator.axis.faults.cause = c.FAULT_NONE
    assert operator.type(b"") == ""
    operator.axis.faults.cause = c.FAULT_STALL
    assert operator.type(b"").count("stall") == 1, "it has come again"


def test_warnings_are_announced_once_each(operator, c):
    for cause in (c.FAULT_VOLTAGE_LIMIT, c.FAULT_LIMIT_CYCLE):
        c.fault_warn(operator.axis, cause)
    assert operator.type(b"") == "\r\nwarning: voltage limit\r\n> \r\nwarning: limit cycle\r\n> "
    c.fault_warn(operator.axis, c.FAULT_STALL)
    assert operator.type(b"") == "\r\nwarning: stall\r\n> "
    c.fault_clear_warnings(operator.axis.reports)
    assert operator.type(b"") == ""
    c.fault_warn(operator.axis, c.FAULT_VOLTAGE_LIMIT)
    assert operator.type(b"") == "\r\nwarning: voltage limit\r\n> "


def test_a_line_is_heard_by_the_supervision(operator):
    operator.axis.time_ms, operator.axis.command_ms = 777, 0
    operator.type(b"versio")
    assert operator.axis.command_ms == 0
    operator.type(b"n\r")
    assert operator.axis.command_ms == 777


# ---- identify ----

def test_identify_says_what_it_found_and_what_not(c, operator):
    assert operator("identify show") == ["identify has not run"]
    assert operator("identify bogus") == ["error: bogus: not one of show, use"]
    d = operator.axis.identify
    d.step = d.stopped_in = c.IDENTIFY_STEP_DONE
    d.total_ms = 5774
    for name, value, interval in (("RESISTANCE", 286512, 4568), ("DEAD_TIME", 10443, 72), ("LD", 150600, 2680)):
        result = d.results[getattr(c, f"IDENTIFY_{name}")]
        result.state, result.value, result.interval = c.IDENTIFY_KNOWN, value, interval
    d.results[c.IDENTIFY_LQ].state, d.results[c.IDENTIFY_LQ].reason = c.IDENTIFY_REFUSED, c.IDENTIFY_NO_CURRENT
    turning = (("POLE_PAIRS", 8, 0), ("COUNTS", 8192, 0), ("DIRECTION", -1, 0), ("OFFSET", 19669, 70), ("FLUX", 28353, 246),
               ("INERTIA", 77007, 1542), ("COULOMB", 2515, 228), ("LD_D2_BACK", 148900, 3000), ("LQ_Q3", 140100, 5000),
               ("TORQUE_ID", -12894, 0), ("TORQUE_FLUX", 850000, 10000), ("CROSS", -109, 6))
    for name, reason in (("LD_D1", "TURNED"), ("TORQUE_ACROSS", "NOT_SALIENT")):
        result = d.results[getattr(c, f"IDENTIFY_{name}")]
        result.state, result.reason = c.IDENTIFY_REFUSED, getattr(c, f"IDENTIFY_{reason}")
    for name, value, interval in turning:
        result = d.results[getattr(c, f"IDENTIFY_{name}")]
        result.state, result.value, result.interval = c.IDENTIFY_KNOWN, value, interval
    assert operator("identify show") == [
        "resistance: 286.512 +-4.568 mohm", "dead time: 1044.300 +-7.200 ns", "ld: 150.600 +-2.680 uH",
        "lq: refused: next to no current answers the voltage: motor cable, i_rated_ma, i_range_ma",
        "pole pairs: 8, exactly", "encoder counts: 8192, exactly", "encoder direction: -1, exactly",
        "offset: 196.690 +-0.700 degrees, electrical, at the index", "flux: 2835.300 +-24.600 uWb",
        "inertia: 77.007 +-1.542 kgmm2", "friction: 2.515 +-0.228 mNm", "viscous friction: not measured yet",
        "ld at -1 of rated current in d: 148.900 +-3.000 uH", "ld at -1/2 in d: not measured yet",
        "ld at 1/2 in d: refused: reluctance turns the rotor whenever the current changes",
        "ld at 1 in d: not measured yet", "ld at 1/3 of rated current in q: not measured yet",
        "ld at 2/3 in q: not measured yet", "ld at 1 in q: not measured yet", "lq at 1/3 in q: not measured yet",
        "lq at 2/3 in q: not measured yet", "lq at 1 in q: 140.100 +-5.000 uH",
        "rated current in d for most torque, in mA: -12894, exactly",
        "and in q, in mA: not measured yet", "flux in d there: 85000.000 +-1000.000 uWb",
        "flux in q there: refused: no current in d, or little, makes most torque: the magnets make nearly all of it",
        "ldq by lqq there, in thousandths: -109.000 +-6.000", "time: 5.774 s"]
    assert operator("identify use") == ["ok", "7 parameters changed; 'get all' lists them, 'on' takes them"]
    assert operator("get resistance_mohm") == ["resistance_mohm = 287 mohm  (1...100000)"]
    assert operator("get lq_uh") == ["lq_uh = 200 uH  (1...1000000)"], "refused is not taken"


def test_identify_names_the_step_in_which_it_ended(c, operator):
    d = operator.axis.identify
    d.step = d.stopped_in = c.IDENTIFY_STEP_RESISTANCE
    assert operator("identify show")[0] == "ended in step 'resistance'"
    d.fault = c.FAULT_OVERCURRENT
    assert operator("identify show")[0] == "ended in step 'resistance' by a fault: over-current"
    d.running = True
    assert "identify: step 'resistance'" in operator("status")
