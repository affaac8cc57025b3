# SPDX-License-Identifier: MIT
"""`make recordings RECORDINGS=folder`: Hall edges of a real motor through the drive's estimate, and how far it was off.

A recording is a file NAME.csv or NAME.csv.gz: its first line `# samples N at HZ Hz`, then `sample,state` and a line for each
change of the three switches (bits 0, 1, 2). Nobody recorded where the rotor was: its place is told by the falling edges, which
are sharp, three to an electrical turn, and in a straight line between two of them. Rising ones are late by pull-up and cable.
The estimate knows no torque either, and takes the switches as 60 degrees apart. A count is a sixth of an electrical turn.
"""
import ctypes
import gzip
import re
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rigs.firmware import built
from rigs.hall_rotor import CLOCK_HZ, HZ, LOOP_COUNTS, PER_MS, TURN, Rotor, Switches
from unit.cinterface import Library

WINDOW_S, FLAT, LEAST_COUNTS_S = 0.1, 0.05, 50  # where a bias of the speed is looked for
HEAD = re.compile(r"# samples (\d+) at (\d+) Hz")
ROW = re.compile(r"(\d+),([0-7])")


class Unusable(Exception):
    """A recording that is none; says why, and what would be one."""


@dataclass
class Recording:
    name: str
    duration_s: float
    times_s: np.ndarray  # of the changes
    states: np.ndarray   # from then on


def read(path):
    try:
        with (gzip.open if path.suffix == ".gz" else open)(path, "rt", encoding="ascii") as file:
            lines = file.read().splitlines()
    except (OSError, EOFError, UnicodeDecodeError) as error:
        raise Unusable(f"{path.name} cannot be read: {error}") from error
    head = HEAD.fullmatch(lines[0]) if lines else None
    if not head or int(head[2]) == 0:
        raise Unusable(f"{path.name}: its first line is not '# samples N at HZ Hz'")
    rows = [ROW.fullmatch(line) for line in lines[1:] if line and line != "sample,state"]
    if None in rows or len(rows) < 2:
        raise Unusable(f"{path.name}: each line is 'sample,state', a state from 0 to 7, and there are at least two")
    samples = np.array([int(row[1]) for row in rows])
    if (np.diff(samples) <= 0).any() or samples[-1] >= int(head[1]):
        raise Unusable(f"{path.name}: its samples do not grow, or go beyond the {head[1]} that it says it has")
    hz = int(head[2])
    return Recording(path.name.split(".csv")[0], int(head[1]) / hz, samples / hz, np.array([int(row[2]) for row in rows]))


def ring_of(recording):
    """The six states in the order in which they follow each other, which of both ways does not matter."""
    moves = Counter(frozenset(pair) for pair in zip(recording.states.tolist(), recording.states[1:].tolist()))
    beside = {}
    for pair, _ in moves.most_common():
        if len(pair) == 2 and all(len(beside.get(state, ())) < 2 for state in pair):
            one, other = pair
            beside.setdefault(one, []).append(other)
            beside.setdefault(other, []).append(one)
    ring = [min(beside, default=0)]
    while (further := [state for state in beside.get(ring[-1], ()) if state not in ring]):
        ring.append(min(further) if len(ring) == 1 else further[0])
    if len(ring) != 6 or ring[0] not in beside[ring[-1]]:
        states = sorted(set(recording.states.tolist()))
        raise Unusable(f"{recording.name}: its states {states} do not follow each other in a ring of six: are the switches"
                       " bits 0, 1 and 2, and did the rotor turn?")
    return tuple(ring)


def falling_edges(recording, ring):
    """(times, counts) of the falling edges, counts without wrapping."""
    at, found = None, []
    for time_s, state, before in zip(recording.times_s, recording.states, [None, *recording.states]):
        if state not in ring:
            continue
        if at is None:
            at = ring.index(state)
            continue
        step = (ring.index(state) - at + 3) % 6 - 3
        if abs(step) == 1 and before & ~state:
            found.append((time_s, at + max(step, 0)))
        at += step
    if len(found) < 2:
        raise Unusable(f"{recording.name}: it has no two falling edges of a switch")
    times, counts = zip(*found)
    return np.array(times), np.array(counts, dtype=float)


