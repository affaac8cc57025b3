# SPDX-License-Identifier: MIT
"""A capture of the scope as arrays of numpy."""
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .recording import KINDS


@dataclass(frozen=True)
class Capture:
    t_s: np.ndarray  # from the trigger
    values: dict     # {signal: array in its unit}
    units: dict

    def __getitem__(self, name):
        return self.values[name]

    def save(self, path, texts=None):
        """As .csv, .mf4 or .mcap, by the path's ending; texts {signal: {number: word}} of enumerations go along."""
        kind = KINDS.get(Path(path).suffix)
        if kind is None:
            raise ValueError(f"a capture is saved as {', '.join(KINDS)}, not as {Path(path).name}")
        columns = {name: (self.units[name], values) for name, values in self.values.items()}
        Path(path).write_bytes(kind(self.t_s, columns, texts))

    @classmethod
    def of(cls, raw, signals):
        """raw as texts.capture() has it, signals {name: Signal or Variable}, in its order."""
        rows = np.array(raw["rows"], dtype=np.int64).reshape(len(raw["rows"]), len(raw["names"]))
        return cls((np.arange(len(rows)) - raw["trigger"]) / raw["per_ms"] / 1000,
                   {name: one.of(rows[:, at]).astype(float) for at, (name, one) in enumerate(signals.items())},
                   {name: one.unit for name, one in signals.items()})
