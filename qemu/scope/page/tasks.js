// SPDX-License-Identifier: MIT
// What is seen and what can be done: the task that the address names, numbers and state that are always in sight, buttons that
// the drive's state allows.
"use strict";

// ---- tasks ----

const TASKS = ["operate", "setup", "tune", "captures", "parameters", "log"];
const task = () => TASKS.find((name) => location.hash === `#${name}`) || TASKS[0];

function showTask() {
  const shown = task(), on = { captures: $("measure_on").value, tune: bode.on }[shown];
  document.querySelectorAll("section[data-task]").forEach((one) => {
    const other = on && one.dataset.on && one.dataset.on !== on;
    one.hidden = !one.dataset.task.split(" ").includes(shown) || Boolean(other) || (one.id === "twin" && !live.paced);
  });
  document.querySelectorAll("nav a").forEach((link) => {
    if (link.hash === `#${shown}`) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  });
  document.body.dataset.shown = shown;
  document.title = `${shown} - mssfoc`;
  [live.plots, captured.plots, step.plots].forEach((plots) => plots.resize());
  [...bode.graphs, measure.graph].filter((graph) => graph?.maindiv_.checkVisibility()).forEach(fit);
}

// ---- numbers ----

const limitNamed = (name, by) => (parameters.known.get(name)?.value || 0) / by;
const places = (x, count) => (Number.isFinite(x) ? x.toFixed(count) : "-");

// Newton metres of a current, by the parameters: 3/2 p (flux i_q + (ld - lq) i_d i_q).
function torqueOf(d, q) {
  const [p, flux, ld, lq] = ["pole_pairs", "flux_uwb", "ld_uh", "lq_uh"].map((name) => limitNamed(name, 1));
  return 1.5 * p * (flux + (ld - lq) * d) * 1e-6 * q;
}

// [name, unit, value, digits, limit as text, share of the limit], of the lines of a status.
function numbersOf(lines) {
  const numbers = (start) => (lines.find((line) => line.startsWith(start)) || "").match(/-?\d+(\.\d+)?/g)?.map(Number) || [];
  const [rpm] = numbers("speed: "), [d, q] = numbers("current: "), [bus, winding] = numbers("bus: ");
  const [top, most, low, high, hot] = [["speed_max_rpm", 1], ["i_max_ma", 1000], ["v_min_mv", 1000], ["v_max_mv", 1000],
    ["t_max_c", 1]].map(([name, by]) => limitNamed(name, by));
  return [
    ["speed", "rpm", rpm, Math.abs(rpm) < 100 ? 1 : 0, `≤ ${top}`, Math.abs(rpm) / top],
    ["current q", "A", q, 2, `≤ ${places(most, 1)}; ${places(torqueOf(d, q), 3)} Nm`, Math.hypot(d, q) / most],
    ["bus", "V", bus, 1, `${places(low, 0)} to ${places(high, 0)}`, (bus - low) / (high - low)],
    ["winding", "°C", winding, 0, hot ? `≤ ${hot}` : "not watched", hot ? winding / hot : 0],
  ];
}

function showNumbers(lines) {
  $("numbers").replaceChildren(...numbersOf(lines).map(([name, unit, value, digits, limit, share]) => {
    const bar = element("dd", { className: "bar", ariaHidden: "true" });
    bar.style.setProperty("--share", Math.min(Math.max(share, 0), 1) || 0);
    bar.classList.toggle("near", share > 0.9);
    return element("div", {}, element("dt", {}, name), element("dd", {}, element("b", {}, places(value, digits)), ` ${unit}`),
      element("dd", { className: "limit", title: limit }, limit), bar);
  }));
}

// ---- state and fault ----

const WORDS = { "switch on disabled": "OFF", "operation enabled": "ON", "quick stop active": "BRAKES", "fault": "FAULT",
  "fault reaction active": "FAULT", "not ready to switch on": "WAITS" };
const now = { state: "", fault: "none", owner: "nobody", axis: 1, current: 0 };
const wordOf = (state, fault) => (fault === "none" ? WORDS[state] || "STARTS" : "FAULT");

function showState(word, text) {
  $("word").textContent = word;
  $("word").dataset.word = word;
  $("state").textContent = text;
}

