// SPDX-License-Identifier: MIT
// The page's side of qemu/scope/session.py, where the messages are described. The drive decides what is right: its refusals
// are shown as they come.
"use strict";

const LIVE_MS = 150;    // between two drawings of what is live, at least
const LIVE_PAUSE = 4;   // and so many times what one takes

const live = { plots: new Plots($("live")), names: [], rows: [], last: null, time: 0, held: false };
const captured = { plots: new Plots($("captured")), names: [], units: [], rows: [] };
let signals = {}, state = "", everyMs = 1, identifying = false, awaiting = false;

// ---- what comes ----

const unitsOf = (names) => names.map((name) => signals[name][0]);
const stepsOf = (names) => names.map((name) => signals[name][1]);

function watch(chosen) {
  Object.assign(live, { names: chosen, rows: [], last: null });
  live.plots.layout(chosen, unitsOf(chosen), stepsOf(chosen));
  document.querySelectorAll("#signals input").forEach((box) => { box.checked = chosen.includes(box.value); });
}

function list(known) {
  signals = known;
  $("trigger").replaceChildren(...Object.keys(known).map((name) => new Option(name)));
  $("trigger").value = "i_q";
  $("level_unit").textContent = known.i_q[0];
  $("signals").replaceChildren(...Object.entries(known).map(([name, [unit, , text]]) => {
    const label = document.createElement("label"), box = document.createElement("input");
    Object.assign(box, { type: "checkbox", value: name });
    label.append(box, ` ${name}${unit ? ` [${unit}]` : ""}: ${text}`);
    return label;
  }));
}

const takes = {
  hello(message) {
    everyMs = message.every_ms;
    $("title").textContent = message.title;
    $("twin").hidden = !message.twin;
    $("disturbance").replaceChildren(...Object.keys(message.disturbances).map((name) => new Option(name)));
    $("disturbance").onchange = () => { $("disturbance_text").textContent = message.disturbances[$("disturbance").value]; };
    if (message.twin) $("disturbance").onchange();
    parameters.words = message.words;
    list(message.signals);
    watch(message.chosen);
    send({ kind: "parameters" });
  },
  signals(message) { signals = message.signals; },
  chosen(message) { watch(message.chosen); },
  samples({ rows }) {
    for (const [number, ...values] of rows) { // numbers are modulo 2^16; a gap is a gap of time
      live.time += live.last === null ? 0 : ((number - live.last) & 0xffff) / 1000;
      live.last = number;
      if (!live.held) live.rows.push([+live.time.toFixed(3), ...values]);
    }
    const keep = Math.ceil((Number($("window").value) || 3) * 1000 / everyMs);
    if (live.rows.length > 1.2 * keep) live.rows = live.rows.slice(-keep);
  },
  status(message) {
    state = `${message.state}${message.fault === "none" ? "" : `, fault: ${message.fault}`}`;
    $("state").textContent = state;
    $("status").textContent = message.lines.join("\n");
    $("capture").textContent = `Now: ${message.capture}`;
    $("damaged").textContent = message.damaged ? `${message.damaged} frames damaged` : "";
    const step = message.lines.find((line) => line.startsWith("identify: "));
    $("step").textContent = step || "";
    if (identifying && !step) say("identify show");
    identifying = Boolean(step);
    if (message.hint.length) $("fault").textContent = message.hint.join("\n");
    $("fault").hidden = message.fault === "none";
    if (awaiting && message.capture.startsWith("done")) {
      awaiting = false;
      send({ kind: "capture" });
    }
  },
  said({ text }) { log(text); },
  silent({ why, since, words }) {
    const known = state || "unknown";
    $("state").textContent = `silent since ${since}; last: ${known}`;
    $("silent").textContent = `The drive is silent since ${since}: ${why}. What is grey is what was known then.`
      + (words ? ` Its last words:\n${words}` : "");
    $("silent").hidden = false;
    document.body.classList.add("stale");
  },
  awake() {
    $("silent").hidden = true;
    document.body.classList.remove("stale");
    send({ kind: "parameters" });
  },
  answer({ line, lines, own }) {
    if (line === "identify show") identified(lines);
    log(`${own ? "" : "another page "}> ${line}\n${lines.join("\n")}`);
    if (line === "scope arm" && own) awaiting = lines[0] === "ok"; // from now on a status tells of this capture, not of the last
    if (own) setAnswered(line, lines);
  },
  capture(message) {
    const scale = stepsOf(message.names);
    Object.assign(captured, {
      names: message.names, units: unitsOf(message.names),
      rows: message.rows.map((row, i) => [
        +((i - message.trigger) / message.per_ms / 1000).toFixed(6), ...row.map((v, k) => +(v * scale[k]).toFixed(6))]),
    });
    captured.plots.layout(captured.names, captured.units, scale);
    captured.plots.lines.mark = 0;
    captured.plots.draw(captured.rows);
    $("captured").dataset.samples = captured.rows.length;
  },
  parameters({ rows }) { parametersCame(rows); },
  applied(message) { applied(message); },
};

