# SPDX-License-Identifier: MIT
"""A capture of the scope as arrays of numpy."""
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Capture:
    t_s: np.ndarray  # from the trigger
    values: dict     # {signal: array in its unit}
    units: dict

    def __getitem__(self, name):
        return self.values[name]

    @classmethod
    def of(cls, raw, signals):
        """raw as texts.capture() has it, signals {name: Signal}."""
        rows = np.array(raw["rows"], dtype=float).reshape(len(raw["rows"]), len(raw["names"]))
        names = raw["names"]
        return cls((np.arange(len(rows)) - raw["trigger"]) / raw["per_ms"] / 1000,
                   {name: rows[:, at] * signals[name].step for at, name in enumerate(names)},
                   {name: signals[name].unit for name in names})