// Of a drive with two: state, speed and owner of each, and which one the page is for.
function showAxes(axes) {
  $("axes").hidden = axes.length < 2;
  axes.forEach(({ state: one, fault, owner, rpm }, k) => {
    const button = $("axes").children[k] || $("axes").appendChild(element("button", {
      onclick: () => send({ kind: "axis", number: k + 1 }) }));
    button.textContent = `axis ${k + 1}: ${wordOf(one, fault)}, ${places(rpm, 0)} rpm, ${owner}`;
    button.setAttribute("aria-pressed", String(k + 1 === now.axis));
  });
}

function stateCame({ state, fault, lines, hint, since, axes = [] }) {
  const owner = lines.find((line) => line.startsWith("commanded by: "))?.slice(14) ?? "nobody";
  const [d, q] = lines.find((line) => line.startsWith("current: "))?.match(/-?\d+\.\d+/g).map(Number) || [0, 0];
  Object.assign(now, { state, fault, owner, current: Math.hypot(d, q),
    reference: Number(lines.find((line) => line.startsWith("speed: "))?.match(/reference (-?[\d.]+)/)?.[1]) || 0 });
  showAxes(axes);
  showState(wordOf(state, fault), `${state}${fault === "none" ? "" : `, fault: ${fault}`}`);
  $("owner").textContent = owner;
  $("take").hidden = ["nobody", "the console"].includes(owner);
  $("take").textContent = `take over from ${owner}`;
  showNumbers(lines);
  const warned = lines.filter((line) => line.startsWith("warning: "));
  $("warnings").hidden = fault !== "none" && !warned.length;
  $("warnings").textContent = warned.length ? warned.join("\n") : "no fault, no warning";
  $("warnings").classList.toggle("wrong", warned.length > 0);
  $("fault_place").hidden = fault === "none";
  const words = hint.filter((line) => !line.startsWith("fault: ")).join("\n");
  for (const [id, text] of [["fault_name", fault], ["fault_since", since], ["fault", words]]) {
    if ($(id).textContent !== text) $(id).textContent = text; // what is read aloud is read once
  }
  allow();
}

// ---- what is allowed ----

const STARTS = "the drive is starting: wait, or brake it";
const isOff = () => ["switch on disabled", "fault", "not ready to switch on"].includes(now.state);
const theirs = () => (["nobody", "the console"].includes(now.owner) ? "" : `${now.owner} commands: take over first`);
const latched = () => (now.fault === "none" ? "" : "a fault is latched: clear it first");

// Why not, in the present state; nothing if it can be.
const NEEDS = {
  owner: theirs,
  on: () => theirs() || latched() || (now.state === "switch on disabled" ? "" : "the drive is on already"),
  rest: () => theirs() || latched() || (now.state === "switch on disabled" ? "" : "the drive is on: switch it off first"),
  off: () => theirs() || (isOff() ? "" : "the drive is on: switch it off first"),
  operation: () => theirs() || latched() || (now.state === "operation enabled" ? ""
    : isOff() ? "the drive is off: switch it on first" : STARTS),
  start: () => (now.state === "operation enabled" ? NEEDS.operation() : NEEDS.rest()),
  bridge: () => (isOff() ? "the drive is off already" : ""),
  fault: () => (now.fault === "none" ? "there is no fault" : theirs()),
};

function allow() {
  const silent = document.body.classList.contains("stale") ? "the drive is silent" : "";
  document.querySelectorAll("[data-needs]").forEach((button) => {
    const why = silent || NEEDS[button.dataset.needs]();
    if (!("tip" in button.dataset)) button.dataset.tip = button.title;
    button.disabled = Boolean(why);
    button.title = why || button.dataset.tip;
  });
  document.querySelectorAll(".why").forEach((note) => {
    const all = [...note.closest("section").querySelectorAll("[data-needs]:disabled")].map((button) => button.title);
    const text = [...new Set(all)].filter((why) => !why.endsWith("already")).join("; ");
    if (note.textContent !== text) note.textContent = text;
  });
}

// A verb with the value that stands before it.
document.querySelectorAll("[data-verb]").forEach((button) => {
  const input = button.parentElement.querySelector("input"), tell = () => {
    button.textContent = button.dataset.verb.replace("#", input.value || "...");
  };
  input.addEventListener("input", tell);
  tell();
});

$("see_record").onclick = () => {
  location.hash = "captures";
  $("read_fault").click();
};
addEventListener("hashchange", () => {
  showTask();
  $("main").scrollTop = 0;
});
