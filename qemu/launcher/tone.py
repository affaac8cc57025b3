# SPDX-License-Identifier: MIT
"""What is heard of an injection: the spectrum of the plant's phase currents, one row a sample.

Each bin is the mean over pieces of PIECE samples, under a Hann window, half over one another: 20 Hz apart at 20 kHz, and as
wide as 29 Hz of noise. Below LEAST of the sampling rate stands what the loops answer to the sensors' noise, whatever is
injected.
"""
from dataclasses import dataclass

import numpy as np

from .errors import LauncherError

PIECE = 1024
LEAST = 0.1
HANN_BINS = 1.5  # power of noise in a bin, by that in a bin's width
LINE_BINS = 3    # to either side of a line its window leaves something


@dataclass(frozen=True)
class Heard:
    """Of the phase with the largest line: that line's amplitude and frequency, how far it stands above the mean of all else
    from LEAST on, and the rms of everything there."""
    line_a: float
    line_hz: float
    above_db: float
    rms_a: float


def amplitudes(current, period_s):
    """(frequencies, amplitudes) of a sine that would stand alone in each bin."""
    if len(current) < PIECE:
        raise LauncherError(f"a spectrum takes {PIECE} samples, not {len(current)}")
    window = np.hanning(PIECE + 1)[:-1]
    pieces = np.lib.stride_tricks.sliding_window_view(current, PIECE)[::PIECE // 2]
    power = (np.abs(np.fft.rfft((pieces - pieces.mean(axis=1, keepdims=True)) * window))**2).mean(axis=0)
    amplitude = 2 * np.sqrt(power) / window.sum()
    amplitude[-1] /= 2  # half the sampling rate is its own mirror image
    return np.fft.rfftfreq(PIECE, period_s), amplitude


def _heard(current, period_s):
    hz, amplitude = amplitudes(current, period_s)
    hz, amplitude = hz[hz * period_s >= LEAST], amplitude[hz * period_s >= LEAST]
    power = amplitude**2 / 2
    power[-1] *= 2
    at = int(np.argmax(amplitude))
    around = np.abs(np.arange(len(power)) - at) > LINE_BINS
    above_db = 10 * np.log10(power[at] / power[around].mean())
    return Heard(float(amplitude[at]), float(hz[at]), float(above_db), float(np.sqrt(power.sum() / HANN_BINS)))


def heard(window, period_s):
    """Of a window of the trace."""
    return max((_heard(window[f"i_{phase}_A"], period_s) for phase in "abc"), key=lambda of: of.line_a)
