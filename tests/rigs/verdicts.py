# SPDX-License-Identifier: MIT
"""What of a run's figures is beyond its limit."""
from launcher.report import value_text


def verdicts(result):
    return [f"{f.name}: {value_text(f)}, limit {f.limit_text}" for f in result.figures.values() if f.passed is False]
