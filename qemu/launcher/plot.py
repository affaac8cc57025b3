# SPDX-License-Identifier: MIT
"""run.png: the run on one page, the plant's truth beside what the firmware believes, and a few turns enlarged, or the current's
largest step where the shaft is held, or the responses that were swept. For README in landscape: what happens once the drive is
in operation."""
from types import SimpleNamespace

import numpy as np
from matplotlib.figure import Figure  # not pyplot, which is for windows and takes as long again to import

from .errors import LauncherError
from .expression import number
from .kinds_sweep import sweep
from .trace import Trace

POINTS = 3000  # drawn per curve; more would not be visible
BLUE, ORANGE, GREEN, RED, GREY = "#1f4e9c", "#e07b00", "#2a8f4f", "#c0392b", "#888888"
PHASES = (("a", RED), ("b", GREEN), ("c", BLUE))


def draw(result, path):
    """Writes the figure to `path`."""
    trace, drive = result.trace, result.drive
    figure = Figure(figsize=(13, 17), layout="constrained")
    grid = figure.add_gridspec(7, 2, height_ratios=[1.25, 1, 1.1, 1, 0.7, 0.8, 1.1])
    figure.suptitle(f"{result.scenario.title}\n{drive.motor.name} on {drive.inverter.name}", fontsize=13)
    whole = None
    for row, plot in enumerate((_speed, _torque, _currents_dq, _currents_abc, _bus, _duty)):
        axis = figure.add_subplot(grid[row, :], sharex=whole)
        whole = whole or axis
        plot(axis, trace, drive)
        _dress(axis)
        axis.tick_params(labelbottom=row == 5)
        _mark_off(axis, trace)
    whole.set_xlim(trace["t_s"][0], trace["t_s"][-1])
    axis.set_xlabel("time / s")
    below = [figure.add_subplot(grid[6, column]) for column in (0, 1)]
    if loops := _swept(result):
        _bode(*below, loops)
    else:
        _enlarged(below, trace, drive, result.scenario.names.get("started", 0.0))
    figure.savefig(path, dpi=100)


def _enlarged(axes, trace, drive, from_s):
    near, held = _loaded_stretch(trace, drive, from_s)
    for axis, plot in zip(axes, (_currents_dq if held else _currents_abc, _duty)):
        plot(axis, near, drive)
        _dress(axis)
        axis.set_xlabel(f"time / s, enlarged at {near['t_s'][0]:.3f} s")


def _swept(result):
    """{axis: Loop} of the current loop that a scenario's figures measure by swept sine."""
    run = SimpleNamespace(trace=result.trace, steps=result.scenario.steps)
    windows = {entry["axis"]: [number(entry[key], result.scenario.names) for key in ("from_s", "to_s")]
               for entry in result.scenario.figures if str(entry.get("kind")).startswith("sweep_")}
    try:
        return {axis: sweep(run, axis, *window) for axis, window in windows.items()}
    except LauncherError:  # the figures say why
        return {}


def _bode(gain, phase, loops):
    for (name, loop), color in zip(loops.items(), (BLUE, RED)):
        gain.semilogx(loop.hz, 20 * np.log10(np.abs(loop.closed)), ".-", color=color, label=f"i_{name}, closed loop")
        phase.semilogx(loop.hz, np.degrees(np.unwrap(np.angle(loop.closed))), ".-", color=color, label=f"i_{name}")
    for axis, level, text in ((gain, -3, "gain / dB"), (phase, -90, "phase / deg")):
        axis.axhline(level, color=GREY, linewidth=0.6, linestyle=":")
        axis.set_ylabel(text)
        axis.set_xlabel("frequency / Hz")
        _dress(axis)
        axis.legend(loc="lower left", fontsize=8)


def draw_wide(result, path):
    """Speed, torque and currents from the label `up` on, and a few turns of the phase currents beside them."""
    drive = result.drive
    rows = result.trace["t_s"] >= result.scenario.names["up"]
    trace = Trace({name: column[rows] for name, column in result.trace.items()})
    figure = Figure(figsize=(12, 5.4), layout="constrained")
    grid = figure.add_gridspec(3, 3)
    figure.suptitle(f"{drive.motor.name}: {result.scenario.title}", fontsize=13)
    for row, plot in enumerate((_speed, _torque, _currents_dq)):
        axis = figure.add_subplot(grid[row, :2])
        plot(axis, trace, drive)
        _dress(axis)
        axis.tick_params(labelbottom=row == 2)
    axis.set_xlabel("time / s")
    near, _ = _loaded_stretch(trace, drive, 0.0)
    for place, plot in ((grid[:2, 2], _currents_abc), (grid[2, 2], _duty)):
        axis = figure.add_subplot(place)
        plot(axis, near, drive)
        _dress(axis)
    axis.set_xlabel("time / s, enlarged")
    figure.savefig(path, dpi=100)


def _dress(axis):
    axis.grid(True, color="#dddddd", linewidth=0.6)
    axis.margins(x=0)
    axis.legend(loc="upper right", ncol=4, fontsize=8, framealpha=0.9)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)


STEP_S = 0.01  # shown of a step of the current
HELD_W = 1e-6  # a shaft that is held takes no power


