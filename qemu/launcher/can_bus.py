# SPDX-License-Identifier: MIT
"""Where a twin's CAN bus is: at a terminal, for one program; or at a port, for programs and other twins.

A port's bus is a process of its own (qemu/twin/can_hub.h), so that each of its twins may end, the one that opened it, too. It
ends with the last of them.
"""
import errno
import re
import socket
import subprocess

from .errors import LauncherError
from .paths import build_dir, shown
from .qemu import CAN_DESIGN

HOST = "127.0.0.1"
PATIENCE_S = 2.0     # with whoever listens at a port
LONGEST_BYTES = 256  # of what a bus answers
_opened = []         # buses: one begins to count its twins down when its standard input ends


def can_chardev(place, build=None):
    """QEMU's options for the CAN bus, and the items of the twin's configuration; both empty for nowhere.

    place   tcp:PORT opens a bus at a port of this machine, where socketcand is spoken; join:PORT is on that of another twin;
            pty is a terminal that speaks slcan
    """
    if not place:
        return [], {}
    kind, _, port = place.partition(":")
    if place == "pty":
        return ["-chardev", "pty,id=can"], {"can": "can slcan", **CAN_DESIGN}
    if kind not in ("tcp", "join") or not port.isdecimal() or not 1 <= int(port) <= 65535:
        raise LauncherError(f"CAN '{place}' is neither pty nor tcp:PORT, nor join:PORT of a bus that another twin has opened")
    if kind == "tcp":
        _open(int(port), build_dir(build) / "qemu" / "canbus")
    else:
        _refuse_where_no_twin_is(int(port))
    return ["-chardev", f"socket,id=can,host={HOST},port={int(port)},nodelay=on"], {"can": "can bus", **CAN_DESIGN}


def joins(place):
    return place.startswith("join:")


def _open(port, program):
    if not program.is_file():
        raise LauncherError(f"{shown(program)} is missing: run make first")
    with socket.socket() as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((HOST, port))
            listener.listen()
        except OSError as error:
            taken = f"; CAN=join:{port} joins a twin's bus there" if error.errno == errno.EADDRINUSE else ""
            raise LauncherError(f"CAN 'tcp:{port}': {error.strerror}{taken}") from error
        _opened.append(subprocess.Popen([program, str(listener.fileno())], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL, pass_fds=[listener.fileno()], start_new_session=True))


def _told(bus):
    """Up to the end of a command, or so much that it is none."""
    said = b""
    while not said.endswith(b">") and len(said) <= LONGEST_BYTES and (more := bus.recv(256)):
        said += more
    return said


def _refuse_where_no_twin_is(port):
    try:
        with socket.create_connection((HOST, port), PATIENCE_S) as bus:
            bus.settimeout(PATIENCE_S)
            greeting, twins = _told(bus), b""
            if greeting == b"< hi >":
                bus.sendall(b"< twins >")
                twins = _told(bus)
    except ConnectionRefusedError:
        raise LauncherError(f"CAN 'join:{port}': nobody listens there; CAN=tcp:{port} opens a bus") from None
    except OSError:
        greeting = twins = b""
    if greeting == b"< error full >":
        raise LauncherError(f"CAN 'join:{port}': that bus has room for no further drive or program")
    if not re.fullmatch(rb"< twins \d+ >", twins):
        raise LauncherError(f"CAN 'join:{port}': what listens there is no twin's bus")
