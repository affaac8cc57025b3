# SPDX-License-Identifier: MIT
"""One measurement for all tests of a session, however many processes run them."""
import fcntl
import json

import pytest

from bench.measure import measure_as_built, measure_ends, measure_variants, with_ends
from launcher.paths import build_dir


def _measured(folder):
    """{part: rows}. Every process of this session begins with what no other has begun, and waits for the rest in the end."""
    parts = {"as built": measure_as_built, "ends": measure_ends, "variants": measure_variants,
             "another seed": lambda: measure_as_built(seed=2)}
    for how in (fcntl.LOCK_NB, 0):
        for name, part in parts.items():
            with open(folder / f"bench {name}.lock", "w") as lock:
                try:
                    fcntl.flock(lock, fcntl.LOCK_EX | how)
                except BlockingIOError:
                    continue
                made = folder / f"bench {name}.json"
                if not made.is_file():
                    made.write_text(json.dumps(part()))
    return {name: json.loads((folder / f"bench {name}.json").read_text()) for name in parts}


@pytest.fixture(scope="session")
def measured(tmp_path_factory, request):
    alone = not hasattr(request.config, "workerinput")
    base = tmp_path_factory.getbasetemp()
    parts = _measured(base if alone else base.parent)
    own = with_ends({**parts["as built"], **parts["variants"]}, parts["ends"])
    (build_dir() / "bench.json").write_text(json.dumps(own, indent=1) + "\n")
    return {"1": own, "2": parts["another seed"]}


@pytest.fixture(scope="session")
def bench(measured):
    return measured["1"]
