# SPDX-License-Identifier: MIT
"""A run at whose console lines are typed at their times, and what the drive has answered."""
from launcher import simulate


def play(tmp_path, steps, end_s, **more):
    plan = {"key": "scope", "end_s": end_s, "preamble_s": 0.02, "expect_refusal": ".*",
            "step": [{"t_s": t, **({"console": what} if isinstance(what, str) else what)} for t, what in steps]}
    return simulate(plan, out_dir=tmp_path, plant="ideal", spread=0, aligned=True, **more)


def answer(console, line):
    return console.split(f"> {line}\n", 1)[1].split("\n> ", 1)[0].split("\n")
