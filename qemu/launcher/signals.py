# SPDX-License-Identifier: MIT
"""Measurements on arrays, as one would make them on an oscilloscope or a network analyser: no knowledge of motors or files."""
from dataclasses import dataclass

import numpy as np

from .errors import LauncherError


def crossing_time(t, y, level, rising=True):
    """The first time y passes `level`, interpolated between samples; None when it never does."""
    above = y >= level if rising else y <= level
    hits = np.flatnonzero(above)
    if len(hits) == 0:
        return None
    k = hits[0]
    if k == 0 or y[k] == y[k - 1]:
        return float(t[k])
    return float(t[k - 1] + (level - y[k - 1]) / (y[k] - y[k - 1]) * (t[k] - t[k - 1]))


def step_response(t, y, start, final):
    """(rise time 10-90 %, overshoot in percent of the step) of a step from `start` to `final` that y follows."""
    if final == start:
        raise LauncherError("a step of zero height has no response")
    unit = (np.asarray(y) - start) / (final - start)
    t10, t90 = crossing_time(t, unit, 0.1), crossing_time(t, unit, 0.9)
    rise = None if t10 is None or t90 is None else t90 - t10
    return rise, max(0.0, (float(unit.max()) - 1.0) * 100)


def settling_time(t, error, band):
    """How long after t[0] |error| stays within `band` for good; None when it does not."""
    outside = np.flatnonzero(np.abs(error) > band)
    if len(outside) == 0:
        return 0.0
    if outside[-1] == len(error) - 1:
        return None
    return float(t[outside[-1] + 1] - t[0])


def whole_periods(from_s, to_s, period_s):
    """How many periods lie between two times, an integer: rounded up, since the one in which it happens counts.

    A hundredth of a period is taken for what numbers in seconds lose, so that exactly three periods are never four.
    """
    return max(0, int(np.ceil((to_s - from_s) / period_s - 0.01)))


# ---- distortion ----------------------------------------------------------------------------------------------------

def _fitted(y, angle_rad, cosine, sine):
    """(dc, cosine part, sine part) of y by least squares: neither equal steps of the angle nor whole periods are needed."""
    if abs(angle_rad[-1] - angle_rad[0]) < 2 * np.pi:
        raise LauncherError("less than one electrical period in the window")
    basis = np.stack([np.ones_like(y), cosine, sine])
    parts = np.linalg.solve(basis @ basis.T, basis @ y)
    if not parts[1:].any():
        raise LauncherError("no fundamental in the window")
    return parts


def distortion_percent(y, angle_rad):
    """Everything in y but its mean and its fundamental, harmonics and inter-harmonics alike, over the fundamental (rms)."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    dc, c, s = _fitted(y, angle_rad, cosine, sine)
    return float(np.sqrt(np.mean((y - dc - c * cosine - s * sine) ** 2) * 2) / np.hypot(c, s)) * 100


def distortion_with_ripple_percent(mean, rms, angle_rad):
    """The same of a y that is not sampled: mean[n] and rms[n] are its values over the time from angle[n-1] to angle[n].

    What the fundamental contributes to each is worked out for the very angle that was passed, so that the small difference
    of large squares depends neither on where the window ends nor on when samples are taken.
    """
    half, middle = np.diff(angle_rad) / 2, (angle_rad[1:] + angle_rad[:-1]) / 2
    mean, rms = mean[1:], rms[1:]
    dc, c, s = _fitted(mean, angle_rad, np.cos(middle) * np.sinc(half / np.pi), np.sin(middle) * np.sinc(half / np.pi))
    size, turned = np.hypot(c, s), middle - np.arctan2(s, c)
    known = (dc ** 2 + 2 * dc * size * np.cos(turned) * np.sinc(half / np.pi)
             + size ** 2 / 2 * (1 + np.cos(2 * turned) * np.sinc(2 * half / np.pi)))
    return float(np.sqrt(max(0.0, np.mean(rms ** 2 - known)) * 2) / size) * 100


# ---- frequency response --------------------------------------------------------------------------------------------

def response_at(t, y, hz):
    """The part of y at `hz` as a complex number, relative to sin(2 pi hz t); mean and a drift of y are set aside."""
    phase = 2 * np.pi * hz * t
    basis = np.stack([np.ones_like(t), t - t.mean(), np.sin(phase), np.cos(phase)])
    _, _, in_phase, quadrature = np.linalg.solve(basis @ basis.T, basis @ y)
    return complex(in_phase, quadrature)


@dataclass
class Loop:
    """A closed loop T measured at rising frequencies, and what follows from it for the open loop L = T / (1 - T)."""
    hz: np.ndarray
    closed: np.ndarray

    @property
    def opened(self):
        return self.closed / (1 - self.closed)

    def bandwidth_hz(self):
        """Where |T| falls below -3 dB, or None."""
        return self._falls_to(np.abs(self.closed), np.sqrt(0.5))

    def lag_hz(self, degrees=90.0):
        """Where T lags by so many degrees, or None."""
        lag = -np.unwrap(np.angle(self.closed))
        lag -= 2 * np.pi * np.round(lag[0] / (2 * np.pi))
        crossed = crossing_time(np.log(self.hz), lag, np.radians(degrees))
        return None if crossed is None else float(np.exp(crossed))

    def crossover_hz(self):
        """Where |L| falls below 1, or None."""
        return self._falls_to(np.abs(self.opened), 1.0)

    def phase_margin_deg(self):
        """180 degrees less the lag of L at its crossover, or None."""
        crossover = self.crossover_hz()
        if crossover is None:
            return None
        phase = np.unwrap(np.angle(self.opened))
        phase -= 2 * np.pi * np.round((phase[0] + np.pi / 2) / (2 * np.pi))  # an integrator's -90 degrees at the low end
        return 180.0 + float(np.degrees(np.interp(np.log(crossover), np.log(self.hz), phase)))

    def sensitivity_peak(self):
        """The largest |1 - T|: by how much the loop amplifies what disturbs it, at its worst measured frequency."""
        return float(np.abs(1 - self.closed).max())

    def _falls_to(self, gain, level):
        crossed = crossing_time(np.log(self.hz), np.log(np.maximum(gain, 1e-12)), np.log(level), rising=False)
        return None if crossed is None else float(np.exp(crossed))
