# SPDX-License-Identifier: MIT
"""A master on the bus of a running drive: python `canopen`, unmodified.  canopen_client.py CASE PORT EDS

Runs in the environment that has canopen (client_venv.py). Each case ends with the drive off and says `done`.
"""
import math
import struct
import sys
import time

import canopen
from canopen.lss import LssError
from canopen.profiles.p402 import BaseNode402
from canopen.sdo import SdoClient

NODE, PATIENCE_S = 5, 20
TEXTS = (canopen.objectdictionary.VISIBLE_STRING, canopen.objectdictionary.DOMAIN)


def until(what, told, patience_s=PATIENCE_S):
    end_s = time.monotonic() + patience_s
    while not what():
        assert time.monotonic() < end_s, f"never: {told}"
        time.sleep(0.02)


def aborts(code, action, *args):
    try:
        action(*args)
    except canopen.SdoAbortedError as error:
        assert error.code == code, f"{error}, not {code:#010x}"
        return
    raise AssertionError(f"not refused with {code:#010x}")


def refused(action, *args):
    """By layer setting."""
    try:
        action(*args)
    except LssError as error:
        return str(error)
    raise AssertionError("not refused")


def case_management(network, node):
    """NMT, boot-up, heartbeat, guarding of states."""
    node.nmt.wait_for_heartbeat(timeout=PATIENCE_S)
    for state in ("OPERATIONAL", "STOPPED", "PRE-OPERATIONAL", "OPERATIONAL"):
        node.nmt.state = state
        until(lambda: node.nmt.wait_for_heartbeat(timeout=PATIENCE_S) == state, state)
    for command in ("RESET", "RESET COMMUNICATION"):
        node.nmt.state = command
        node.nmt.wait_for_bootup(timeout=PATIENCE_S)
        until(lambda: node.nmt.wait_for_heartbeat(timeout=PATIENCE_S) == "PRE-OPERATIONAL", "pre-operational")
    node.sdo["Producer heartbeat time"].raw = 50
    beats = []
    network.subscribe(0x700 + NODE, lambda _, data, stamp: beats.append(stamp))
    until(lambda: len(beats) > 10, "ten heartbeats")
    spans = [late - early for early, late in zip(beats, beats[1:])]
    assert 0.048 < min(spans) and max(spans) < 0.056, spans  # by the twin's clock
    node.nmt.state = "STOPPED"
    until(lambda: node.nmt.wait_for_heartbeat(timeout=PATIENCE_S) == "STOPPED", "stopped")
    try:
        node.sdo.upload(0x1000, 0)
    except canopen.SdoCommunicationError:
        pass
    else:
        raise AssertionError("a stopped node answers SDO")
    node.nmt.state = "RESET"
    node.nmt.wait_for_bootup(timeout=PATIENCE_S)


def case_dictionary(_, node):
    """SDO expedited and segmented, every object of the EDS, and the standard's abort codes."""
    node.nmt.wait_for_heartbeat(timeout=PATIENCE_S)
    node.sdo.RESPONSE_TIMEOUT = PATIENCE_S  # of each frame, and there are thousands
    assert node.sdo[0x1008].raw == "mssfoc" and len(node.sdo[0x1009].raw) > 4
    for index, entry in node.object_dictionary.items():
        members = [entry] if isinstance(entry, canopen.objectdictionary.ODVariable) else entry.values()
        for member in members:
            value = node.sdo.upload(index, member.subindex)
            assert member.data_type in TEXTS or 8 * len(value) == len(member), (hex(index), member.subindex, value)
    parameter = node.sdo["speed_bw_hz"]
    before = parameter.raw
    parameter.raw = before + 1
    assert parameter.raw == before + 1
    parameter.raw = before
    index = parameter.od.index
    node.sdo.download(index, 0, struct.pack("<i", before), force_segment=True)
    aborts(0x06090031, node.sdo.download, index, 0, struct.pack("<i", 100000))
    aborts(0x06090032, node.sdo.download, index, 0, struct.pack("<i", 0))
    aborts(0x06070013, node.sdo.download, index, 0, b"\1\0")
    aborts(0x06070012, node.sdo.download, 0x6040, 0, bytes(4))
    aborts(0x06010002, node.sdo.download, 0x6041, 0, bytes(2))
    aborts(0x06010002, node.sdo.download, 0x1008, 0, b"other name")
    aborts(0x06020000, node.sdo.upload, 0x5000, 0)
    aborts(0x06090011, node.sdo.upload, 0x1018, 9)
    aborts(0x06090030, node.sdo.download, 0x6060, 0, b"\2")
    aborts(0x08000020, node.sdo.download, 0x1010, 1, b"evas")
    aborts(0x06010000, node.sdo.download, 0x1600, 0, b"\1")
    assert node.sdo[0x1010][1].raw & 1


