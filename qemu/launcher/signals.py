# SPDX-License-Identifier: MIT
"""Measurements on arrays, as one would make them on an oscilloscope: no knowledge of motors or files."""
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


def bandwidth_from_step(t, y, start, final):
    """The -3 dB frequency of the system whose step response is y.

    The derivative of a step response is the impulse response; its spectrum is the frequency response. y must have settled
    at the end. The first crossing of 1/sqrt(2) of the value at f -> 0 is interpolated. None when it never falls that low.
    """
    dt = float(t[1] - t[0])
    unit = (np.asarray(y) - start) / (final - start)
    impulse = np.diff(unit, prepend=unit[0])
    size = 1 << max(14, int(np.ceil(np.log2(len(impulse)))) + 2)
    gain = np.abs(np.fft.rfft(impulse, size))
    frequency = np.fft.rfftfreq(size, dt)
    return crossing_time(frequency, gain / gain[0], np.sqrt(0.5), rising=False)


def whole_periods(angle_rad):
    """(first, last) indices of the largest number of whole turns of an unwrapped angle; the end is exclusive."""
    turns = np.abs(angle_rad - angle_rad[0]) / (2 * np.pi)
    count = int(turns[-1])
    if count < 1:
        raise LauncherError("less than one electrical period in the window")
    return 0, int(np.searchsorted(turns, count))


def thd_percent(y, angle_rad, harmonics=40):
    """Total harmonic distortion: rms of harmonics 2..`harmonics` over that of the fundamental, in percent.

    A Fourier series in the electrical angle is fitted to the samples of whole periods by least squares, so it needs
    neither equal steps of the angle nor a whole number of samples a period.
    """
    first, last = whole_periods(angle_rad)
    angle = angle_rad[first:last]
    per_period = len(angle) / (np.abs(angle[-1] - angle[0]) / (2 * np.pi))
    orders = np.arange(1, max(2, min(harmonics, int(per_period / 2.5))) + 1)
    phases = np.outer(angle, orders)
    basis = np.hstack([np.ones((len(angle), 1)), np.cos(phases), np.sin(phases)])
    fit = np.linalg.lstsq(basis, y[first:last], rcond=None)[0]
    size = np.hypot(fit[1:len(orders) + 1], fit[len(orders) + 1:])
    if size[0] == 0:
        raise LauncherError("no fundamental in the window")
    return float(np.sqrt(np.sum(size[1:] ** 2)) / size[0] * 100)


def settling_time(t, error, band):
    """How long after t[0] |error| stays within `band` for good; None when it does not."""
    outside = np.flatnonzero(np.abs(error) > band)
    if len(outside) == 0:
        return 0.0
    if outside[-1] == len(error) - 1:
        return None
    return float(t[outside[-1] + 1] - t[0])
