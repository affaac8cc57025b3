# SPDX-License-Identifier: MIT
"""The spread in pictures: one page a scenario, one panel a figure, one dot a run, the limit as a line."""
import math

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402  (after the backend is chosen)

COLUMNS = 3
BLUE, RED, GREY = "#1f4e9c", "#c0392b", "#888888"


def draw_scenario(scenario, outcomes, path):
    """Every numeric figure of the scenario over the motors. Nothing is drawn when there is none."""
    panels = _panels(scenario, outcomes)
    if not panels:
        return False
    motors = sorted({case.motor for case in outcomes if case.scenario == scenario})
    rows = math.ceil(len(panels) / COLUMNS)
    figure, axes = plt.subplots(rows, COLUMNS, figsize=(15, 3.1 * rows), squeeze=False, constrained_layout=True)
    for axis in axes.flat[len(panels):]:
        axis.set_axis_off()
    for axis, ((name, unit), dots) in zip(axes.flat, panels.items()):
        _panel(axis, f"{name} / {unit}" if unit else name, dots, motors)
    figure.suptitle(f"{scenario}: a dot is a run, red ones are beyond their limit")
    figure.savefig(path, dpi=80)
    plt.close(figure)
    return True


def _panels(scenario, outcomes):
    """{(figure, unit): [(motor, figure)]} of everything that is a number."""
    panels = {}
    for case, outcome in outcomes.items():
        for entry in outcome["figures"] if case.scenario == scenario else []:
            if isinstance(entry["value"], (int, float)):
                panels.setdefault((entry["name"], entry["unit"]), []).append((case.motor, entry))
    return panels


def _panel(axis, title, dots, motors):
    for number, motor in enumerate(motors):
        of_motor = [entry for name, entry in dots if name == motor]
        spread = [number + 0.5 * ((k + 0.5) / len(of_motor) - 0.5) for k in range(len(of_motor))]
        axis.scatter(spread, [entry["value"] for entry in of_motor], s=14,
                     color=[RED if entry["passed"] is False else BLUE for entry in of_motor])
        for key in ("min", "max"):
            limits = {entry[key] for entry in of_motor if entry[key] is not None}
            for limit in limits:
                axis.plot([number - 0.4, number + 0.4], [limit, limit], color=GREY, linewidth=1)
    axis.set_title(title, fontsize=9)
    axis.set_xticks(range(len(motors)), motors, rotation=60, ha="right", fontsize=6)
    axis.tick_params(axis="y", labelsize=7)
    axis.grid(True, axis="y", color="#dddddd", linewidth=0.6)
    axis.set_axisbelow(True)
