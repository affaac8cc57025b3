# SPDX-License-Identifier: MIT
"""What is drawn by lot: numbers that depend on the lot's number and on the name of what is drawn, and on nothing else.

The generator is counter-based: the first 8 bytes of BLAKE2b over "lot NUMBER NAME", big-endian, over 2^64. It has no state, so
that a further draw leaves the others where they were. It never changes: tests/launcher/test_lot.py pins what some lots are.
"""
import hashlib
import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Draw:
    """Of one lot."""
    lot: int

    def share(self, name):
        """0...1, uniform."""
        digest = hashlib.blake2b(f"lot {self.lot} {name}".encode(), digest_size=8).digest()
        return int.from_bytes(digest, "big") / 2**64

    def between(self, name, low, high):
        """Uniform."""
        return low + (high - low) * self.share(name)

    def log(self, name, low, high):
        """Uniform in the logarithm: each octave as likely as any other."""
        return low * math.exp(math.log(high / low) * self.share(name))

    def pick(self, name, choices):
        """One of them, each as likely."""
        return choices[int(self.share(name) * len(choices))]

    def weighted(self, name, weights):
        """A key of {key: weight}."""
        left = self.share(name) * sum(weights.values())
        for key, weight in weights.items():
            left -= weight
            if left < 0:
                return key
        return key

    def chance(self, name, share):
        """Whether something that happens in this share of the lots does."""
        return self.share(name) < share


def digits(value, count=4):
    """Rounded: what a file says, and the same on machines whose libraries differ in the last bit."""
    return float(f"{value:.{count}g}")
