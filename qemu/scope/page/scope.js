// SPDX-License-Identifier: MIT
// The page's side of qemu/scope/session.py, where the messages are described. The drive decides what is right: its refusals
// are shown as they come.
"use strict";

let state = "", awaiting = false;

// ---- what comes ----

// Variables of the image stand behind the drive's own once they have been used.
function list(known) {
  const more = Object.entries(known).filter(([name]) => !(name in signals));
  signals = known;
  $("trigger").append(...more.map(([name]) => new Option(name)));
  $("signals").append(...more.map(([name, [unit, , text]]) => {
    const box = element("input", { type: "checkbox", value: name });
    return element("label", {}, box, ` ${name}${unit ? ` [${unit}]` : ""}: ${text}`);
  }));
}

const takes = {
  hello(message) {
    Object.assign(live, { everyMs: message.every_ms, paced: message.twin });
    $("title").textContent = message.title;
    $("disturbance").replaceChildren(...Object.keys(message.disturbances).map((name) => new Option(name)));
    $("disturbance").onchange = () => { $("disturbance_text").textContent = message.disturbances[$("disturbance").value]; };
    if (message.twin) $("disturbance").onchange();
    parameters.words = message.words;
    now.axis = message.axis;
    setup.steps = message.steps;
    list(message.signals);
    $("trigger").value = "i_q";
    $("trigger").onchange();
    watch(message.chosen);
    showTask();
    showNumbers([]);
    send({ kind: "parameters" });
  },
  signals(message) { list({ ...signals, ...message.signals }); },
  found(message) { foundVariables(message); },
  values({ values }) { valuesCame(values); },
  axis({ number }) {
    Object.assign(now, { axis: number, state: "" });
    state = ""; // until the next status
    showState("-", "-");
    allow();
    Object.assign(parameters, { known: new Map(), undo: [] }); // the other's
    undoable();
  },
  chosen(message) { watch(message.chosen); },
  samples({ rows }) { samplesCame(rows); },
  status(message) {
    state = `${message.state}${message.fault === "none" ? "" : `, fault: ${message.fault}`}`;
    stateCame(message);
    $("status").textContent = message.lines.join("\n");
    $("capture").textContent = `Now: ${message.capture}`;
    $("damaged").textContent = message.damaged ? `${message.damaged} frames damaged` : "";
    setupStatus(message);
    motionStatus(message);
    if (awaiting && message.capture.startsWith("done")) {
      awaiting = false;
      send({ kind: "capture" });
    }
  },
  said({ text }) {
    log(text);
    bodeSaid(text);
  },
  silent({ why, since, words }) {
    const known = state || "unknown";
    showState("SILENT", `silent since ${since}; last: ${known}`);
    $("silent").textContent = `The drive is silent since ${since}: ${why}. What is grey is what was known then.`
      + (words ? ` Its last words:\n${words}` : "");
    $("silent").hidden = false;
    document.body.classList.add("stale");
    allow();
  },
  awake() {
    $("silent").hidden = true;
    document.body.classList.remove("stale");
    allow();
    send({ kind: "parameters" });
  },
  answer({ line, lines, own }) {
    setupAnswered(line, lines);
    bodeAnswered(line, lines);
    if (own) variablesAnswered(line, lines);
    if (own) stepAnswered(line, lines);
    log(`${own ? "" : "another page "}> ${line}\n${lines.join("\n")}`);
    if (own) $("last").textContent = `${line}: ${lines[0] ?? ""}${lines.length > 1 ? " ..." : ""}`;
    if (own) $("last").classList.toggle("refusal", Boolean(lines[0]?.startsWith("error")));
    if (line === "scope arm" && own) awaiting = lines[0] === "ok"; // from now on a status tells of this capture, not of the last
    if (own) setAnswered(line, lines);
  },
  capture(message) { captureCame(message); },
  parameters({ rows }) { parametersCame(rows); },
  applied(message) {
    applied(message);
    limitsApplied(message);
  },
};

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
function showCapture(of) {
  send({ kind: "capture", of });
  $("measure_on").value = "captured";
  $("measure_on").onchange();
}
$("read").onclick = () => showCapture("read");
$("read_fault").onclick = () => showCapture("fault");

// ---- the line ----

const scheme = location.protocol === "https:" ? "wss" : "ws";
socket = new WebSocket(`${scheme}://${location.host}${location.pathname}socket`);
socket.onmessage = ({ data }) => {
  const message = JSON.parse(data);
  takes[message.kind](message);
};
socket.onclose = () => {
  $("lost").hidden = false;
  showState("LOST", `lost; last: ${state || "unknown"}`);
  document.body.classList.add("stale");
  allow();
};
setInterval(() => send({ kind: "here" }), 700);
showTask();
animate();