def _loaded_stretch(trace, drive, from_s):
    """(rows, False): about three electrical turns (5...100 ms) from where the most steady power flows, in operation; or (rows,
    True), where the shaft is held: around the largest step up of the current's reference."""
    rows = trace.rows
    block = max(1, min(1000, rows // 4))
    count = rows // block
    power = np.abs(trace["torque_Nm"] * trace["speed_rad_s"])[:count * block].reshape(count, block).min(axis=1)
    power[trace["t_s"][:count * block:block] < from_s] = 0.0
    best = int(power.argmax()) * block
    dt = trace["t_s"][1] - trace["t_s"][0]
    step = np.diff(np.abs(trace["i_q_ref_A"])) * (trace["t_s"][1:] >= from_s)
    if power.max() < HELD_W and step.max() > 0:
        first = max(0, int(step.argmax()) - int(0.2 * STEP_S / dt))
        return Trace({name: column[first:first + int(STEP_S / dt)] for name, column in trace.items()}), True
    turns_s = abs(trace["speed_rad_s"][best]) * drive.motor["electrical"]["pole_pairs"] / (2 * np.pi)
    wanted = 3 / turns_s if turns_s > 0 else 0.1
    first = min(best, rows - 2)
    last = min(rows, first + max(2, int(min(max(wanted, 0.005), 0.1) / dt)))
    return Trace({name: column[first:last] for name, column in trace.items()}), False


def _line(axis, trace, column, label, color, **style):
    """A curve; where samples are denser than pixels, the band between their extremes."""
    t, y = trace["t_s"], trace[column] if isinstance(column, str) else column
    step = max(1, len(t) // POINTS)
    rows = len(t) // step
    if step == 1:
        axis.plot(t, y, color=color, label=label, linewidth=1.0, **style)
        return
    blocks = y[:rows * step].reshape(rows, step)
    low, high, middle = blocks.min(axis=1), blocks.max(axis=1), blocks.mean(axis=1)
    starts = t[:rows * step:step]
    if np.max(high - low) > 0.01 * max(np.max(np.abs(y)), 1e-12):
        axis.fill_between(starts, low, high, color=color, alpha=0.25, linewidth=0)
    axis.plot(starts, middle, color=color, label=label, linewidth=1.0, **style)


def _wave(axis, trace, column, label, color):
    """A thin curve; where samples are denser than pixels, it goes from their one extreme to the other."""
    t, y = trace["t_s"], trace[column]
    step = max(1, len(t) // POINTS)
    if step > 1:
        rows = len(t) // step
        blocks, t = y[:rows * step].reshape(rows, step), np.repeat(t[:rows * step:step], 2)
        y = np.stack([blocks.min(axis=1), blocks.max(axis=1)], axis=1).ravel()
    axis.plot(t, y, color=color, linewidth=0.6, label=label)


def _speed(axis, trace, drive):
    _line(axis, trace, "speed_ref_rpm", "reference", GREY, linestyle="--")
    _line(axis, trace, "speed_fw_rpm", "measured by the drive", ORANGE)
    _line(axis, trace, "speed_rpm", "true", BLUE)
    axis.set_ylabel("speed / rpm")


def _torque(axis, trace, drive):
    _line(axis, trace, "torque_Nm", "motor", BLUE)
    _line(axis, trace, "load_Nm", "load", ORANGE)
    rated = drive.motor["rating"]["rated_torque_nm"]
    axis.axhline(rated, color=GREY, linewidth=0.6, linestyle=":", label="rated")
    axis.axhline(-rated, color=GREY, linewidth=0.6, linestyle=":")
    axis.set_ylabel("torque / N m")


def _currents_dq(axis, trace, drive):
    _line(axis, trace, "i_q_true_A", "i_q true", BLUE)
    _line(axis, trace, "i_d_true_A", "i_d true", RED)
    _line(axis, trace, "i_q_ref_A", "i_q reference", "#0b2a5b", linestyle="--")
    _line(axis, trace, "i_d_ref_A", "i_d reference", "#6b1710", linestyle="--")
    limit = drive.params["i_max_ma"] / 1000
    axis.set_ylim(*_include(axis.get_ylim(), -limit / 10, limit / 10))
    axis.set_ylabel("d/q current / A")


def _include(limits, low, high):
    return min(limits[0], low), max(limits[1], high)


def _currents_abc(axis, trace, drive):
    for phase, color in PHASES:
        _wave(axis, trace, f"i_{phase}_A", f"i_{phase}", color)
    axis.set_ylabel("phase current / A")


def _bus(axis, trace, drive):
    _line(axis, trace, "vbus_V", "bus", BLUE)
    middle = drive.inverter["supply"]["vbus_v"]
    axis.set_ylim(*_include(axis.get_ylim(), 0.97 * middle, 1.03 * middle))
    axis.set_ylabel("bus voltage / V")


def _duty(axis, trace, drive):
    for phase, color in PHASES:
        _wave(axis, trace, f"duty_{phase}", f"d_{phase}", color)
    axis.set_ylim(-0.02, 1.02)
    axis.set_ylabel("duty")


def _mark_off(axis, trace):
    """Grey ground where the gates are not enabled."""
    off = np.concatenate([[False], trace["gate_live"] == 0, [False]])
    edges = np.flatnonzero(np.diff(off.astype(np.int8)))
    t = trace["t_s"]
    for start, end in zip(edges[::2], edges[1::2]):
        axis.axvspan(t[start], t[end - 1], color="#f0f0f0", zorder=0, linewidth=0)
