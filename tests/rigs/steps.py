# SPDX-License-Identifier: MIT
"""Steps of a scenario: what is typed, what happens, what is said on the bus; and what a run shows of faults and speed."""
import numpy as np


def typed(t_s, line):
    return {"t_s": t_s, "console": line}


def event(t_s, kind, *args):
    return {"t_s": round(t_s, 7), "event": kind, "args": [str(one) for one in args]}


def send(t_s, data):
    return event(t_s, "bus", bytes(data).hex())


def faults(result):
    """In their order."""
    codes = result.trace["fault"]
    return [result.enums["fault"][int(code)] for code in codes[np.flatnonzero(np.diff(codes, prepend=0))] if code]


def rpm(window):
    return window["speed_rad_s"] * 30 / np.pi
