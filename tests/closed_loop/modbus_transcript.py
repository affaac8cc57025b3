# SPDX-License-Identifier: MIT
"""A session with mbpoll against the running drive, as docs/modbus.md shows it: what is typed, and what comes back."""
import re
import subprocess
import time
from dataclasses import dataclass

from launcher.qemu import progress_s

from rows import param_rows

SHOWN_PORT = "/dev/ttyUSB0"
COMMON = "mbpoll -m rtu -a 1 -b 19200 -P even -0 -1 -o 5"
PARAMS = 4096
SILENCE_MS = 4000
ATTEMPTS = 10
AT_REST = 10000  # 0.001 rpm: nothing is stored while it turns
# measured values are shown rounded: register -> to what
ROUNDED = {18: 20000, 28: 1000, 82: 1000, 84: 20000, 80: 500, 78: 500}


@dataclass
class Step:
    """Options and values for mbpoll; what comes before: `until` (register, mask, value), the drive's silence, or rest."""
    what: str
    options: str
    values: str = ""
    until: tuple = ()
    silent_s: float = 0.0
    at_rest: bool = False


def param(name):
    return PARAMS + 2 * list(param_rows()).index(name)


def steps():
    ramp, i_max, silence = param("ramp_rpm_s"), param("i_max_ma"), param("command_timeout_ms")
    return [
        Step("Identify: object 0x1000, a servo drive of CiA 402", "-t 4:hex -r 128 -c 2"),
        Step("Configure: ramp_rpm_s, command_timeout_ms, and the reaction to its fault: off", f"-t 4:int -B -r {ramp}", "3000"),
        Step("", f"-t 4:int -B -r {silence}", str(SILENCE_MS)),
        Step("", f"-r {0x400 + fault('COMMAND_TIMEOUT')}", "0"),
        Step("", f"-t 4:int -B -r {ramp} -c 1"),
        Step("Several are whole or nothing: i_max_ma does not go with that i_trip_ma", f"-t 4:int -B -r {i_max}",
             "14000 14000"),
        Step("", f"-t 4:int -B -r {i_max} -c 2"),
        Step("Half of a value is refused", "-r 2 -c 1"),
        Step("Run: shutdown, switch on, target 1500 rpm, enable operation", "-r 0", "6"),
        Step("", "-r 0", "7"),
        Step("", "-t 4:int -B -r 2", "1500"),
        Step("", "-r 0", "15"),
        Step("Read: status word (target reached), then the speed in 0.001 rpm", "-t 4:hex -r 16 -c 1",
             until=(16, 0x0427, 0x0427)),
        Step("", "-t 4:int -B -r 18 -c 1"),
        Step(f"Fault: nobody speaks for more than {SILENCE_MS} ms; status word, error code, and the snapshot's speed",
             "-t 4:hex -r 16 -c 1", silent_s=SILENCE_MS / 1000 + 1),
        Step("", "-t 4:hex -r 23 -c 1"),
        Step("", "-t 4:int -B -r 84 -c 1"),
        Step("Clear: an edge of bit 7", "-r 0", "128"),
        Step("", "-t 4:hex -r 16 -c 1", until=(16, 0x4F, 0x40)),
        Step("Keep the parameters", "-t 4:hex -r 192", "0x6576 0x6173", at_rest=True),
    ]


def fault(name):
    from rows import faults
    return faults()[name].number


def ask(port, step):
    """The lines of mbpoll's answer: values, "Written ...", or why not. As a master asks again: the twin may be paused longer
    than mbpoll waits."""
    for _ in range(ATTEMPTS):
        done = subprocess.run([*COMMON.split(), *step.options.split(), port, *step.values.split()], capture_output=True,
                              text=True, timeout=120, check=False)
        lines = re.findall(r"(?m)^(?:\[\d+\]:.*|Written .*|.*failed.*)$", done.stdout + done.stderr)
        if not any("timed out" in line for line in lines):
            break
    return lines


def _rounded(line):
    match = re.fullmatch(r"\[(\d+)\]:\s*(\S+)", line)
    if not match:
        return line.strip()
    register, value = int(match[1]), match[2]
    if register in ROUNDED:
        value = str(round(int(value) / ROUNDED[register]) * ROUNDED[register])
    return f"[{register}]: {value}"


def _wait(port, step, progress):
    if step.silent_s:
        over_s = progress_s(progress) + step.silent_s
        while progress_s(progress) < over_s:
            time.sleep(0.05)
    while step.at_rest and abs(int(ask(port, Step("", "-t 4:int -B -r 18 -c 1"))[0].split()[-1])) > AT_REST:
        time.sleep(0.2)
    while step.until:
        register, mask, value = step.until
        (line,) = ask(port, Step("", f"-t 4:hex -r {register} -c 1"))
        if int(line.split()[-1], 16) & mask == value:
            return
        time.sleep(0.2)


def transcript(port, progress):
    """The whole session as text."""
    lines = []
    for step in steps():
        _wait(port, step, progress)
        lines += [f"# {step.what}"] if step.what else []
        lines.append(" ".join(f"{COMMON} {step.options} {SHOWN_PORT} {step.values}".split()))
        lines += ["    " + _rounded(line) for line in ask(port, step)]
    return "\n".join(lines) + "\n"
