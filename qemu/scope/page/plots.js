// SPDX-License-Identifier: MIT
// Plots against one axis below each other, that share zoom and cursor: of signals against time, one for each unit; and what any
// plot of the page is made of.
"use strict";

const LEAST_STEPS = 512; // of a raw value, that a plot of what is measured spans: a converter's last bits do not fill it
const STILL_STEPS = 4;   // and of what is not measured: no tick between two values
const MEASURED = ["A", "V", "rpm"];
const TEETH_PX = 10;     // narrower turns of an angle are not drawn one by one

const dark = matchMedia("(prefers-color-scheme: dark)");
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// ---- numbers as engineers read them ----

const PREFIXES = { 9: "G", 6: "M", 3: "k", 0: "", "-3": "m", "-6": "µ", "-9": "n" };
const PREFIXED = ["s", "Hz", "A", "V", "Nm"];

// With the prefix that fits the largest of a range, and as many digits as tell its parts from each other.
function engineering(x, unit, [low, high]) {
  const most = Math.max(Math.abs(low), Math.abs(high)), span = Math.abs(high - low) || most || 1;
  const power = PREFIXED.includes(unit) && most ? Math.min(9, Math.max(-9, 3 * Math.floor(Math.log10(most * 1.001) / 3))) : 0;
  const digits = Math.min(12, Math.max(0, 2 - Math.floor(Math.log10(span / 10 ** power))));
  const number = +(x / 10 ** power).toFixed(digits) || 0; // no -0
  const word = `${PREFIXES[power]}${unit}`;
  return word ? `${number} ${word}` : String(number);
}

// ---- what is drawn of many samples ----

// Of rows [time, values...] at most two for each of so many pixels: the least and the most of each column, in their order, so
// that nothing that is there is missing, whatever its frequency. Of an angle the first and the last.
function reduced(rows, pixels, angles) {
  const span = rows.at(-1)[0] - rows[0][0];
  if (rows.length <= 2 * pixels || !span) return rows.map((row) => [...row]);
  const width = span / pixels, found = [];
  for (let k = 0; k < rows.length;) {
    const bin = Math.floor(rows[k][0] / width), from = k; // by time, not by place: what scrolls does not flicker
    while (k < rows.length && Math.floor(rows[k][0] / width) === bin) k++;
    const first = [...rows[from]], last = [...rows[k - 1]];
    for (let c = 1; c < first.length && k - from > 1; c++) {
      if (angles[c - 1]) continue;
      let low = from, high = from;
      for (let n = from; n < k; n++) {
        if (rows[n][c] < rows[low][c]) low = n;
        if (rows[n][c] > rows[high][c]) high = n;
      }
      [first[c], last[c]] = [rows[Math.min(low, high)][c], rows[Math.max(low, high)][c]];
    }
    found.push(first);
    if (k - from > 1) found.push(last);
  }
  return found;
}

const wraps = (rows, column) => rows.reduce((count, row, k) => count + (k && Math.abs(row[column] - rows[k - 1][column]) > 180), 0);

// A line does not go back where an angle begins anew.
function broken(rows, angles) {
  for (let c = 1; c <= angles.length; c++) {
    let before = NaN;
    if (angles[c - 1]) for (const row of rows) [before, row[c]] = [row[c], Math.abs(row[c] - before) > 180 ? NaN : row[c]];
  }
  return rows;
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
  if (low > high) return [0, 1];
  const half = 0.54 * Math.max(high - low, least, 1e-9), middle = (low + high) / 2;
  return [middle - half, middle + half];
}

// ---- a plot ----

// names, units of x and of y, and what dygraphs calls options; the legend tells the values where the mouse is.
function chart(curves, legend, rows, names, [unitX, unitY], options = {}) {
  const ticks = (unit, range) => (x, _granularity, _options, graph) => engineering(x, unit, graph[range]());
  return new Dygraph(curves, rows, {
    labels: [unitX, ...names], xlabel: "", legend: "always", labelsDiv: legend, animatedZooms: false, strokeWidth: 1.2, rightGap: 4,
    gridLineColor: "#8885", axisLineColor: colour("quiet"), colors: names.map((_, k) => colour(`curve-${k % 8 + 1}`)),
    legendFormatter: ({ dygraph, x, series }) => series.map(({ labelHTML, color, y }) => {
      const value = x === undefined || !Number.isFinite(y) ? "" : ` ${engineering(y, unitY, dygraph.yAxisRange())}`;
      return `<b style="color:${color}">${labelHTML}${value}</b> `;
    }).join("") + (x === undefined ? "" : `at ${engineering(x, unitX, dygraph.xAxisRange())}`),
    ...options,
    axes: { x: { axisLabelFormatter: ticks(unitX, "xAxisRange"), axisLabelWidth: 70, ...options.axes?.x },
      y: { axisLabelFormatter: ticks(unitY, "yAxisRange"), axisLabelWidth: 68, pixelsPerLabel: 22, ...options.axes?.y } },
  });
}

