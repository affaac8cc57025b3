// SPDX-License-Identifier: MIT
// Plots of signals against time, one for each unit, below each other with one zoom.
"use strict";

const POINTS = 700;      // drawn of each signal; a download has them all
const LEAST_STEPS = 512; // of a raw value, that a plot of what is measured spans: a converter's last bits do not fill it
const MEASURED = ["A", "V", "rpm"];

const dark = matchMedia("(prefers-color-scheme: dark)");
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// What was made while it was hidden has got a size of its own, which it is to lose.
function fit(dygraph) {
  Object.assign(dygraph.maindiv_.style, { width: "", height: "" });
  dygraph.resize();
}

class Plots {
  constructor(place) {
    this.place = place;
    this.graphs = [];
    this.lines = {};  // colour's name: time of an upright line
    this.ranges = {}; // unit: [least, most], where not automatic
    this.onClick = () => {};
    dark.addEventListener("change", () => this.recolour());
  }

  // names of the columns behind the time, their units, and what a step of a raw value is
  layout(names, units, steps) {
    this.graphs.forEach((g) => g.dygraph.destroy());
    this.place.replaceChildren();
    this.graphs = [...new Set(units)].map((unit) => {
      const columns = names.map((_, k) => k).filter((k) => units[k] === unit);
      return { columns, unit, least: MEASURED.includes(unit) ? LEAST_STEPS * Math.max(...columns.map((k) => steps[k])) : 0,
        dygraph: this.graph(columns.map((k) => names[k]), unit) };
    });
    this.resize(); // the first had the whole place when it was made
    this.recolour();
  }

  isSeen() {
    return this.place.checkVisibility();
  }

  resize() {
    if (this.isSeen()) this.graphs.forEach(({ dygraph }) => fit(dygraph));
  }

  graph(names, unit) {
    const box = document.createElement("div"), legend = document.createElement("div"), curves = document.createElement("div");
    [box.className, legend.className, curves.className] = ["plot", "legend", "curves"];
    curves.setAttribute("role", "img");
    curves.setAttribute("aria-label", `${names.join(", ")}${unit ? ` in ${unit}` : ""} against time`);
    box.append(legend, curves);
    this.place.append(box);
    return new Dygraph(curves, [[0, ...names.map(() => 0)]], {
      labels: ["time", ...names], ylabel: unit, xlabel: "", legend: "always", labelsDiv: legend, animatedZooms: false,
      strokeWidth: 1.2, rightGap: 4, gridLineColor: "#8885", underlayCallback: (...drawn) => this.upright(...drawn),
      clickCallback: (event, time) => this.onClick(event, time),
      axes: { x: { axisLabelFormatter: (x) => `${+x.toFixed(4)} s`, valueFormatter: (x) => `${x.toFixed(5)} s` } },
    });
  }

  recolour() {
    for (const { columns, dygraph } of this.graphs) {
      dygraph.updateOptions({ colors: columns.map((_, k) => colour(`curve-${k + 1}`)), axisLineColor: colour("quiet") });
    }
  }

  upright(canvas, area, dygraph) {
    for (const [name, time] of Object.entries(this.lines)) {
      canvas.fillStyle = colour(name);
      canvas.fillRect(dygraph.toDomXCoord(time) - 1, area.y, 2, area.h);
    }
  }

  draw(rows) {
    if (!rows.length) return;
    const step = Math.max(1, Math.ceil(rows.length / POINTS));
    const shown = step === 1 ? rows : rows.filter((_, i) => i % step === 0);
    for (const { columns, unit, least, dygraph } of this.graphs) {
      const file = shown.map((row) => [row[0], ...columns.map((k) => row[k + 1])]);
      dygraph.updateOptions({ file, valueRange: this.ranges[unit] || spanned(file, least) });
    }
  }

  // Between two times, or all.
  zoom(times) {
    this.graphs.forEach(({ dygraph }) => dygraph.updateOptions({ dateWindow: times }));
  }
}

// Lowest and highest of all columns, apart at least so much, with some room.
function spanned(rows, least) {
  let low = Infinity, high = -Infinity;
  for (const row of rows) {
    for (let k = 1; k < row.length; k++) {
      if (row[k] < low) low = row[k];
      if (row[k] > high) high = row[k];
    }
  }
  const half = 0.54 * Math.max(high - low, least, 1e-9), middle = (low + high) / 2;
  return [middle - half, middle + half];
}

function table(names, units, rows) {
  const heading = ["time_s", ...names.map((n, k) => (units[k] ? `${n} [${units[k]}]` : n))];
  return [heading, ...rows].map((row) => row.join(",")).join("\n") + "\n";
}
