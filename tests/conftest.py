# SPDX-License-Identifier: MIT
"""Where everything is: tests run from the repository's root, products are in $BUILD, the launcher is a package in qemu/."""
import gc
import itertools
import os
import sys
from pathlib import Path

SHORT = "tests/unit/"
ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "qemu"))
os.chdir(ROOT)
os.environ.setdefault("BUILD", "build")
gc.set_threshold(100_000, 20, 100)  # of thousands of tests, all of which stay, looked through for garbage

from unit import register_pages  # noqa: E402  (the path must be set first)

register_pages.keep_free()  # before a heap that grows reaches them


def pytest_addoption(parser):
    parser.addoption("--sample", action="store_true",
                     help="without what is marked `rest`: more motors, rates and cases of what is there already")


def pytest_configure(config):
    config.addinivalue_line("markers", "rest: more of what other tests show; `make test ALL=1`, and so .ci/run, has it")


def pytest_collection_modifyitems(config, items):
    if config.getoption("--sample"):
        left_out = [item for item in items if item.get_closest_marker("rest")]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not item.get_closest_marker("rest")]
    items[:] = _mixed(items)


def _mixed(items):
    """The files with many short tests between the others: xdist's first portions, each of so many neighbours, must not be the
    longest, or one worker is left with its own when all others have ended."""
    files = [list(group) for _, group in itertools.groupby(items, key=lambda item: item.nodeid.split("::")[0])]
    short = [file for file in files if file[0].nodeid.startswith(SHORT)]
    long = [file for file in files if not file[0].nodeid.startswith(SHORT)]
    places = [((n + 0.5) / len(group), file) for group in (short, long) for n, file in enumerate(group)]
    return [item for _, file in sorted(places, key=lambda place: place[0]) for item in file]