def case_data_sheet(network, node):
    """The drive's own EDS, read as canopen itself reads it, is the one that `make eds` writes."""
    SdoClient.RESPONSE_TIMEOUT = PATIENCE_S  # of each segment; the machine may be loaded
    with open(sys.argv[3], encoding="ascii") as file:
        written = file.read()
    node.nmt.wait_for_heartbeat(timeout=PATIENCE_S)
    node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
    with node.sdo.open(0x1021, 0, "rb") as begun:  # and left alone
        assert begun.read(70) == written[:70].encode()
    assert node.sdo[0x1022].raw == 0 and node.sdo.upload(0x1021, 0) == written.encode()
    del network[NODE]
    own = network.add_node(NODE, upload_eds=True).object_dictionary
    assert {(index, entry.name) for index, entry in own.items()} == {
        (index, entry.name) for index, entry in node.object_dictionary.items()} and len(own) > 100


def case_layer_setting(network, node):
    """LSS: the node is found without a number, gets one, keeps it, and has its first one again in the end."""
    lss, other = network.lss, 9
    lss.RESPONSE_TIMEOUT = node.sdo.RESPONSE_TIMEOUT = PATIENCE_S  # storing takes its time, on a loaded machine too
    node.nmt.wait_for_heartbeat(timeout=PATIENCE_S)
    lss.send_switch_state_global(lss.CONFIGURATION_STATE)
    identity = [lss.inquire_lss_address(0x5A + part) for part in range(4)]
    assert lss.inquire_node_id() == NODE and identity == [node.sdo[0x1018][part].raw for part in range(1, 5)]
    lss.configure_bit_timing(2)
    for action, value in ((lss.configure_bit_timing, 8), (lss.configure_node_id, 0), (lss.configure_node_id, 128)):
        assert refused(action, value) == "LSS Error: 1"
    lss.activate_bit_timing(50)
    time.sleep(0.3)
    assert lss.inquire_node_id() == NODE
    lss.configure_node_id(255)
    lss.store_configuration()
    assert node.sdo["can_node"].raw == 255
    node.nmt.state = "RESET COMMUNICATION"
    time.sleep(0.5)
    silent = []
    network.subscribe(0x700 + NODE, lambda *_: silent.append(1))
    lss.RESPONSE_TIMEOUT = 1  # it waits so long for each bit that is set
    assert lss.fast_scan() == (True, identity) and lss.inquire_node_id() == 255 and not silent
    boots = []
    network.subscribe(0x700 + other, lambda _, data, stamp: boots.append(bytes(data)))
    lss.configure_node_id(other)
    lss.send_switch_state_global(lss.WAITING_STATE)
    until(lambda: boots, "it boots with its number")
    assert boots[0] == b"\0"
    found = network.add_node(other, sys.argv[3])
    found.sdo.RESPONSE_TIMEOUT = PATIENCE_S
    assert "No LSS response" in refused(lss.send_switch_state_selective, *identity[:3], identity[3] + 1)
    assert lss.send_switch_state_selective(*identity)
    lss.RESPONSE_TIMEOUT = PATIENCE_S
    lss.configure_node_id(NODE)
    lss.store_configuration()
    assert found.sdo["can_node"].raw == NODE and lss.inquire_node_id() == other
    found.nmt.state = "RESET COMMUNICATION"
    node.nmt.wait_for_bootup(timeout=PATIENCE_S)
    node.nmt.wait_for_heartbeat(timeout=PATIENCE_S)


