# SPDX-License-Identifier: MIT
"""What the processor spends its time on: the twin's log of interrupts, summed up by who they belong to."""
from dataclasses import dataclass

import numpy as np

from .errors import LauncherError
from .paths import shown
from .recording import read_recording

CORE_HZ = 100e6  # docs/fabric.md: core, fabric and PWM run on one clock
CURRENT_LOOP, SLOW_LOOP = 50, 30  # exception numbers: FabricIrq0 and Timer1, 16 beyond their interrupts' numbers
SECOND_LOOP = CURRENT_LOOP + 1    # FabricIrq1
COLUMNS = ("t_s", "exception", "start_ns", "start_pwm_ns", "cycles", "instructions", "latency_cycles", "preempted_cycles",
           "cycles_low", "chained")


def load_irqlog(path):
    """{column: array} of the twin's irqlog (qemu/twin/irqlog.h), one row for each exception that has returned."""
    log = read_recording(path, "log of interrupts")
    if tuple(log) != COLUMNS:
        raise LauncherError(f"{shown(path)} has other columns than {','.join(COLUMNS)}")
    return log


@dataclass
class Share:
    """Percent of the core's time, and cycles of one run through it (entry and exit included, without who interrupts it)."""
    percent: float
    mean_cycles: float
    max_cycles: int
    count: int


@dataclass
class Load:
    """Shares of the time from the first current-loop interrupt to the last."""
    pwm_hz: float
    current_loop: Share
    slow_loop: Share
    other_interrupts: Share  # the console's
    latency_max_cycles: int  # exception entry to the last PWM write
    second_loop: Share = None  # of axis 2; None where there is none

    @property
    def rest_percent(self):
        """What is left for the thread, and for features to come."""
        return 100 - sum(part.percent for part in (*self.loops, self.slow_loop, self.other_interrupts))

    @property
    def loops(self):
        return [loop for loop in (self.current_loop, self.second_loop) if loop]

    @property
    def highest_pwm_hz(self):
        """At which the longest current-loop interrupt still fits in half a period; of two motors, one of each."""
        return CORE_HZ / (2 * sum(loop.max_cycles for loop in self.loops))


def cpu_load(log, pwm_period_s):
    """The Load of a run, or None when the current loop never ran."""
    current = log["exception"] == CURRENT_LOOP
    if current.sum() < 2:
        return None
    times = log["t_s"][current]
    inside = (log["t_s"] >= times.min()) & (log["t_s"] < times.max())
    cycles_in_all = (times.max() - times.min()) * CORE_HZ
    slow, second = log["exception"] == SLOW_LOOP, log["exception"] == SECOND_LOOP

    def share(which):
        cycles = log["cycles"][which & inside]
        if len(cycles) == 0:
            return Share(0.0, 0.0, 0, 0)
        return Share(100 * float(cycles.sum()) / cycles_in_all, float(cycles.mean()), int(cycles.max()), len(cycles))

    return Load(1 / pwm_period_s, share(current), share(slow), share(~current & ~second & ~slow),
                int(log["latency_cycles"][current | second].max()), share(second) if second.any() else None)


def load_lines(load):
    """The lines of the report."""
    if load is None:
        return ["CPU load: the current loop did not run"]
    period = CORE_HZ / load.pwm_hz
    lines = [f"CPU load at {load.pwm_hz / 1e3:.4g} kHz PWM ({CORE_HZ / 1e6:g} MHz core, {period:.0f} cycles a period)"]
    names = ["current loop"] if load.second_loop is None else ["current loop", "of axis 2"]
    for name, part in (*zip(names, load.loops), ("slow loop", load.slow_loop), ("console", load.other_interrupts)):
        lines.append(f"  {name:<14}{part.percent:6.2f} %   {part.mean_cycles:.0f} cycles, at most {part.max_cycles},"
                     f" {part.count} interrupts")
    lines.append(f"  {'rest':<14}{load.rest_percent:6.2f} %")
    fits = "the current loop fits" if load.second_loop is None else "one of each current loop fits"
    lines.append(f"  {fits} in half a period up to {load.highest_pwm_hz / 1e3:.1f} kHz PWM"
                 f" (PWM written {load.latency_max_cycles} cycles after exception entry at the latest)")
    return lines


def load_values(load):
    """The same for report.json."""
    if load is None:
        return None
    values = {name: vars(getattr(load, name)) for name in ("current_loop", "slow_loop", "other_interrupts")}
    if load.second_loop is not None:
        values["second_loop"] = vars(load.second_loop)
    return {"core_hz": CORE_HZ, "pwm_hz": load.pwm_hz, **values, "rest_percent": load.rest_percent,
            "latency_max_cycles": load.latency_max_cycles, "highest_pwm_hz": load.highest_pwm_hz}
