# SPDX-License-Identifier: MIT
"""Finding QEMU, starting it with the twin, and watching it until the run ends."""
import ctypes
import functools
import os
import re
import select
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from .errors import LauncherError
from .paths import shown

MACHINE = "emcraft-sf2"
DEFAULT_QEMU = "qemu-system-arm"
STALL_S = 300.0  # wall time without progress after which a run is given up
FULL_BYTES = 1 << 20
LOOK_S = 0.1     # how often progress is read

_PR_SET_PDEATHSIG = 1
_LIBC = ctypes.CDLL(None)


class Qemu:
    """A checked qemu-system-arm."""

    def __init__(self, program=None):
        wanted = program or os.environ.get("QEMU") or DEFAULT_QEMU
        found = shutil.which(wanted)
        if found is None:
            raise LauncherError(f"QEMU '{wanted}' is not a program (apt-get install qemu-system-arm, or QEMU=path)")
        self.path = found
        status = os.stat(found)
        self.version = _checked_version(found, wanted, status.st_mtime_ns, status.st_size)

    @property
    def number(self):
        match = re.search(r"version (\S+)", self.version)
        return match.group(1) if match else self.version

    def data_arguments(self):
        """-L for a QEMU unpacked beside the installed one, whose firmware files lie in its own share/qemu."""
        return _data_arguments(self.path)

    def environment(self):
        """The same for its loadable modules: it would take the installed QEMU's, find that they do not fit, and abort."""
        return _environment(self.path)


def _prefix(path):
    return Path(path).resolve().parent.parent


def _unpacked(path):
    return _prefix(path) not in (Path("/usr"), Path("/usr/local"))


def _data_arguments(path):
    share = _prefix(path) / "share" / "qemu"
    return ["-L", str(share)] if _unpacked(path) and share.is_dir() else []


def _environment(path):
    modules = sorted(_prefix(path).glob("lib*/*/qemu")) if _unpacked(path) else []
    if not modules or "QEMU_MODULE_DIR" in os.environ:
        return None
    return {**os.environ, "QEMU_MODULE_DIR": str(modules[0])}


@functools.lru_cache
def _checked_version(path, wanted, *_file):
    """The first line of --version, from a program that turns out to be what is needed. Asked once for each file."""
    version = (_ask(path, "--version").splitlines() or [""])[0]
    if "QEMU emulator version" not in version:
        raise LauncherError(f"'{wanted}' is not a QEMU: its --version says '{version[:60]}'")
    if not re.search(rf"^{MACHINE}\s", _ask(path, "-M", "help"), re.MULTILINE):
        raise LauncherError(f"'{wanted}' does not know the machine {MACHINE}: is it qemu-system-arm?")
    return version


def _ask(path, *arguments):
    try:
        answer = subprocess.run([path, *_data_arguments(path), *arguments], stdin=subprocess.DEVNULL,
                                capture_output=True, text=True, timeout=STALL_S, check=False, env=_environment(path))
    except (OSError, subprocess.TimeoutExpired, UnicodeDecodeError) as error:
        raise LauncherError(f"cannot run '{path}': {error}") from error
    return (answer.stdout or answer.stderr).strip()


FABRICS = {"model": None, "rtl": ("fabric/axis.so", "fabric/axis_in_en.so")}  # by [bridge] in_en
PLANT_IN_RTL = "fabric/axis_plant.so"


