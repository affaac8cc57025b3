// SPDX-License-Identifier: MIT
// Frequency responses that the running drive has measured (firmware/scope/sweep.h): closed and open loop, gain and phase.
"use strict";

const bode = { graphs: [] };

// Of the answer to `sweep read`: [{hz, re, im}, ...] of the closed loop.
function pointsOfSweep(lines) {
  return lines.map((line) => /^([\d.]+) Hz: ([\d.]+), (-?[\d.]+) deg$/.exec(line)).filter(Boolean).map((found) => {
    const [hz, size, angle] = found.slice(1).map(Number), radians = angle * Math.PI / 180;
    return { hz, re: size * Math.cos(radians), im: size * Math.sin(radians) };
  });
}

// L = T / (1 - T).
function opened({ hz, re, im }) {
  const size = (1 - re) ** 2 + im ** 2 || 1e-12;
  return { hz, re: (re * (1 - re) - im ** 2) / size, im: im / size };
}

const decibels = ({ re, im }) => 20 * Math.log10(Math.max(Math.hypot(re, im), 1e-6));

// In degrees, without jumps: each is within half a turn of the one before.
function phases(points) {
  const found = [];
  for (const { re, im } of points) {
    let degrees = Math.atan2(im, re) * 180 / Math.PI;
    const before = found.length ? found.at(-1) : degrees > 0 ? degrees - 360 : degrees;
    degrees -= 360 * Math.round((degrees - before) / 360);
    found.push(degrees);
  }
  return found;
}

function bodePlot(id, label, rows) {
  return new Dygraph($(id), rows, { labels: ["Hz", "closed", "open"], ylabel: label, colors: [colour("curve-1"), colour("curve-2")],
    legend: "always", labelsDiv: $(`${id}_legend`), rightGap: 4, gridLineColor: "#8885", axisLineColor: colour("quiet"),
    drawPoints: true, axes: { x: { logscale: true, axisLabelFormatter: (x) => `${+x.toPrecision(2)}`,
      valueFormatter: (x) => `${short(x)} Hz` } } });
}

function drawBode(lines) {
  const closed = pointsOfSweep(lines), open = closed.map(opened);
  $("bode_said").textContent = lines.filter((line) => !/ Hz: /.test(line)).join("; ");
  if (closed.length < 2) return;
  const [closedAngles, openAngles] = [phases(closed), phases(open)];
  bode.graphs.forEach((graph) => graph.destroy());
  bode.graphs = [
    bodePlot("bode_gain", "gain, dB", closed.map((point, k) => [point.hz, decibels(point), decibels(open[k])])),
    bodePlot("bode_phase", "phase, degrees", closed.map((point, k) => [point.hz, closedAngles[k], openAngles[k]])),
  ];
  $("bode_gain").setAttribute("aria-label", `gain of the closed and the open loop by frequency; ${$("bode_said").textContent}`);
  $("bode_phase").setAttribute("aria-label", "phase of the closed and the open loop by frequency");
}

// What any page has asked; and what the drive says by itself.
function bodeAnswered(line, lines) {
  if (line === "sweep read") drawBode(lines);
  if (/^sweep (d|q|speed) /.test(line)) $("bode_said").textContent = lines[0] === "ok" ? "measuring" : lines.join(" ");
}

function bodeSaid(text) {
  if (text.includes("done: sweep")) say("sweep read");
}

$("bode_run").onsubmit = (event) => {
  event.preventDefault();
  say(`sweep ${$("bode_loop").value} ${$("bode_amplitude").value}`);
};
$("bode_off").onclick = () => say("sweep off");
$("bode_read").onclick = () => say("sweep read");
