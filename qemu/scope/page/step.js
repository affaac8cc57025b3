// SPDX-License-Identifier: MIT
// Step responses of the running drive: a capture of the reference and of what follows it, and what one reads from it.
"use strict";

// What steps: signals, ticks between two samples, at what share of it the capture begins (a current's reference is noisy before it;
// a speed's goes along the ramp), and what ends it.
const STEPS = {
  torque: { names: ["i_q_ref", "i_q", "i_d", "v_q"], every: 1, share: 0.5, unit: "A", end: "speed 0" },
  speed: { names: ["speed_ref", "speed", "i_q", "i_q_ref"], every: 20, share: 0.01, unit: "rpm", end: "" },
};
const TORQUE_MS = 300; // of a torque: its capture takes 51, of a twin that is slow more
const step = { plots: new Plots($("stepped")), waits: null };

// Of rows [time from the step, reference, value, ...]: {rise from 10 to 90 % and settling to 5 % of the step in s, overshoot in %}.
function stepRead(rows) {
  const rest = rows.filter((row) => row[0] < 0), from = rest.reduce((sum, row) => sum + row[1], 0) / rest.length;
  const to = rows.at(-1)[1], parts = rows.map((row) => [row[0], (row[2] - from) / (to - from)]);
  const passes = (level) => {
    const k = parts.findIndex((part, n) => n && parts[n - 1][1] < level && part[1] >= level);
    if (k < 0) return NaN;
    const [[t, a], [u, b]] = [parts[k - 1], parts[k]];
    return t + (u - t) * (level - a) / (b - a);
  };
  const outside = parts.findLast(([, part]) => Math.abs(part - 1) > 0.05);
  return { rise: passes(0.9) - passes(0.1), over: 100 * Math.max(0, Math.max(...parts.map(([, part]) => part)) - 1),
    settles: outside === parts.at(-1) ? NaN : outside[0] };
}

const stepTold = ({ rise, over, settles }) => [[rise, "rises from 10 to 90 % in"], [settles, "within 5 % after"]].map(([s, words]) =>
  `${words} ${Number.isFinite(s) ? engineering(s, "s", [s, s]) : "more than is shown"}`).join(", ") + `, overshoot ${over.toFixed(1)} %`;

function beginStep(kind, size) {
  const { names, every, share } = STEPS[kind], from = kind === "speed" ? Math.round(now.reference) : 0;
  Object.assign(step, { waits: kind, line: `${kind} ${from + size}`, wait: 50 + 12 * every });
  $("step_said").textContent = "waiting for the step";
  ["scope off", `scope signals ${names}`, `scope every ${every}`, "scope before 50",
    `scope trigger ${names[0]} ${size < 0 ? "below" : "above"} ${(from + size * share).toFixed(3)}`, "scope arm"].forEach(say);
}

// It is armed: the step itself comes when the samples before it are there.
function stepAnswered(line, lines) {
  if (!step.waits || !/^scope (signals|arm)/.test(line)) return;
  if (lines[0] !== "ok") $("step_said").textContent = lines[0];
  else if (line === "scope arm") setTimeout(() => say(step.line), step.wait);
  if (line === "scope arm" && STEPS[step.waits].end) setTimeout(say, step.wait + TORQUE_MS, STEPS[step.waits].end);
}

// A capture has come; true if it was the step's.
function stepCame({ names, units, steps, rows }) {
  if (!step.waits || names[0] !== STEPS[step.waits].names[0]) return;
  step.waits = null;
  step.plots.layout(names, units, steps);
  step.plots.lines.mark = 0;
  bode.on = "step";
  showTask();
  step.plots.draw(rows);
  $("step_said").textContent = stepTold(stepRead(rows));
}

$("step_run").onsubmit = (event) => {
  event.preventDefault();
  beginStep($("step_kind").value, Number($("step_size").value));
};
$("step_kind").onchange = () => { $("step_unit").textContent = STEPS[$("step_kind").value].unit; };
$("picture_step").onclick = () => savePicture($("stepped"), "step.png");