def fabric_files(fabric, build, *drives):
    """The item of the twin's configuration for FABRIC=model or rtl."""
    if fabric not in FABRICS:
        raise LauncherError(f"FABRIC '{fabric}' is neither model, the twin's C models, nor rtl, the verilated RTL")
    if FABRICS[fabric] is None and any(drive.inverter["sensor"]["modulators"] for drive in drives):
        raise LauncherError("isolated modulators (SENSORS, [sensor] modulators) need FABRIC=rtl: the C models have none")
    if FABRICS[fabric] is None and any(drive.plant.in_rtl for drive in drives):
        raise LauncherError("PLANT=rtl, the motor in RTL, needs FABRIC=rtl: it is at the pins of the RTL")
    if FABRICS[fabric] is None:
        return {}
    if len(drives) > 1:
        raise LauncherError(f"FABRIC={fabric} has one axis only: two motors need FABRIC=model")
    in_en = drives[0].inverter["bridge"]["in_en"]
    if drives[0].plant.in_rtl and in_en:
        raise LauncherError("PLANT=rtl has six gates, and no drivers with an input and an enable for each leg")
    library = build / (PLANT_IN_RTL if drives[0].plant.in_rtl else FABRICS[fabric][in_en])
    if not library.is_file():
        raise LauncherError(f"{shown(library)} is missing: run make axis first (needs verilator and g++)")
    return {"fabric": library.resolve()}


CHIPS = ("m2s010", "m2s025")


def chip_items(chip, wired=""):
    """The items for CHIP=name and, where not as docs/fabric.md advises for it, for how the design has wired the fabric."""
    chip = chip or os.environ.get("CHIP") or CHIPS[0]
    if chip not in CHIPS:
        raise LauncherError(f"CHIP '{chip}' is neither m2s010, on which traffic on FIC_0 undoes changes, nor m2s025")
    return {"chip": chip, **({"fabric_wired": wired} if wired else {})}


def envm_files(path):
    """The item for ENVM=file: what the device keeps while it is off."""
    if not path:
        return {}
    if not Path(path).resolve().parent.is_dir():
        raise LauncherError(f"ENVM '{path}': there is no folder {shown(Path(path).resolve().parent)}")
    return {"envm": Path(path).resolve()}


class Image:
    """The products of a build that a run needs, each checked to be there."""

    def __init__(self, build):
        self.hex = self._present(build / "mssfoc.hex")
        self.elf = self._present(build / "mssfoc.elf")
        self.plugin = self._present(build / "qemu" / "twin.so")

    @staticmethod
    def _present(path):
        if not path.is_file():
            raise LauncherError(f"{shown(path)} is missing: run make first")
        return path


def escape(path):
    """A path as a value in QEMU's comma-separated options."""
    return str(path).replace(",", ",,")


def bus_chardev(place):
    """QEMU's options for the line of MMUART_1, and the item of the twin's configuration; both empty for nowhere.

    place   pty, a terminal that QEMU names when it starts, or tcp:PORT of 127.0.0.1
    """
    return (["-chardev", line_chardev(place, "bus", "MODBUS")], {"bus": "bus"}) if place else ([], {})


def line_chardev(place, name, variable):
    """QEMU's option for a serial line that a program is to have: at a terminal or at a port of 127.0.0.1."""
    kind, _, port = place.partition(":")
    if place == "pty":
        return f"pty,id={name}"
    if kind == "tcp" and port.isdigit() and 1 <= int(port) <= 65535:
        return f"socket,id={name},host=127.0.0.1,port={int(port)},server=on,wait=off"
    raise LauncherError(f"{variable} '{place}' is neither pty nor tcp:PORT")


# The design of a drive on a CAN bus: SOFT_RESET_CR with the controller released, as CAN switched on in the MSS has it
CAN_DESIGN = {"design 0x48": f"0x{0x07FFFFFF & ~(1 << 0 | 3 << 2 | 1 << 6 | 3 << 7 | 1 << 13 | 1 << 18 | 0x1F << 20):08x}"}


def command(qemu, image, config, console, extra=()):
    """The command line. The image is loaded from the very file that is flashed."""
    return [qemu.path, *qemu.data_arguments(), "-M", MACHINE, "-display", "none", "-monitor", "none",
            "-icount", "shift=3,sleep=off", "-chardev", console, "-serial", "chardev:console",
            "-plugin", f"file={escape(image.plugin)},config={escape(config)}",
            "-device", f"loader,file={escape(image.hex)}", *extra]


