# SPDX-License-Identifier: MIT
"""`make pictures`: what a bandwidth does, and a wrong inertia, for docs/guides/tuning.md. Of runs with every effect on."""
import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402  (after the backend is chosen)

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "guides"
MOTOR = "teknic_m2310p"
COLOURS = ("#e07b00", "#1f4e9c", "#2a8f4f")


def picture(name, scenario, label, before_s, behind_s, column, ylabel, scale, variants):
    """One column of the trace around a step that the scenario labels, for each variant: (legend, arguments of simulate)."""
    from launcher import simulate
    figure, axis = plt.subplots(figsize=(7, 3), constrained_layout=True)
    for (legend, arguments), colour in zip(variants, COLOURS):
        with tempfile.TemporaryDirectory() as folder:
            result = simulate(scenario, MOTOR, out_dir=Path(folder), aligned=True, **arguments)
            trace, t = result.trace, result.trace["t_s"]
            zero_s = result.scenario.names[label]
            if column == "i_q_A":  # the step is when the line has been typed and taken
                asked = trace["i_q_ref_A"]
                before, behind = (asked[t > zero_s + later_s][0] for later_s in (-0.01, 0.02))
                zero_s = t[(t > zero_s - 0.01) & ((asked - before) / (behind - before) > 0.5)][0]
            near = (t > zero_s - before_s) & (t < zero_s + behind_s)
            axis.plot((t[near] - zero_s) * 1e3, trace[column][near] * scale, color=colour, linewidth=1, label=legend)
    axis.set_xlabel("time / ms")
    axis.set_ylabel(ylabel)
    axis.grid(color="#dddddd")
    axis.legend()
    figure.savefig(FOLDER / f"{name}.png", dpi=90, metadata={"Software": None})
    plt.close(figure)


def told(**params):
    return {"overrides": {"params": params}}


def main():
    sys.path[:0] = [str(ROOT / "qemu")]
    rpm = 60 / 6.2831853
    picture("speed_bw", "default", "load", 0.02, 0.15, "speed_rad_s", "speed / rpm", rpm,
            [(f"speed_bw_hz {hz}", told(speed_bw_hz=hz)) for hz in (15, 30, 60)])
    picture("inertia", "default", "load", 0.02, 0.15, "speed_rad_s", "speed / rpm", rpm,
            [(f"inertia_gmm2 told {share} x", {"detune": f"inertia_gmm2*{share}"}) for share in (0.3, 1, 3)])
    picture("current_bw", "current_step", "jump", 0.0005, 0.003, "i_q_A", "i_q / A", 1,
            [(f"current_bw_hz {hz}", told(current_bw_hz=hz)) for hz in (800, 1200, 1600)])


if __name__ == "__main__":
    main()
