# SPDX-License-Identifier: MIT
"""`make console`: a running drive in real time, its console in this terminal.  `make debug`: halted, for a debugger."""
import subprocess
import sys
from dataclasses import replace

from .config import twin_config
from .drive import load_drive
from .errors import LauncherError
from .paths import build_dir, shown
from .probes import Symbols
from .qemu import Image, Qemu, command
from .scenario import Scenario, load_scenario
from .simulate import check_seed, prepare, write

PREAMBLE_S = 0.05


def live_console(motor, seed, build=None, qemu=None, scenario=None):
    """Runs until the user ends it. Returns the exit status of QEMU."""
    drive, arguments, environment = _prepared(motor, seed, build, qemu, scenario, realtime=True)
    print(f"{drive.motor.name} on {drive.inverter.name}, in real time. Its parameters are typed for you; then try:\n"
          "  on     (wait a second)     speed 1500     status     speed 0     off     help\n"
          "To leave: Ctrl-A, then x.\n", flush=True)
    return _run(arguments, environment)


def debug_session(motor, seed, build=None, qemu=None, scenario=None, port=1234):
    """QEMU halted at the reset vector with a GDB port; prints how to attach."""
    if not 1 <= port <= 65535:
        raise LauncherError(f"port {port} is outside 1..65535")
    _, arguments, environment = _prepared(motor, seed, build, qemu, scenario, realtime=False,
                             extra=["-S", "-gdb", f"tcp:127.0.0.1:{port}"])
    elf = shown(build_dir(build) / "mssfoc.elf")
    print(f"Halted at the reset vector. Attach from another terminal:\n"
          f"  gdb-multiarch {elf} -ex 'target remote :{port}'\n"
          "then for example:  break main   continue   print current_loop   info registers\n"
          "Simulated time stands still while the target is halted, so the motor waits for you.\n"
          "The console is in this terminal. To leave: Ctrl-A, then x.\n", flush=True)
    return _run(arguments, environment)


def _prepared(motor, seed, build, qemu, scenario, realtime, extra=()):
    drive = load_drive(motor)
    if scenario:
        plan = replace(load_scenario(scenario, drive), end_s=None)
    else:
        plan = Scenario("live", "live console", None, PREAMBLE_S, [], [])
    build = build_dir(build)
    checked, image = Qemu(qemu), Image(build)
    out_dir = build / "console"
    prepare(out_dir)
    config = out_dir / "twin.cfg"
    write(config, twin_config(drive, plan, check_seed(seed), [], {}, Symbols(image.elf)))
    line = command(checked, image, config, "stdio,id=console,mux=on,signal=off", realtime, extra)
    return drive, line, checked.environment()


def _run(arguments, environment):
    try:
        return subprocess.run(arguments, check=False, env=environment).returncode
    except KeyboardInterrupt:
        return 130
    except OSError as error:
        raise LauncherError(f"cannot start {arguments[0]}: {error.strerror}") from error
    finally:
        if sys.stdout.isatty():
            print()
