# SPDX-License-Identifier: MIT
"""The library, built for the host, for all tests of this folder."""
import pytest
from binding import Library
from host_build import HERE, KERNELS, LIBRARY, build_dir, compile_host
from hypothesis import settings

settings.register_profile("mssfoc", deadline=None, derandomize=True, database=None, max_examples=200)
settings.load_profile("mssfoc")


@pytest.fixture(scope="session")
def library_for():
    """library_for(frac): the library, built with LIB_TRIG_FRAC = frac, through ctypes."""
    loaded = {}

    def load(frac):
        if frac not in loaded:
            target = compile_host(build_dir() / f"liblib{frac}.so", [HERE / "shim.c", KERNELS, *LIBRARY],
                                  ["-O2", "-fPIC", "-shared", f"-DLIB_TRIG_FRAC={frac}"])
            loaded[frac] = Library(target)
        return loaded[frac]

    return load


@pytest.fixture(scope="session")
def lib(library_for):
    return library_for(15)
