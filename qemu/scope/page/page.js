// SPDX-License-Identifier: MIT
// What every part of the page uses: elements, the line to the session, the list of what was said.
"use strict";

let socket = null; // scope.js opens it, when all parts are there

const $ = (id) => document.getElementById(id);
const send = (message) => socket?.readyState === WebSocket.OPEN && socket.send(JSON.stringify(message));
const say = (line) => send({ kind: "line", line });

function element(tag, properties, ...content) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...content);
  return made;
}

function log(text) {
  $("said").textContent = `${$("said").textContent}${text}\n`.slice(-6000);
  $("said").scrollTop = $("said").scrollHeight;
}

// A table as a file for other tools, which the session makes: .csv, .mf4, .mcap.
async function record(name, kind, names, units, rows) {
  const answer = await fetch(`record.${kind}`, { method: "POST", body: JSON.stringify({ names, units, rows }) });
  if (answer.ok) download(`${name}.${kind}`, "application/octet-stream", await answer.blob());
  else log(`error: ${name}.${kind} was not made: ${await answer.text()}`);
}

function download(name, type, text) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000); // the browser has read it by then
}