class Truth:
    """Where the rotor was, and how fast, by falling edges."""
    def __init__(self, times_s, counts):
        self.times_s, self.counts = times_s, counts
        self.slopes = np.diff(counts) / np.diff(times_s)

    def known(self, at_s):
        return (at_s >= self.times_s[0]) & (at_s < self.times_s[-1])

    def place(self, at_s):
        return np.interp(at_s, self.times_s, self.counts)

    def speed(self, at_s):
        return self.slopes[np.clip(np.searchsorted(self.times_s, at_s, side="right") - 1, 0, len(self.slopes) - 1)]


def estimate(library, recording, ring):
    """(times of the samples, angles in counts of a turn, times of the steps, speeds in counts/s) as the drive has them."""
    first = next(state for state in recording.states if state in ring)
    rotor = Rotor(library, Switches(states=ring), start=(ring.index(first) + 0.5) / 6)
    steps = int(recording.duration_s * 1000)
    at_s = np.arange(1, steps * PER_MS + 1) / HZ
    last = np.searchsorted(recording.times_s, at_s, side="right") - 1
    states = recording.states[np.maximum(last, 0)].astype(np.uint32)
    edges = (np.rint(recording.times_s * CLOCK_HZ).astype(np.int64) % TURN)[np.maximum(last, 0)].astype(np.uint32)
    angles, speeds = np.empty(len(at_s), np.uint32), np.empty(steps)
    words = ctypes.POINTER(ctypes.c_uint32)
    for step in range(steps):
        part = slice(step * PER_MS, (step + 1) * PER_MS)
        library.host_hall_samples(rotor.loop, rotor.hall, rotor.regs, states[part].ctypes.data_as(words),
                                  edges[part].ctypes.data_as(words), LOOP_COUNTS, PER_MS, angles[part].ctypes.data_as(words))
        library.hall_speed_step(rotor.hall, rotor.loop, rotor.regs, rotor.tuning, 0)
        speeds[step] = rotor.hall.speed.speed_q32 / TURN * HZ * 6
    return at_s, angles / TURN * 6, at_s[PER_MS - 1::PER_MS], speeds


def largest_bias(truth, at_s, speeds):
    """Of the mean speed, as a share, in windows in which the speed hardly changes; None where there is none."""
    per_window = round(WINDOW_S * 1000)
    worst = None
    for first in range(0, len(at_s) - per_window + 1, per_window):
        times = at_s[first:first + per_window]
        true = truth.speed(times)
        mean = true.mean()
        if truth.known(times).all() and abs(mean) >= LEAST_COUNTS_S and np.ptp(np.abs(true)) <= FLAT * abs(mean):
            worst = max(worst or 0.0, abs(speeds[first:first + per_window].mean() / mean - 1))
    return worst


def errors(library, recording):
    """(largest error of the position in counts, of the speed in counts/s, of the mean speed as a share or None)"""
    ring = ring_of(recording)
    truth = Truth(*falling_edges(recording, ring))
    at_s, angles, step_s, speeds = estimate(library, recording, ring)
    off = (angles - truth.place(at_s) + 3) % 6 - 3
    fast = np.abs(speeds - truth.speed(step_s))[truth.known(step_s)]
    return np.abs(off[truth.known(at_s)]).max(), fast.max(initial=0.0), largest_bias(truth, step_s, speeds)


def play(folder):
    paths = sorted(path for path in Path(folder).glob("*") if re.search(r"\.csv(\.gz)?$", path.name))
    if not Path(folder).is_dir() or not paths:
        raise Unusable(f"RECORDINGS '{folder}' is no folder with recordings, NAME.csv or NAME.csv.gz; docs/hall.md says"
                       " what is in one")
    library = Library(built("firmware.so"))
    print("| recording | seconds | position off by, counts | speed off by, counts/s | mean speed off by, % |")
    print("|---|--:|--:|--:|--:|")
    for path in paths:
        recording = read(path)
        place, speed, bias = errors(library, recording)
        print(f"| {recording.name} | {recording.duration_s:.1f} | {place:.2f} | {speed:.1f} |"
              f" {'no steady speed' if bias is None else f'{100 * bias:.2f}'} |", flush=True)


def main(folder):
    try:
        play(folder)
    except Unusable as problem:
        sys.exit(f"mssfoc: {problem}")


if __name__ == "__main__":
    main(*sys.argv[1:2] or [""])