def case_store(_, node):
    node.sdo.RESPONSE_TIMEOUT = PATIENCE_S  # it answers when all is stored
    node.nmt.wait_for_heartbeat(timeout=PATIENCE_S)
    changed = node.sdo["following_mturn"]
    changed.raw = 123
    node.sdo[0x1010][1].raw = int.from_bytes(b"save", "little")
    node.sdo[0x1011][1].raw = int.from_bytes(b"load", "little")
    assert changed.raw == 100
    node.sdo["can_heartbeat_ms"].raw = 100  # it counts at once, and so did its initial value, 0


def ready(node):
    """The profile's own way in. Its SDO patience is a third of a second, which a loaded machine may take."""
    node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
    node.TIMEOUT_CHECK_TPDO = PATIENCE_S
    node.TIMEOUT_SWITCH_STATE_SINGLE = node.TIMEOUT_SWITCH_STATE_FINAL = node.TIMEOUT_SWITCH_OP_MODE = PATIENCE_S
    node.nmt.wait_for_heartbeat(timeout=PATIENCE_S)
    node.nmt.state = "OPERATIONAL"
    until(lambda: node.nmt.wait_for_heartbeat(timeout=PATIENCE_S) == "OPERATIONAL", "operational")
    node.setup_402_state_machine()
    until(lambda: abs(node.sdo["Velocity actual value"].raw) < 5000, "it has coasted to rest")


def case_profile(_, node):
    """Every transition that a master can ask for, by BaseNode402 as it is; then speed by PDO."""
    ready(node)
    until(lambda: node.state == "SWITCH ON DISABLED", "the state at first")
    for state in ("READY TO SWITCH ON", "SWITCHED ON", "READY TO SWITCH ON", "SWITCH ON DISABLED"):
        node.state = state
        until(lambda: node.state == state, state)
    node.op_mode = "PROFILED VELOCITY"
    node.state = "OPERATION ENABLED"
    until(lambda: node.state == "OPERATION ENABLED", "operation enabled")
    node.sdo["Target velocity"].raw = 1000
    velocity = node.sdo["Velocity actual value"]
    until(lambda: abs(velocity.raw - 1000000) < 20000, "1000 rpm")
    node.state = "SWITCHED ON"
    until(lambda: abs(velocity.raw) < 20000, "standstill")
    node.state = "SWITCH ON DISABLED"
    until(lambda: node.state == "SWITCH ON DISABLED", "off")


def case_home_then_csp(_, node):
    """docs/can.md: home, change the mode in operation, follow a sine; a fault, its reset, and the same once more."""
    ready(node)
    node.TIMEOUT_HOMING_DEFAULT = PATIENCE_S
    for _ in range(2):
        node.sdo["Homing method"].raw = 34
        assert node.homing(timeout=PATIENCE_S), "homed"
        assert node.sdo["Statusword"].raw & 0x6F == 0x27, "in operation"
        node.op_mode = "CYCLIC SYNCHRONOUS POSITION"
        until(lambda: node.op_mode == "CYCLIC SYNCHRONOUS POSITION", "the mode is shown")
        node.rpdo[3]["Controlword"].raw = 0x0F
        seen = []
        for n in range(100):
            node.rpdo[3]["Target position"].raw = int(600 * math.sin(n / 16))
            node.rpdo[3].transmit()
            time.sleep(0.01)
            seen.append(node.sdo["Position actual value"].raw)
        assert node.sdo["Statusword"].raw & 0x6F == 0x27 and max(seen) > 300 and min(seen) < -300, (min(seen), max(seen))
        node.state = "SWITCH ON DISABLED"
        until(lambda: node.state == "SWITCH ON DISABLED", "off")
        until(lambda: abs(node.sdo["Velocity actual value"].raw) < 20000, "standstill")  # a turning rotor is refused


