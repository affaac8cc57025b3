# SPDX-License-Identifier: MIT
"""Between a master and a drive's terminal: requests and replies of Modbus RTU pass as a whole.

Masters tell the end of a reply by a pause, and send again after a time-out. Both are of this machine's time, and the twin may
be paused in the midst of a frame; a line is not. So a reply passes once all of it is there; it answers the same question asked
again, too, and passes no more if another one has been asked since.
"""
import contextlib
import os
import select
import threading
import tty

EXCEPTION, IDENTIFY = 0x80, 0x2B
REQUEST = {16: (7, 9), 23: (11, 13)}  # function: (to the byte that counts the data, bytes besides those); else how many
REQUEST_BYTES = {22: 10, IDENTIFY: 7}
REPLY = {3: (3, 5), 4: (3, 5), 23: (3, 5)}
REPLY_BYTES = {22: 10}
LOOK_S = 0.1


def _bytes(said, counted, fixed):
    """How long the frame is, as far as that can be told yet: Modbus Application Protocol V1.1b3, 6."""
    if len(said) < 2:
        return 2
    to, besides = counted.get(said[1], (2, 0))
    if len(said) < to:
        return to
    return besides + said[to - 1] if besides else fixed.get(said[1], 8)


def request_bytes(said):
    return _bytes(said, REQUEST, REQUEST_BYTES)


def reply_bytes(said):
    if len(said) >= 2 and said[1] & EXCEPTION:
        return 5
    if len(said) < 2 or said[1] != IDENTIFY:
        return _bytes(said, REPLY, REPLY_BYTES)
    at = 8  # objects: number, length, text
    for _ in range(said[7] if len(said) >= 8 else 0):
        at += 2 + (said[at + 1] if len(said) > at + 1 else 0)
    return at + 2


def _ready(one):
    return bool(select.select([one], [], [], 0)[0])


def _frame(one, length_of, over):
    """A whole frame, or what there is of it when all is over."""
    said = b""
    while len(said) < length_of(said) and not over.is_set():
        if select.select([one], [], [], LOOK_S)[0]:
            said += os.read(one, length_of(said) - len(said))
    return said


def _carry(master, drive, over):
    asked = _frame(master, request_bytes, over)
    while not over.is_set():
        os.write(drive, asked)
        reply, again = _frame(drive, reply_bytes, over), asked
        while again == asked and _ready(master):
            again = _frame(master, request_bytes, over)
        if again == asked:
            os.write(master, reply)
            again = _frame(master, request_bytes, over)
        asked = again


@contextlib.contextmanager
def whole_frames(terminal):
    """The terminal for a master, of a drive's line at another one."""
    master, end = os.openpty()  # the master's end stays open here: programs come and go
    drive = os.open(terminal, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(end)
    tty.setraw(drive)
    over = threading.Event()
    carrier = threading.Thread(target=_carry, args=(master, drive, over), daemon=True)
    try:
        carrier.start()
        yield os.ttyname(end)
    finally:
        over.set()
        carrier.join()
        for one in (master, end, drive):
            os.close(one)
