# SPDX-License-Identifier: MIT
"""Kinds of figures: statistics of any column, or of an expression over columns and names."""
import math

import numpy as np

from .expression import evaluate
from .kind import Kind


def _column(run, column, from_s=None, to_s=None):
    window = run.window(from_s, to_s)
    value = np.asarray(evaluate(column, {**run.names, **window}), dtype=float)
    return np.broadcast_to(value, window["t_s"].shape)


def _mean(run, column, from_s=None, to_s=None):
    return _column(run, column, from_s, to_s).mean()


def _maximum(run, column, from_s=None, to_s=None):
    return _column(run, column, from_s, to_s).max()


def _minimum(run, column, from_s=None, to_s=None):
    return _column(run, column, from_s, to_s).min()


def _rms(run, column, from_s=None, to_s=None):
    return math.sqrt(np.square(_column(run, column, from_s, to_s)).mean())


def _kind(function, method):
    return Kind(function, ["column", "from_s?", "to_s?"], "", method, texts=("column",))


KINDS = {
    "mean": _kind(_mean, "mean over the window"),
    "maximum": _kind(_maximum, "largest value in the window"),
    "minimum": _kind(_minimum, "smallest value in the window"),
    "rms": _kind(_rms, "root mean square over the window"),
}
