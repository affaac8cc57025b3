// SPDX-License-Identifier: MIT
// What is live, and what was captured: rows [time in s, values...], their plots, and how fast the drive's time goes.
"use strict";

const LIVE_MS = 300;    // between two drawings of what is live, at least
const LIVE_PAUSE = 9;   // and so many times what one takes: a tenth of a core
const PACE_S = 2;       // over which the drive's time is compared with the clock

const live = { plots: new Plots($("live")), names: [], rows: [], last: null, time: 0, held: false, everyMs: 1, paced: false };
const captured = { plots: new Plots($("captured")), names: [], units: [], steps: [], rows: [], before: null };
let signals = {};

const unitsOf = (names) => names.map((name) => signals[name][0]);
const stepsOf = (names) => names.map((name) => signals[name][1]);

// Seconds of the drive in one of the clock, from pairs of both times.
class Pace {
  constructor() { this.pairs = []; }

  note(drive, clock) {
    this.pairs.push([drive, clock]);
    while (clock - this.pairs[0][1] > PACE_S) this.pairs.shift();
  }

  factor() {
    const [first, last] = [this.pairs[0], this.pairs.at(-1)];
    return first && last[1] - first[1] > PACE_S / 2 ? (last[0] - first[0]) / (last[1] - first[1]) : null;
  }
}
const pace = new Pace();

function watch(chosen) {
  Object.assign(live, { names: chosen, rows: [], last: null });
  live.plots.layout(chosen, unitsOf(chosen), stepsOf(chosen));
  document.querySelectorAll("#signals input").forEach((box) => { box.checked = chosen.includes(box.value); });
  offer();
}

function samplesCame(rows) {
  for (const [number, ...values] of rows) { // numbers are modulo 2^16; a gap is a gap of time
    live.time += live.last === null ? 0 : ((number - live.last) & 0xffff) / 1000;
    live.last = number;
    if (!live.held) live.rows.push([+live.time.toFixed(3), ...values]);
  }
  const keep = Math.ceil((Number($("window").value) || 3) * 1000 / live.everyMs);
  if (live.rows.length > 1.2 * keep) live.rows = live.rows.slice(-keep);
  pace.note(live.time, performance.now() / 1000);
}

function captureCame(message) {
  Object.assign(captured, {
    names: message.names, units: unitsOf(message.names), steps: stepsOf(message.names),
    rows: message.rows.map((row, i) => [+((i - message.trigger) / message.per_ms / 1000).toFixed(6), ...row]),
  });
  stepCame(captured);
  drawCapture();
  $("captured").dataset.samples = captured.rows.length;
  offer();
  measured();
}

// With what was kept of an earlier one on top, where both have the signal: by time from the trigger.
function drawCapture() {
  const { names, units, steps, rows, before } = captured, both = before ? names.filter((name) => before.names.includes(name)) : [];
  const of = (list) => both.map((name) => list[names.indexOf(name)]), half = rows.length > 1 ? (rows[1][0] - rows[0][0]) / 2 : 0;
  const columns = both.map((name) => before.names.indexOf(name) + 1);
  const kept = both.map((name) => `${name} before`);
  captured.plots.layout([...names, ...kept], [...units, ...of(units)], [...steps, ...of(steps)], both.length);
  captured.plots.lines.mark = 0;
  captured.plots.draw(both.length ? rows.map((row) => {
    const then = nearest(before.rows, row[0]), there = row[0] > before.rows[0][0] - half && row[0] < before.rows.at(-1)[0] + half;
    return [...row, ...columns.map((k) => (there ? then[k] : NaN))];
  }) : rows);
}

function draw() {
  const seconds = Number($("window").value) || 3;
  if (live.plots.isSeen()) live.plots.draw(live.rows.filter((row) => row[0] > live.time - seconds));
  $("live").dataset.samples = live.rows.length;
  drawVectors();
  if ($("measure_on").value === "live") measured();
}

// As often as leaves most of the time to the rest: a frame is painted when the one behind it begins.
function animate() {
  const begin = performance.now(), factor = pace.factor();
  if (!live.held && !document.hidden) draw();
  $("pace").textContent = live.paced && factor !== null ? `${factor.toFixed(2)} of real time` : "";
  requestAnimationFrame(() => setTimeout(animate, Math.max(LIVE_MS, LIVE_PAUSE * (performance.now() - begin))));
}

$("hold").onclick = () => { live.held = !live.held; $("hold").textContent = live.held ? "go on" : "hold"; };
$("picture_live").onclick = () => savePicture($("live"), "live.png");
$("picture_capture").onclick = () => savePicture($("captured"), "capture.png");
$("compare").onclick = () => {
  captured.before = captured.before || !captured.rows.length ? null : { names: captured.names, rows: captured.rows };
  $("compare").textContent = captured.before ? "forget the one before" : "keep it to compare";
  drawCapture();
};
$("save_live").onclick = () => record("live", $("live_kind").value, live.names, unitsOf(live.names), live.rows);
$("save_capture").onclick = () => record("capture", $("capture_kind").value, captured.names, captured.units, captured.rows);
