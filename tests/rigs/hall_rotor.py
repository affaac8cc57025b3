# SPDX-License-Identifier: MIT
"""A rotor with three Hall switches in front of what the firmware makes of them: samples, edges and when they came."""
import ctypes
import math

import numpy as np

from rigs.motor_numbers import compute, shipped

TURN, HZ, CLOCK_HZ, LOOP_COUNTS, PER_MS = 2**32, 20000, 100e6, 5000, 20
IDEAL = (5, 1, 3, 2, 6, 4)
MOTOR = "hoverboard_350w"


def wrapped(angle_q32):
    """Degrees, -180...180."""
    return ((np.asarray(angle_q32, dtype=np.int64) + TURN // 2) % TURN - TURN // 2) * (360 / TURN)


class Switches:
    """States and edges by electrical turns: sector n from edge n on; `hysteresis` in turns, by which each edge comes late."""
    def __init__(self, states=IDEAL, edges=tuple(n / 6 for n in range(6)), hysteresis=0.0):
        self.states, self.edges, self.hysteresis = states, edges, hysteresis

    def line(self, place):
        return place // 6 + self.edges[place % 6]

    def at(self, turns):
        """The sector, counted from angle 0 on."""
        return max(n for n in range(6 * math.floor(turns) - 6, 6 * math.floor(turns) + 7) if self.line(n) <= turns)

    def follow(self, place, last, turns, clocks):
        """States and times of the last edge at these instants of a rotor that is there then, and the sector; the first
        instant is the one before."""
        states, times = [], []
        for n in range(1, len(turns)):
            while turns[n] >= self.line(place + 1) + self.hysteresis:
                place += 1
                last = self._when(turns, clocks, n, self.line(place) + self.hysteresis)
            while turns[n] < self.line(place) - self.hysteresis:
                last = self._when(turns, clocks, n, self.line(place) - self.hysteresis)
                place -= 1
            states.append(self.states[place % 6])
            times.append(last)
        return states, times, place

    @staticmethod
    def _when(turns, clocks, n, line):
        return int(clocks[n - 1] + (line - turns[n - 1]) / (turns[n] - turns[n - 1]) * (clocks[n] - clocks[n - 1]))


class Rotor:
    """The firmware's source of the angle, fed by a course of the rotor."""
    def __init__(self, c, switches, start=0.0, clock=0, table=None, **params):
        self.c, self.switches = c, switches
        told = table or switches
        values = {**shipped(MOTOR), "angle_source": 2, "hall_states": int("".join(map(str, told.states))),
                  **{f"hall_edge_{n + 1}_cdeg": round(36000 * edge) % 36000 for n, edge in enumerate(told.edges)}, **params}
        error, _, self.tuning = compute(c, values)
        assert error == "ERROR_NONE", error
        self.params = c.params()
        c.params_init(self.params)
        for name, value in values.items():
            setattr(self.params, name, value)
        self.table, self.hall, self.loop, self.regs = c.hall_table(), c.hall(), c.current_loop(), c.encoder_regs()
        assert c.hall_table_of(self.params, self.table) == c.ERROR_NONE
        c.current_loop_init(self.loop)
        self.loop.source = c.LOOP_HALL
        c.hall_take_table(self.hall, self.table, self.tuning)
        self.turns, self.clock = start, clock
        self.place, self.last = switches.at(start), clock
        self.regs.HALL = switches.states[self.place % 6]
        self.regs.HALL_TIME = self.regs.LATCH_TIME = clock % TURN
        c.hall_begin(self.hall, self.loop, self.regs)

    def run(self, course, torque=0):
        """`course`: turns at each sample from now on, whole milliseconds. Returns (degrees by which each prediction is ahead,
        speeds in Hz as the slow loop had them); `ways` are what the speed loop's memory adds up."""
        turns = np.concatenate(([self.turns], course))
        clocks = self.clock + LOOP_COUNTS * np.arange(len(turns))
        states, times, self.place = self.switches.follow(self.place, self.last, turns, clocks)
        self.last = times[-1]
        off, speeds, self.ways = [], [], []
        for first in range(0, len(course), PER_MS):
            buffer = (ctypes.c_uint32 * PER_MS)()
            chunk = slice(first, first + PER_MS)
            hall = (ctypes.c_uint32 * PER_MS)(*states[chunk])
            when = (ctypes.c_uint32 * PER_MS)(*(time % TURN for time in times[chunk]))
            self.c.host_hall_samples(self.loop, self.hall, self.regs, hall, when, LOOP_COUNTS, PER_MS, buffer)
            self.c.hall_speed_step(self.hall, self.loop, self.regs, self.tuning, torque)
            true = np.rint(course[chunk] * TURN).astype(np.int64)
            off.extend(wrapped(np.array(buffer, dtype=np.int64) - true))
            speeds.append(self.hall.speed.speed_q32 / TURN * HZ)
            self.ways.append(self.hall.speed.travel_q32 / TURN * HZ)
        self.turns, self.clock = float(turns[-1]), int(clocks[-1])
        return np.array(off), np.array(speeds)

    def turning(self, hz, ms, **more):
        return self.run(self.turns + hz / HZ * np.arange(1, ms * PER_MS + 1), **more)


MISPLACED = Switches(edges=(0.01, 0.15, 0.345, 0.51, 0.66, 0.84))


def parameters(c, states=513264, edges=(0, 6000, 12000, 18000, 24000, 30000)):
    p = c.params()
    c.params_init(p)
    p.hall_states = states
    for n, edge in enumerate(edges):
        setattr(p, f"hall_edge_{n + 1}_cdeg", edge)
    return p