function identified(lines) {
  $("identified").replaceChildren(...lines.map((line) => {
    const [name, ...rest] = line.split(": ");
    return element("tr", {}, element("td", {}, name), element("td", {}, rest.join(": ")));
  }));
}

// ---- what goes ----

function stop() {
  send({ kind: "stop" });
}

function captureLines() {
  const when = $("when").value;
  return [`scope every ${$("every").value}`, `scope before ${$("before").value}`,
    when === "never" ? "scope trigger never" : `scope trigger ${$("trigger").value} ${when} ${$("level").value}`, "scope arm"];
}

document.querySelectorAll("[data-line]").forEach((b) => { b.onclick = () => say(b.dataset.line); });
document.querySelectorAll("[data-command]").forEach((form) => {
  form.onsubmit = (event) => {
    event.preventDefault();
    say(`${form.dataset.command} ${form.querySelector("input").value}`);
  };
});
$("stop").onclick = stop;
document.onkeydown = (event) => { if (event.key === "Escape") stop(); };
$("console").onsubmit = (event) => {
  event.preventDefault();
  if ($("line").value) say($("line").value);
  $("line").value = "";
};
$("disturb").onsubmit = (event) => {
  event.preventDefault();
  send({ kind: "disturb", line: `${$("disturbance").value} ${$("arguments").value}` });
};
$("choose").onclick = () => {
  const boxes = [...document.querySelectorAll("#signals input:checked")].map((box) => box.value);
  say(`scope signals ${boxes.join(",")}`);
};
$("trigger").onchange = () => { $("level_unit").textContent = signals[$("trigger").value][0]; };
$("arm").onclick = () => {
  say("scope off");
  captureLines().forEach(say);
};
$("read").onclick = () => send({ kind: "capture" });
$("read_fault").onclick = () => send({ kind: "capture", of: "fault" });
$("identify_show").onclick = () => say("identify show");
$("hold").onclick = () => { live.held = !live.held; $("hold").textContent = live.held ? "go on" : "hold"; };
$("save_live").onclick = () => download("live.csv", "text/csv", table(live.names, unitsOf(live.names), live.rows));
$("save_capture").onclick = () => download("capture.csv", "text/csv",
  table(captured.names, captured.units, captured.rows));

// ---- the line ----

const scheme = location.protocol === "https:" ? "wss" : "ws";
socket = new WebSocket(`${scheme}://${location.host}${location.pathname}socket`);
socket.onmessage = ({ data }) => {
  const message = JSON.parse(data);
  takes[message.kind](message);
};
socket.onclose = () => {
  $("lost").hidden = false;
  $("state").textContent = `lost; last: ${state || "unknown"}`;
  document.body.classList.add("stale");
};
setInterval(() => send({ kind: "here" }), 700);

function draw() {
  const seconds = Number($("window").value) || 3;
  live.plots.draw(live.rows.filter((row) => row[0] > live.time - seconds));
  $("live").dataset.samples = live.rows.length;
}

// As often as leaves most of the time to the rest: a frame is painted when the one behind it begins.
function animate() {
  const begin = performance.now();
  if (!live.held && !document.hidden) draw();
  requestAnimationFrame(() => setTimeout(animate, Math.max(LIVE_MS, LIVE_PAUSE * (performance.now() - begin))));
}
animate();