def start(arguments, environment, **files):
    """QEMU as a process that ends when the launcher does, however that ends."""
    launcher = os.getpid()

    def die_with_launcher():
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != launcher:  # it died before
            os._exit(1)

    try:
        return subprocess.Popen(arguments, env=environment, preexec_fn=die_with_launcher, **files)
    except OSError as error:
        raise LauncherError(f"cannot start {arguments[0]}: {error.strerror}") from error


def run_to_end(arguments, environment, end_s, progress_path, stderr_path, show=None):
    """Runs QEMU until the twin ends it, and raises with the reason of a failure.

    `show(now_s, end_s)` is called as it goes. `end_s` is when the run is planned to end: it may end earlier or later.
    """
    with open(stderr_path, "wb") as stderr:
        process = start(arguments, environment, stdin=subprocess.DEVNULL, stdout=stderr, stderr=stderr)
        try:
            _watch(process, end_s, progress_path, show)
        except BaseException:
            process.kill()
            process.wait()
            raise
    if process.returncode != 0:
        refuse_full_disk(Path(stderr_path).parent)
        raise LauncherError(f"{reason(process.returncode)}{tail(stderr_path)}")


def refuse_full_disk(folder):
    """What ended QEMU could not be written down either."""
    if shutil.disk_usage(folder).free < FULL_BYTES:
        raise LauncherError(f"the disk of {shown(folder)} is full: a run writes 17 MB for each second that it simulates;"
                            " BUILD=path is another place")


def _watch(process, end_s, progress_path, show):
    reached, since = -1.0, time.monotonic()
    descriptor = os.pidfd_open(process.pid)
    try:
        while not select.select([descriptor], [], [], LOOK_S)[0]:
            now_s = progress_s(progress_path)
            if now_s > reached:
                reached, since = now_s, time.monotonic()
            if show and end_s:
                show(max(reached, 0.0), end_s)
            if time.monotonic() - since > STALL_S:
                raise LauncherError(f"QEMU made no progress for {STALL_S:g} s after {max(reached, 0):.3f} s of simulated time")
    finally:
        os.close(descriptor)
    process.wait()


def progress_s(path):
    """Simulated seconds: the first number of the progress file's last whole line, -1 before there is one."""
    try:
        with open(path, "rb") as file:
            file.seek(0, os.SEEK_END)
            file.seek(max(0, file.tell() - 200))
            numbers = re.findall(rb"(?m)^\D*?(\d+(?:\.\d+)?)", file.read())
        return float(numbers[-1]) if numbers else -1.0
    except (OSError, ValueError):
        return -1.0


def reason(status):
    """Why QEMU is not there any more."""
    if status in (-signal.SIGABRT, 134):
        return "QEMU aborted (status 134): the processor locked up, or QEMU met an error of its own"
    if status < 0:
        return f"QEMU was ended by signal {signal.Signals(-status).name}"
    return f"QEMU ended with status {status}"


def tail(path, lines=6):
    """The last lines of what QEMU and the twin wrote, to stand under the reason."""
    try:
        text = Path(path).read_text(errors="replace")
    except OSError:
        return ""
    last = [line for line in text.splitlines() if line.strip()][-lines:]
    return "".join(f"\n  | {line}" for line in last)


class ProgressLine:
    """One line on a terminal, rewritten; on anything else a word every quarter."""

    def __init__(self, label, stream=None):
        self.label, self.stream = label, stream or sys.stderr
        self.live = self.stream.isatty()
        self.quarter = 0

    def __call__(self, now_s, end_s):
        if self.live:
            bar = "#" * min(30, int(now_s / end_s * 30))
            self.stream.write(f"\r{self.label} [{bar:<30}] {now_s:.2f} of {end_s:.2f} s simulated ")
            self.stream.flush()
        elif int(now_s / end_s * 4) > self.quarter:
            self.quarter = int(now_s / end_s * 4)
            self.stream.write(f"{self.label}: {now_s:.2f} of {end_s:.2f} s simulated\n")
            self.stream.flush()

    def done(self):
        """Leaves the line."""
        if self.live:
            self.stream.write("\r\033[K")
            self.stream.flush()
