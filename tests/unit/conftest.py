# SPDX-License-Identifier: MIT
"""The firmware's rooms as shared libraries of this machine (unit.mk)."""
import ctypes

import hypothesis
import pytest

from rigs.console import Operator
from rigs.controller import Controller
from rigs.device import Device
from rigs.drive import World
from rigs.firmware import built
from rigs.identify_alone import begin
from rigs.motor import Motor
from rigs.observer_model import chords
from rigs.scoped import Scoped
from rigs.searching import Searching
from unit.cinterface import Library
from unit.register_pages import NO_ACCESS, PAGES, READ_WRITE, protect


# the same numbers every time, and no verdict that depends on how fast they come
hypothesis.settings.register_profile("unit", deadline=None, derandomize=True, database=None, suppress_health_check=list(
    hypothesis.HealthCheck))
hypothesis.settings.load_profile("unit")


@pytest.fixture(autouse=True)
def let_go():
    """Of every test: whatever was called, the interrupts that it masked are masked no more."""
    yield
    for library in (one for one in Library.loaded if hasattr(one, "host_primask")):  # the drive's, not the plant's
        held = library.host_primask.value, library.host_basepri.value
        library.host_primask.value = library.host_basepri.value = 0
        assert held == (0, 0), "interrupts are still masked (PRIMASK, BASEPRI)"


@pytest.fixture(scope="session")
def system():
    """The device's side: registers stand at their own addresses, so that no test may forget to map them (test_system.py)."""
    return Library(built("system.so"))


@pytest.fixture(scope="session")
def two_axes():
    """The same for a device with two motors."""
    return Library(built("two_axes.so"))


@pytest.fixture(scope="session")
def two_buses():
    """As `c`, for a device with two motors."""
    library = Library(built("two_axes_buses.so"))
    library.motors = 2
    return library


@pytest.fixture(scope="module")
def memory():
    """The registers' addresses can be used: nothing stands there at first."""
    protect(READ_WRITE)
    for page in PAGES:
        ctypes.memset(page, 0, 4096)
    yield
    protect(NO_ACCESS)


@pytest.fixture(scope="session")
def c():
    """Everything the firmware's headers declare: structures, enums, functions."""
    return Library(built("firmware.so"))


# ---- rigs, new for each test; those with arguments are made by the test ----

@pytest.fixture
def world(c):
    return lambda state=None: World(c).put(state) if state else World(c)


@pytest.fixture
def operator(c):
    return Operator(c)


@pytest.fixture
def scoped(c):
    return Scoped(c)


@pytest.fixture
def motor(c):
    return lambda *args, **params: Motor(c, *args, **params)


@pytest.fixture
def plc(c):
    """Whatever it does to its own axis, the other one knows nothing of it."""
    made = Controller(c)
    before = made.others()
    yield made
    assert made.others() == before


@pytest.fixture
def device(system, memory):
    return Device(system)


@pytest.fixture
def begun(c):
    return begin(c)


@pytest.fixture
def searching(c):
    return Searching(c)


@pytest.fixture(scope="session")
def table(c):
    return chords(c)
