# SPDX-License-Identifier: MIT
"""What somebody may have meant, against the whole table of Levenshtein's distances."""
import random
import string

import pytest

from rigs.console import Operator
from rows import param_rows

NAMES = list(param_rows())
EDITS_MAX = 3


def edits(word, name):
    row = list(range(len(name) + 1))
    for n, letter in enumerate(word, 1):
        corner, row[0] = row[0], n
        for k, other in enumerate(name, 1):
            corner, row[k] = row[k], min(corner + (letter != other), row[k] + 1, row[k - 1] + 1)
    return row[-1]


def meant(word):
    """The first of the nearest; whoever begins with the word is one edit away."""
    far = [1 if name.startswith(word) else edits(word.lower(), name) for name in NAMES]
    closest = min(far)
    allowed = closest <= max(1, min(len(word) // 3, EDITS_MAX))
    return NAMES[far.index(closest)] if allowed and len(word) > 1 else None


def mistyped(draw):
    word = draw.choice(NAMES)
    if draw.random() < 0.05:
        return word.upper()
    for _ in range(draw.randrange(1, 6)):
        at, letter = draw.randrange(len(word) + 1), draw.choice(string.ascii_lowercase + "_")
        word = draw.choice((word[:at] + letter + word[at:], word[:at] + word[at + 1:], word[:at] + letter + word[at + 1:]))
    return word[:draw.randrange(2, 41)] if draw.random() < 0.2 else word


@pytest.mark.parametrize("seed", range(4))
def test_the_nearest_is_the_nearest(c, seed):
    operator, draw = Operator(c), random.Random(seed)
    c.params_init(operator.axis.params)
    words = [word for word in (mistyped(draw) for _ in range(250)) if word and word not in NAMES and word != "all"]
    wanted = [meant(word) for word in words]
    assert sum(name is None for name in wanted) > 20 and sum(name is not None for name in wanted) > 100
    for word, name in zip(words, wanted):
        said = operator(f"get {word}")[0].partition("did you mean ")[2].rstrip("?") or None
        assert said == name, word
