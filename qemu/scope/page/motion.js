// SPDX-License-Identifier: MIT
// Positions, homing, and turning as long as a button is held.
"use strict";

const JOG_MS = 200; // between two words that it is held: qemu/scope/jog.py
let jogging = null;

function jog(rpm) {
  clearInterval(jogging);
  jogging = null;
  send({ kind: "jog", rpm });
  if (rpm) jogging = setInterval(() => send({ kind: "jog", rpm }), JOG_MS);
}

function release() {
  if (jogging !== null) jog(0);
}

function motionStatus({ lines }) {
  $("position").textContent = lines.find((line) => line.startsWith("mode: ")) || "-";
}

for (const [id, sign] of [["jog_back", -1], ["jog_on", 1]]) {
  const button = $(id), press = () => jog(sign * Math.round(Number($("jog_rpm").value)));
  button.onpointerdown = (event) => {
    button.setPointerCapture(event.pointerId);
    press();
  };
  button.onpointerup = button.onpointercancel = button.onlostpointercapture = button.onblur = release;
  button.onkeydown = (event) => { if ([" ", "Enter"].includes(event.key) && !event.repeat) press(); };
  button.onkeyup = (event) => { if ([" ", "Enter"].includes(event.key)) release(); };
  button.oncontextmenu = (event) => event.preventDefault(); // of a long touch
}
addEventListener("blur", release);
document.addEventListener("visibilitychange", release);
$("to").onsubmit = (event) => {
  event.preventDefault();
  say(`pp ${event.submitter.value}${Math.round(Number($("counts").value))}`);
};
$("home").onclick = () => say(`hm ${$("home_at").value}`);
