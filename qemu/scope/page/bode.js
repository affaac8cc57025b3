// SPDX-License-Identifier: MIT
// Frequency responses that the running drive has measured (firmware/scope/sweep.h): closed and open loop, gain and phase, and
// the margins of the open one.
"use strict";

const LOWER_DB = 1;            // than designed, which is told
const KNEE_SHARE = 512 / 32768; // of i_range_ma: below it dead time is compensated in part (lib/deadtime.h)
const bode = { graphs: [], rows: [], lines: null, on: "bode" };

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

// Where a column of rows [Hz, ...] first falls through a level: {hz, and the other column there}; null if it does not.
function falls(rows, column, level, other) {
  const k = rows.findIndex((row, n) => n && rows[n - 1][column] >= level && row[column] < level);
  if (k < 0) return null;
  const [a, b] = [rows[k - 1], rows[k]], part = (a[column] - level) / (a[column] - b[column]);
  return { hz: a[0] * (b[0] / a[0]) ** part, other: a[other] + part * (b[other] - a[other]) };
}

// Of rows [Hz, dB closed, degrees closed, dB open, degrees open]: [kind, Hz, how much] of what the open loop has.
function margins(rows) {
  const phase = falls(rows, 3, 0, 4), gain = falls(rows, 4, -180, 3);
  return [phase && ["phase margin", phase.hz, phase.other + 180, "°"],
    gain && ["gain margin", gain.hz, -gain.other, "dB"]].filter(Boolean);
}

const marginsTold = (found) => found.map(([kind, hz, much, unit]) =>
  `${kind} ${much.toFixed(1)} ${unit} at ${engineering(hz, "Hz", [hz, hz])}`).join(", ") || "the open loop has no margin within these frequencies";

// Upright where a margin is; level with what it is a margin to; the margin itself, thick.
function drawMargins(found, kind, level) {
  return (pen, area, graph) => {
    pen.fillStyle = colour("quiet");
    if (graph.toDomYCoord(level) > area.y) pen.fillRect(area.x, graph.toDomYCoord(level), area.w, 1);
    for (const [name, hz, much] of found) {
      const x = area.x + graph.toPercentXCoord(hz) * area.w;
      pen.fillStyle = colour(name === kind ? "mark" : "quiet");
      pen.fillRect(x - 0.5, area.y, 1, area.h);
      if (name !== kind) continue;
      const [from, to] = [graph.toDomYCoord(level), graph.toDomYCoord(level + (kind === "phase margin" ? much : -much))];
      pen.fillRect(x - 2, Math.min(from, to), 4, Math.abs(to - from));
    }
  };
}

// The open loop of a current is designed as an integrator through 1 at current_bw_hz: in dB.
const designed = (loop, hz) => (loop === "speed" ? NaN : 20 * Math.log10(limitNamed("current_bw_hz", 1) / hz));

// Where it has less than that, by how much, and whether dead time can be why: at currents that pass through its knee.
function deadTimeTold(rows, loop, amplitude, current) {
  if (loop === "speed") return "";
  const knee = KNEE_SHARE * limitNamed("i_range_ma", 1000), ampere = (x) => engineering(x, "A", [x, x]);
  if (current - amplitude > knee) {
    return `At ${ampere(current)}, beyond ${ampere(knee)}, dead time is compensated in full: it lowers the gain nowhere.`;
  }
  const lower = rows.map((row) => [row[0], designed(loop, row[0]) - row[3]]).filter(([hz, db]) => db > LOWER_DB && hz < 4 * limitNamed("current_bw_hz", 1));
  const [at, most] = lower.reduce((found, one) => (one[1] > found[1] ? one : found), [0, 0]), hertz = (x) => engineering(x, "Hz", [x, x]);
  const why = `phase currents pass through zero (${ampere(current)}, a sine of ${ampere(amplitude)}), where it is compensated in part`;
  return at ? `Dead time lowers the gain from ${hertz(lower[0][0])} to ${hertz(lower.at(-1)[0])}, most by ${most.toFixed(1)} dB at ${hertz(at)}: ${why}.`
    + ` With more than ${ampere(knee + amplitude)} in the phases it does not.` : `Though ${why}, dead time lowers the gain nowhere by ${LOWER_DB} dB.`;
}

function drawBode(lines) {
  const closed = pointsOfSweep(lines), open = closed.map(opened);
  $("bode_said").textContent = lines.filter((line) => !/ Hz: /.test(line)).join("; ");
  if (closed.length < 2) return;
  bode.lines = lines;
  const [closedAngles, openAngles] = [phases(closed), phases(open)];
  bode.rows = closed.map((point, k) => [point.hz, decibels(point), closedAngles[k], decibels(open[k]), openAngles[k]]);
  const found = margins(bode.rows), names = ["closed", "open"], [, loop, ampere] = /loop: (\w+), amplitude: ([\d.]+)/.exec(lines[0]) || [0, "speed", 0];
  $("bode_dead").textContent = deadTimeTold(bode.rows, loop, Number(ampere), now.current);
  bode.on = "bode";
  showTask();
  $("bode_margins").textContent = marginsTold(found);
  bode.graphs.forEach((graph) => graph.destroy());
  bode.graphs = [["bode_gain", "dB", 1, "gain margin", 0, false], ["bode_phase", "°", 2, "phase margin", -180, true]].map(
    ([id, unit, at, kind, level, drawAxis]) => chart($(id), $(`${id}_legend`),
      bode.rows.map((row) => [row[0], row[at], row[at + 2], ...(unit === "dB" ? [designed(loop, row[0])] : [])]),
      unit === "dB" ? [...names, "designed"] : names, ["Hz", unit],
      { drawPoints: true, underlayCallback: drawMargins(found, kind, level), axes: { x:
        { logscale: true, drawAxis, axisLabelFormatter: (hz) => engineering(hz, "Hz", [hz, hz]) }, y: {} } }));
  together(bode.graphs);
  $("bode_gain").setAttribute("aria-label", `gain of the closed and the open loop by frequency; ${$("bode_margins").textContent}`);
  $("bode_phase").setAttribute("aria-label", "phase of the closed and the open loop by frequency");
}

dark.addEventListener("change", () => { if (bode.lines) drawBode(bode.lines); });

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
$("save_bode").onclick = () => download("bode.csv", "text/csv",
  table(["closed", "closed", "open", "open"], ["dB", "deg", "dB", "deg"], bode.rows).replace("time_s", "frequency_Hz"));
$("picture_bode").onclick = () => savePicture($("bode"), "bode.png");