def case_process_data(network, node):
    """Mapping written and read back, SYNC, a target by RPDO and what comes back in the TPDO of the same SYNC."""
    ready(node)
    node.tpdo[3].clear()
    node.tpdo[3].add_variable("Statusword")
    node.tpdo[3].add_variable("Velocity actual value")
    node.tpdo[3].trans_type, node.tpdo[3].enabled = 2, True
    node.rpdo[4].clear()
    node.rpdo[4].add_variable("Controlword")
    node.rpdo[4].add_variable("Target velocity")
    node.rpdo[4].trans_type, node.rpdo[4].enabled = 1, True
    node.tpdo[3].save()
    node.rpdo[4].save()
    node.tpdo.read()
    node.rpdo.read()
    assert [v.name for v in node.rpdo[4]] == ["Controlword", "Target velocity"] and node.tpdo[3].trans_type == 2
    came, syncs = [], []
    node.tpdo[3].add_callback(lambda pdo: came.append(pdo["Velocity actual value"].raw))
    network.subscribe(0x80, lambda *_: syncs.append(1))
    node.op_mode = "PROFILED VELOCITY"
    node.rpdo[4]["Target velocity"].raw = 700
    network.sync.start(0.02)
    for word in (6, 7, 15):
        node.rpdo[4]["Controlword"].raw = word
        node.rpdo[4].transmit()
        time.sleep(0.1)
    until(lambda: came and abs(came[-1] - 700000) < 20000, "700 rpm")
    before = node.sdo["Target velocity"].raw
    network.sync.stop()
    time.sleep(0.2)
    count = len(came)
    node.rpdo[4]["Target velocity"].raw = 300
    node.rpdo[4].transmit()
    time.sleep(0.2)
    assert node.sdo["Target velocity"].raw == before == 700, "it waits for SYNC"
    network.sync.transmit()
    network.sync.transmit()
    until(lambda: node.sdo["Target velocity"].raw == 300 and len(came) == count + 1, "every second SYNC")
    node.rpdo[4]["Controlword"].raw = 0
    node.rpdo[4].transmit()
    network.sync.transmit()
    until(lambda: node.sdo["Statusword"].raw & 0x4F == 0x40, "off")


def case_master_lost(network, node):
    """The master's heartbeat stops while the motor turns: EMCY, controlled stop, fault; a reset by the profile clears it."""
    ready(node)
    told = []
    node.emcy.add_callback(told.append)
    node.sdo[0x1016][1].raw = 0x7F << 16 | 300
    beating = network.send_periodic(0x77F, b"\5", 0.05)
    node.op_mode = "PROFILED VELOCITY"
    node.state = "OPERATION ENABLED"
    node.sdo["Target velocity"].raw = 500
    until(lambda: abs(node.sdo["Velocity actual value"].raw - 500000) < 20000, "500 rpm")
    assert not told
    beating.stop()
    until(lambda: any(one.code == 0x8130 for one in told), "EMCY 8130")
    until(lambda: node.sdo["Statusword"].raw & 0x4F == 0x08, "fault")
    assert node.sdo["Error code"].raw == 0x8130 and node.sdo[0x1001].raw & 0x11 == 0x11
    assert node.sdo[0x1003][1].raw & 0xFFFF == 0x8130
    aborted = abs(node.sdo["Velocity actual value"].raw)
    assert aborted < 50000, "it has braked"
    node.state = "SWITCH ON DISABLED"
    until(lambda: told[-1].code == 0, "EMCY 0000")
    until(lambda: node.state == "SWITCH ON DISABLED", "cleared")
    node.sdo[0x1016][1].raw = 0


def main():
    case, port, eds = sys.argv[1:]
    network = canopen.Network()
    network.connect(interface="socketcand", channel="can0", host="127.0.0.1", port=int(port))
    node = BaseNode402(NODE, eds)
    network.add_node(node)
    try:
        globals()[f"case_{case}"](network, node)
    finally:
        network.disconnect()
    print("done")


if __name__ == "__main__":
    main()
