# SPDX-License-Identifier: MIT
"""The console's set-points: what each command answers, and that the axis has been told just that."""
import pytest

from rigs.console import Operator

PERIOD = 10 * 20  # conversions in cyclic_ms


class Driver(Operator):
    """Somebody at the console of a drive in operation: speed up to 4000 rpm, 10.65 A, 4000 counts, a set-point each 10 ms."""

    def __init__(self, c):
        super().__init__(c)
        axis = self.axis
        c.params_init(axis.params)
        c.tuning_compute(axis.params, axis.tuning)
        c.torque_build(axis.torque, axis.params, axis.tuning, 14000)
        c.speed_loop_tune(axis.speed, axis.tuning)
        axis.state = c.AXIS_OPERATION_ENABLED

    def torque_of(self, milliamp):
        """Of a motor without reluctance: as the tuning counts torque, the current that makes it."""
        return pytest.approx(milliamp * 32768 / self.axis.params.i_range_ma, abs=2)


@pytest.fixture
def driver(c):
    return Driver(c)


def test_commands_motion_in_steps_and_by_profile(driver):
    axis, motion = driver.axis, driver.axis.motion
    motion.turns.counts, unit = 500, 1 << driver.axis.tuning.profile.shift
    for line in ("pv -300", "speed 250"):
        assert driver(line) == ["ok"] and driver.mode == "SPEED"
        assert axis.speed.target_rpm_q16 == int(line.split()[1]) * 65536
    for amperes, milliamp in (("1.5", 1500), ("-10.65", -10650)):
        assert driver(f"torque {amperes}") == ["ok"] and driver.mode == "TORQUE"
        assert axis.torque_command_q15 == driver.torque_of(milliamp)
    assert driver("pp -1234") == ["ok"] and driver.mode == "POSITION" and motion.profile.target // unit == -1234
    assert driver("pp by 34") == ["ok"] and motion.profile.target // unit == -1200, "from the last target"
    assert driver("pp by -300") == ["ok"] and motion.profile.target // unit == -1500
    assert driver("speed 0") == ["ok"] and driver("pp by 7") == ["ok"]
    assert motion.profile.target // unit == 507, "from where the shaft is"


def test_commands_motion_cyclic(driver):
    axis, cyclic = driver.axis, driver.axis.motion.cyclic
    axis.motion.turns.counts, unit = 500, 1 << axis.tuning.profile.shift
    for rpm in (200, -4000):
        assert driver(f"csv {rpm}") == ["ok"] and driver.mode == "CYCLIC_SPEED"
        assert (cyclic.target, cyclic.left) == (rpm * 65536, PERIOD)
    for amperes, milliamp in (("-1.5", -1500), ("10.65", 10650)):
        assert driver(f"cst {amperes}") == ["ok"] and driver.mode == "CYCLIC_TORQUE"
        assert (cyclic.target / 65536, cyclic.left) == (driver.torque_of(milliamp), PERIOD)
    assert driver("csp 510") == ["ok"] and driver.mode == "CYCLIC_POSITION"
    assert (cyclic.target // unit, cyclic.left) == (510, PERIOD)


def test_commands_motion_that_search_and_learn(driver, c):
    motion = driver.axis.motion
    for word in ("index", "block"):
        motion.homed = True
        assert driver(f"hm {word}") == ["ok"] and driver.mode == "HOMING" and not motion.homed
        assert motion.homing.method == c.enums["homing_method"][f"HOMING_{word.upper()}"]
        assert driver.axis.speed.target_rpm_q16 == 30 * 65536
    assert driver("zero") == ["error: the drive is homing; wait for its end"]
    assert driver("learn cogging") == ["ok"] and driver.mode == "LEARNING"
    assert driver("speed 0") == ["ok"]
    motion.turns.counts = 777
    assert driver("zero") == ["ok"] and motion.turns.counts == 0


@pytest.mark.parametrize("line, answer", [
    ("pv 4001", "beyond speed_max_rpm: at most 4000 rpm"), ("csv -4001", "beyond speed_max_rpm: at most 4000 rpm"),
    ("cst 10.651", "beyond i_max_ma: at most 10650 mA"),
    ("torque -10.651", "beyond i_max_ma: at most 10650 mA"),
    ("csp 3167", "farther than speed_max_rpm goes in cyclic_ms: at most 2666 counts from the one before"),
    ("pv 1.5", "1.5: not a whole number of rpm"),
    ("csv x", "x: not a whole number of rpm"), ("cst x", "x: not a current in amperes, like 1.5"),
    ("torque 1.2345", "1.2345: not a current in amperes, like 1.5"), ("pp x", "x: not a whole number of counts"),
    ("pp by 1.5", "1.5: not a whole number of counts"), ("pp to 5", "to: not 'by'"),
    ("csp 99999999999", "99999999999: not a whole number of counts"), ("hm here", "here: not one of index, block"),
    ("learn friction", "friction: not one of cogging, hall"),
    ("angle resolver", "resolver: not one of encoder, observer, hall")])
def test_commands_motion_refused_change_nothing(driver, line, answer):
    driver.axis.motion.turns.counts = 500
    before = bytes(driver.axis)
    assert driver(line) == [f"error: {answer}"] and bytes(driver.axis) == before
