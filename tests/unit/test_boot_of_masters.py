# SPDX-License-Identifier: MIT
"""What masters write to a drive at boot, frame by frame: nothing is aborted, and each value is a parameter's other name.

The order is Lely's (CiA 302-2, booting a slave) as ros2_canopen uses it: identity, heartbeats, PDOs off, mapped and on, then
what `sdo:` of its bus.yml lists. Values are those of public files: ros2_canopen, canopen_tests/config/cia402/bus.yml
(2668f204) and .../robot_control/bus.yml (ea19eb67; its mode 7 is 8 here: docs/can.md), and of prbt in its user guide."""
import struct

import pytest

from rigs.can_node import NODE, Abort, Node

OFF = 0x80000000
STATUS, MODES = [0x60410010, 0x60610008], [0x60400010, 0x60600008]
BUS_YML = {
    "cia402": ([(0x60C2, 1, 50, 1), (0x60C2, 2, -3, 1), (0x6081, 0, 1000, 4), (0x6083, 0, 2000, 4)],
               [STATUS, [0x60640020, 0x606C0020], None, None], [MODES, [0x607A0020, 0x60FF0020]],
               {"cyclic_ms": 50, "profile_speed_pm": 250, "ramp_rpm_s": 2000}),
    "robot_control": ([(0x60C2, 1, 50, 1), (0x60C2, 2, -3, 1), (0x6081, 0, 1000, 4), (0x6083, 0, 2000, 4), (0x6060, 0, 8, 1)],
                      [STATUS, [0x60640020, 0x606C0020]], [MODES, [0x607A0020]], {"cyclic_ms": 50, "ramp_rpm_s": 2000}),
    "prbt": ([(0x6081, 0, 1000, 4), (0x60C2, 1, 10, 1), (0x6060, 0, 8, 1)], [STATUS, [0x60640020, 0x606C0020], None, None],
             [MODES, [0x607A0020]], {"cyclic_ms": 10, "profile_speed_pm": 250}),
}


def configure_pdo(node, at, cob, kind, mapping):
    if mapping is None:
        node.write(at, 1, OFF | cob, 4)
        return
    node.write(at, 1, OFF | cob, 4)
    node.write(at, 2, kind, 1)
    node.write(at + 0x200, 0, 0, 1)
    for sub, entry in enumerate(mapping, 1):
        node.write(at + 0x200, sub, entry, 4)
    node.write(at + 0x200, 0, len(mapping), 1)
    node.write(at, 1, cob, 4)


def boot(node, sdo, tpdo, rpdo):
    for index, sub in ((0x1000, 0), (0x1018, 1), (0x1018, 2), (0x1018, 3), (0x1018, 4)):
        node.value(index, sub)
    node.write(0x1016, 1, 1 << 16 | 1500, 4)
    node.write(0x1017, 0, 1000, 2)
    for number, mapping in enumerate(tpdo):
        configure_pdo(node, 0x1800 + number, 0x40000180 + 0x100 * number + NODE, 1, mapping)
    for number, mapping in enumerate(rpdo):
        configure_pdo(node, 0x1400 + number, 0x200 + 0x100 * number + NODE, 1, mapping)
    for row in sdo:
        node.write(*row)
    node.nmt(1)


@pytest.mark.parametrize("name", BUS_YML)
def test_a_public_bus_yml_is_taken_and_counts(c, name):
    sdo, tpdo, rpdo, params = BUS_YML[name]
    node = Node(c)
    for _ in range(2):  # a master that boots again finds nothing in its way
        boot(node, sdo, tpdo, rpdo)
        assert {param: getattr(node.axis.params, param) for param in params} == params
        for index, sub, value, size in sdo:
            assert node.value(index, sub) == value & 256 ** size - 1, hex(index)
        said = node.say((0x200 + NODE, struct.pack("<Hb", 6, 8)), (0x80, b""), (0x80, b""))
        assert {identifier for identifier, _ in said} >= {0x180 + NODE, 0x280 + NODE}
        assert (0x180 + NODE, struct.pack("<Hb", 0x0231, 8)) in said, "ready to switch on, mode 8"


@pytest.mark.parametrize("index, sub, value, size, name, becomes", [
    (0x6065, 0, 2000, 4, "following_mturn", 500), (0x6072, 0, 1200, 2, "i_max_ma", 8520),
    (0x6084, 0, 3000, 4, "ramp_rpm_s", 3000),
    (0x609A, 0, 700, 4, "ramp_rpm_s", 700), (0x6099, 1, 60, 4, "home_rpm", -60), (0x6099, 2, 45, 4, "home_rpm", -45),
    (0x6081, 0, 2000, 4, "profile_speed_pm", 500), (0x60C2, 1, 8, 1, "cyclic_ms", 8), (0x6098, 0, 35, 1, None, 35),
    (0x605A, 0, 2, 2, None, 2), (0x605D, 0, 1, 2, None, 1), (0x607D, 1, -2**31, 4, None, 2**31),
    (0x6085, 0, 10000, 4, None, 20000)])
def test_each_is_another_name_of_a_parameter(c, index, sub, value, size, name, becomes):
    node = Node(c)
    node.axis.params.home_rpm, node.axis.params.profile_rpm_s = -30, 900
    node.write(index, sub, value, size)
    if name:
        assert getattr(node.axis.params, name) == becomes and node.value(index, sub) == value
        assert node.axis.params.profile_rpm_s == (0 if name == "ramp_rpm_s" else 900)
    else:
        assert node.value(index, sub) == becomes


def test_a_cycle_by_its_exponent(c):
    node = Node(c)
    for value, exponent, cycle_ms in ((1, -2, 10), (2, -1, 200), (20, -3, 20)):
        node.write(0x60C2, 2, exponent, 1)
        node.write(0x60C2, 1, value, 1)
        assert node.axis.params.cyclic_ms == cycle_ms
        assert (node.value(0x60C2, 1), node.value(0x60C2, 2)) == (value, exponent & 255)


@pytest.mark.parametrize("code, index, sub, value, size", [
    (0x06090030, 0x605A, 0, 6, 2), (0x06090030, 0x607D, 2, 408240, 4), (0x06090031, 0x6085, 0, 20001, 4),
    (0x06090031, 0x6081, 0, 5000, 4), (0x06090032, 0x6065, 0, 0, 4), (0x06090031, 0x6083, 0, 2**32 - 1, 4),
    (0x06090030, 0x60C2, 2, -4, 1), (0x06090030, 0x60C2, 2, 1, 1), (0x06010002, 0x6099, 0, 2, 1),
    (0x06090011, 0x6099, 3, 2, 4)])
def test_what_it_cannot_do_is_aborted_and_changes_nothing(c, code, index, sub, value, size):
    node = Node(c)
    before = node.everything()
    with pytest.raises(Abort, match=f"^{code}$"):
        node.write(index, sub, value, size)
    assert node.everything() == before


def test_they_change_only_while_it_is_off(c):
    node = Node(c)
    node.axis.state = c.AXIS_OPERATION_ENABLED
    for index, value, size in ((0x6083, 100, 4), (0x6072, 900, 2)):
        with pytest.raises(Abort, match=f"^{0x08000022}$"):
            node.write(index, 0, value, size)


@pytest.mark.parametrize("source, modes", [(0, (1, 3, 4, 6, 8, 9, 10)), (1, (3, 4)), (2, (3, 4, 9, 10))])
def test_a_master_reads_the_modes_that_this_source_of_the_angle_allows(c, source, modes):
    node = Node(c)
    node.axis.tuning.angle_source = source
    assert node.value(0x6502, 0) == sum(1 << mode - 1 for mode in modes)
