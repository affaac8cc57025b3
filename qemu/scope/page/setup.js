// SPDX-License-Identifier: MIT
// From a supply to a motor that turns: limits, identify, what it changes, saving, turning.
"use strict";

const LIMITS = ["i_range_ma", "v_range_mv", "i_trip_ma", "v_min_mv", "v_max_mv", "i_rated_ma", "i_max_ma", "speed_max_rpm",
  "overspeed_rpm"]; // what identify cannot measure: docs/guides/your-motor.md
const setup = { steps: [], identifying: false, using: false, starting: null };

const openStep = (name) => { $(`setup_${name}`).open = true; };
const limitOf = (name) => document.querySelector(`#limits input[name="${name}"]`);

function limitsCame() {
  if (!$("limits").children.length) {
    $("limits").replaceChildren(...LIMITS.filter((name) => parameters.known.has(name)).map((name) => {
      const { unit } = parameters.known.get(name), { meaning = "" } = parameters.words[name] || {};
      return element("label", { title: meaning }, `${name} `, element("input", { type: "number", step: 1, name }), ` ${unit}`);
    }));
  }
  for (const input of document.querySelectorAll("#limits input")) {
    const { value } = parameters.known.get(input.name);
    if (input !== document.activeElement) input.value = value;
  }
}

function setLimits() {
  const typed = [...document.querySelectorAll("#limits input")].map(({ name, value }) => [name, Number(value)]);
  const values = Object.fromEntries(typed.filter(([name, value]) => value !== parameters.known.get(name).value));
  $("limits_said").textContent = "";
  if (Object.keys(values).length) apply(values, "limits");
  else openStep("identify");
}

function limitsApplied({ own, what, refusals }) {
  if (!own || what !== "limits") return;
  $("limits_said").textContent = [...new Set(Object.values(refusals))].join("\n");
  if (!Object.keys(refusals).length) openStep("identify");
}

// A row for each parameter that `identify use` has changed.
function compare(changed) {
  if (!setup.using) return;
  setup.using = false;
  $("compared").replaceChildren(element("tr", {}, ...["parameter", "old", "new"].map((text) => element("th", {}, text))),
    ...Object.entries(changed).map(([name, old]) => {
      const { value, unit } = parameters.known.get(name);
      return element("tr", {}, element("th", {}, name), element("td", {}, String(old)), element("td", {}, `${value} ${unit}`));
    }));
  $("take_back").disabled = false;
}

// How far identify is, from the status; what it has found, when it has ended.
function setupStatus({ state, fault, lines }) {
  const line = lines.find((one) => one.startsWith("identify: ")) || "", step = line.match(/'(.+)'/)?.[1];
  $("bus").textContent = lines.find((one) => one.startsWith("bus: "))?.match(/^bus: ([^,]*)/)[1] || "-";
  $("turning").textContent = lines.find((one) => one.startsWith("speed: ")) || "";
  $("step").textContent = line;
  $("progress").max = setup.steps.length;
  if (step) $("progress").value = setup.steps.indexOf(step) + 1;
  if (step && !setup.identifying) openStep("identify");
  if (!step && setup.identifying) say("identify show");
  setup.identifying = Boolean(step);
  if (setup.starting !== null && state === "operation enabled") say(`speed ${setup.starting}`);
  if (state === "operation enabled" || fault !== "none") setup.starting = null;
}

function identified(lines) {
  $("identified").replaceChildren(...lines.map((line) => {
    const [name, ...rest] = line.split(": ");
    return element("tr", {}, element("td", {}, name), element("td", {}, rest.join(": ")));
  }));
  const whole = lines.length > 1 && !lines.some((line) => line.startsWith("ended in step"));
  $("progress").value = whole ? setup.steps.length : 0;
  if (whole) openStep("use");
}

function setupAnswered(line, lines) {
  if (line === "identify show") identified(lines);
  if (line === "identify use") setup.using = lines[0] === "ok";
  if (line === "save" && lines[0] === "ok") openStep("turn");
}

$("limits_set").onclick = setLimits;
$("identify_show").onclick = () => say("identify show");
$("take_back").onclick = () => {
  $("take_back").disabled = true;
  $("undo").click();
};
$("start").onclick = () => {
  setup.starting = Number($("start_rpm").value);
  if (state === "operation enabled") say(`speed ${setup.starting}`);
  else say("on");
};