// What was made while it was hidden has got a size of its own, which it is to lose.
function fit(dygraph) {
  Object.assign(dygraph.maindiv_.style, { width: "", height: "" });
  dygraph.resize();
}

// A cursor through all: of the other graphs' points those of the same row; an upright line where it is.
function together(graphs) {
  for (const graph of graphs) {
    const others = graphs.filter((one) => one !== graph);
    graph.updateOptions({
      highlightCallback: (_event, _x, _points, row) => others.forEach((one) => one.setSelection(row)),
      unhighlightCallback: () => others.forEach((one) => one.clearSelection()),
      drawHighlightPointCallback: (one, _name, pen, x, y, shade, size) => {
        const { y: top, h } = one.getArea();
        pen.fillStyle = colour("quiet");
        pen.fillRect(x - 0.5, top, 1, h);
        pen.fillStyle = shade;
        pen.beginPath();
        pen.arc(x, y, size, 0, 2 * Math.PI);
        pen.fill();
      },
    }, true);
  }
}

// Of graphs below each other a canvas, with what stands in their legends and at their axes.
function pictureOf(place) {
  const frame = place.getBoundingClientRect(), by = devicePixelRatio;
  const made = element("canvas", { width: frame.width * by, height: frame.height * by }), pen = made.getContext("2d");
  pen.scale(by, by);
  pen.fillStyle = colour("ground");
  pen.fillRect(0, 0, frame.width, frame.height);
  for (const canvas of place.querySelectorAll(".curves canvas")) {
    const box = canvas.getBoundingClientRect();
    pen.drawImage(canvas, box.left - frame.left, box.top - frame.top, box.width, box.height);
  }
  pen.textBaseline = "middle";
  for (const one of place.querySelectorAll(".legend b, .legend span, .dygraph-axis-label")) {
    const box = one.getBoundingClientRect(), style = getComputedStyle(one), axis = one.classList.contains("dygraph-axis-label");
    pen.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
    pen.fillStyle = style.color;
    pen.textAlign = { center: "center", right: "right", end: "right" }[axis ? style.textAlign : ""] || "left";
    const x = { center: (box.left + box.right) / 2, right: box.right, left: box.left }[pen.textAlign];
    pen.fillText(one.textContent.trim(), x - frame.left, (box.top + box.bottom) / 2 - frame.top);
  }
  return made;
}

function savePicture(place, name) {
  pictureOf(place).toBlob((blob) => download(name, "image/png", blob));
}

// ---- signals against time ----

class Plots {
  constructor(place) {
    this.place = place;
    this.graphs = [];
    this.rows = [];
    this.window = null; // [from, to], where it is zoomed
    this.lines = {};    // colour's name: time of an upright line
    this.ranges = {};   // unit: [least, most], where not automatic
    this.onClick = () => {};
    dark.addEventListener("change", () => this.recolour());
  }

  // names of the columns behind the time, their units, and what a step of a raw value is; the last so many are of before
  layout(names, units, steps, before = 0) {
    this.graphs.forEach((g) => g.dygraph.destroy());
    this.place.replaceChildren();
    [this.rows, this.window] = [[], null];
    this.before = names.length - before;
    this.angles = units.map((unit) => unit === "deg");
    const kinds = [...new Set(units)];
    this.graphs = kinds.map((unit, at) => {
      const columns = names.map((_, k) => k).filter((k) => units[k] === unit);
      const least = (MEASURED.includes(unit) ? LEAST_STEPS : STILL_STEPS) * Math.max(...columns.map((k) => steps[k]));
      return { columns, unit, least, dense: 0,
        dygraph: this.graph(columns.map((k) => names[k]), unit, at === kinds.length - 1) };
    });
    together(this.graphs.map(({ dygraph }) => dygraph));
    this.resize(); // the first had the whole place when it was made
    this.recolour();
  }

