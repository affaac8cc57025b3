# SPDX-License-Identifier: MIT
"""A master of two drives on one bus: python `canopen`, unmodified.  canopen_two.py PORT EDS GONE

Runs in the environment that has canopen. Says "moving" once both move; then the drive GONE ends, of which it is told by a line;
says "alone" when the other one has gone on; then the drive that is gone comes back, and it says "done" at last.
"""
import sys
import time

import canopen
from canopen.profiles.p402 import BaseNode402
from canopen_client import ready, until

NODES = (5, 6)
BEATS_S = 0.1  # can_heartbeat_ms of both


def master(port):
    network = canopen.Network()
    network.connect(interface="socketcand", channel="can0", host="127.0.0.1", port=port)
    return network


def moves(node, rpm):
    ready(node)
    node.op_mode = "PROFILED VELOCITY"
    node.state = "OPERATION ENABLED"
    turns(node, rpm)


def turns(node, rpm):
    node.sdo["Target velocity"].raw = rpm
    until(lambda: abs(node.sdo["Velocity actual value"].raw - 1000 * rpm) < 20000, f"node {node.id} turns at {rpm} rpm")


def answers_each_sync(node, network):
    """A TPDO of each node for each SYNC, of which a second program hears everything."""
    node.tpdo[3].trans_type, node.tpdo[3].enabled = 1, True
    node.tpdo[3].save()
    heard = []
    network.subscribe(0x380 + node.id, lambda *_: heard.append(1))
    return heard


def beats(nodes, other):
    """Heartbeats of each, by its own clock, at a second program. Not what it has queued while it was alone."""
    stamps = {node.id: [] for node in nodes}
    for node in nodes:
        other.subscribe(0x700 + node.id, lambda _, data, stamp, of=stamps[node.id]: of.append(stamp))
    until(lambda: min(map(len, stamps.values())) > 5, "both heartbeats")
    for of in stamps.values():
        spans = [late - early for early, late in zip(of, of[1:])]
        assert min(spans) > 0.9 * BEATS_S and max(spans) < 1.1 * BEATS_S, spans


def both(network, nodes, other):
    for node, rpm in zip(nodes, (500, -300)):
        moves(node, rpm)
    beats(nodes, other)
    syncs, heard = [], [answers_each_sync(node, other) for node in nodes]
    other.subscribe(0x80, lambda *_: syncs.append(1))
    time.sleep(0.5)
    before = [len(one) for one in heard]
    for count in range(1, 6):
        network.sync.transmit()
        until(lambda: all(len(one) == was + count for one, was in zip(heard, before)), "both answer a SYNC")
    assert len(syncs) == 5


def wait_for_word(told):
    print(told, flush=True)
    assert sys.stdin.readline()


def silent(node):
    try:
        node.nmt.wait_for_heartbeat(timeout=1)
    except canopen.nmt.NmtError:
        return True
    return False


def main():
    port, eds, gone = int(sys.argv[1]), sys.argv[2], int(sys.argv[3])
    network, other = master(port), master(port)
    nodes = [BaseNode402(number, eds) for number in NODES]
    for node in nodes:
        network.add_node(node)
    try:
        both(network, nodes, other)
        wait_for_word("moving")
        lost, left = (next(node for node in nodes if (node.id == gone) == wanted) for wanted in (True, False))
        until(lambda: silent(lost), "its heartbeat ends")
        turns(left, 700)
        wait_for_word("alone")
        moves(lost, 400)
        turns(left, 200)
        for node in nodes:
            node.state = "SWITCH ON DISABLED"
    finally:
        network.disconnect()
        other.disconnect()
    print("done")


if __name__ == "__main__":
    main()
