# SPDX-License-Identifier: MIT
"""The firmware at other PWM rates and dead times: one build folder for each, below the one in use, with the same twin."""
import fcntl
import os
import shutil
import subprocess
from pathlib import Path

RATES_HZ = (8000, 10000, 16000, 20000, 40000)
OWN_HZ = 20000  # of firmware/settings/rates.h: the ordinary build is this one


def overrides(hz):
    """For simulate() and load_drive(): bandwidths that a slow sample rate leaves their phase margin."""
    return {"params": {"current_bw_hz": min(1000, hz // 20), "speed_bw_hz": 60 if hz >= OWN_HZ else 40}}


def make(build, *targets, **choices):
    """The finished `make -s TARGETS` into a folder, with what is chosen on its command line (PWM_HZ, DEAD_TIME_NS)."""
    env = {key: value for key, value in os.environ.items() if not key.startswith("MAKE")}
    words = [f"BUILD={build}", *(f"{name}={value}" for name, value in choices.items())]
    return subprocess.run(["make", "-s", "-j2", *words, *(f"{build}/{target}" for target in targets)], env=env,
                          capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)


def build_of(hz, *targets, folder="", **choices):
    """The build folder of a rate, and of what else is chosen on make's command line, with these products in it, as absolute
    path; `folder`: its name, where the choices do not make one. One process at a time: tests of several files, and so of
    several workers, want the same folder."""
    own = Path(os.environ.get("BUILD", "build"))
    name = folder or "-".join([str(hz), *(f"{key}{value}" for key, value in choices.items())])
    build = own if name == str(OWN_HZ) else own / "rates" / name
    build.mkdir(parents=True, exist_ok=True)
    with open(build / "one_at_a_time", "w", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return _built(own, build, targets, {"PWM_HZ": "" if hz == OWN_HZ else hz, **choices})


def _built(own, build, targets, choices):
    done = make(build, *targets, **choices)
    if done.returncode != 0:
        raise AssertionError(f"the build in {build.name} failed: {done.stderr[-2000:]}")
    twin = build / "qemu"
    if build != own and not twin.is_symlink():
        shutil.rmtree(twin, ignore_errors=True)  # of a `make` by hand: it may be old
        twin.symlink_to((own / "qemu").resolve())
    return build.resolve()