  isSeen() {
    return this.place.checkVisibility();
  }

  resize() {
    if (!this.isSeen()) return;
    this.graphs.forEach(({ dygraph }) => fit(dygraph));
    this.draw(this.rows);
  }

  graph(names, unit, isLast) {
    const legend = element("div", { className: "legend" }), curves = element("div", { className: "curves" });
    curves.setAttribute("role", "img");
    curves.setAttribute("aria-label", `${names.join(", ")}${unit ? ` in ${unit}` : ""} against time`);
    this.place.append(element("div", { className: isLast ? "plot last" : "plot" }, legend, curves));
    const made = chart(curves, legend, [[0, ...names.map(() => 0)]], names, ["s", unit.split(" ")[0]], {
      underlayCallback: (...drawn) => this.upright(...drawn), clickCallback: (event, time) => this.onClick(event, time),
      zoomCallback: (from, to) => this.zoom(made.isZoomed("x") ? [from, to] : null), axes: { x: { drawAxis: isLast }, y: {} },
    });
    return made;
  }

  // What is of before is dashed, in the colour of what it is compared with.
  recolour() {
    for (const { columns, dygraph } of this.graphs) {
      const names = dygraph.getLabels().slice(1), series = {};
      columns.forEach((k, n) => { if (k >= this.before) series[names[n]] = { strokePattern: [5, 4] }; });
      const shades = columns.map((k, n) => (k < this.before ? n : names.indexOf(names[n].replace(" before", ""))));
      dygraph.updateOptions({ colors: shades.map((n) => colour(`curve-${n + 1}`)), axisLineColor: colour("quiet"), series });
    }
  }

  upright(canvas, area, dygraph) {
    const graph = this.graphs.find((one) => one.dygraph === dygraph);
    if (graph?.dense) { // turns too close to each other to be seen
      canvas.fillStyle = colour("soft");
      canvas.fillRect(area.x, area.y, area.w, area.h);
      canvas.fillStyle = colour("quiet");
      canvas.font = "13px system-ui";
      const often = engineering(graph.dense, "Hz", [0, graph.dense]);
      canvas.fillText(`${often}: zoom in to see each turn`, area.x + 10, area.y + area.h / 2);
    }
    for (const [name, time] of Object.entries(this.lines)) {
      canvas.fillStyle = colour(name);
      canvas.fillRect(dygraph.toDomXCoord(time) - 1, area.y, 2, area.h);
    }
  }

  draw(rows) {
    this.rows = rows;
    if (!rows.length || !this.graphs.length) return;
    if (this.window && this.window[1] < rows[0][0]) this.window = null; // it has gone by
    const [from, to] = this.window || [-Infinity, Infinity];
    const seen = rows.filter((row, k) => (rows[k + 1] || row)[0] >= from && (rows[k - 1] || row)[0] <= to);
    if (!seen.length) return;
    const pixels = Math.max(100, this.place.clientWidth - 80), shown = reduced(seen, pixels, this.angles);
    const span = seen.at(-1)[0] - seen[0][0];
    for (const graph of this.graphs) {
      const turns = this.angles[graph.columns[0]] ? Math.max(...graph.columns.map((k) => wraps(seen, k + 1))) : 0;
      graph.dense = turns * TEETH_PX > pixels ? turns / span : 0;
    }
    broken(shown, this.angles);
    for (const { columns, unit, least, dygraph, dense } of this.graphs) {
      const file = shown.map((row) => [row[0], ...columns.map((k) => (dense ? NaN : row[k + 1]))]);
      dygraph.updateOptions({ file, dateWindow: this.window, valueRange: this.ranges[unit]
        || (dense ? [0, 360] : spanned(file, least)) });
    }
  }

  // Between two times, or all.
  zoom(times) {
    this.window = times;
    this.draw(this.rows);
  }
}

function table(names, units, rows) {
  const heading = ["time_s", ...names.map((n, k) => (units[k] ? `${n} [${units[k]}]` : n))];
  return [heading, ...rows].map((row) => row.join(",")).join("\n") + "\n";
}
