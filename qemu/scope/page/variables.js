// SPDX-License-Identifier: MIT
// Variables of the image by their names, found while one is typed: as numbers, on the plots, as trigger.
"use strict";

const variables = { rows: new Map() }; // name -> its row

const watchVariables = () => send({ kind: "watch", names: [...variables.rows.keys()] });

// The browser offers what has the typed text in its value or label.
function foundVariables({ text, rows }) {
  if (text !== $("variable").value) return;
  $("variable_names").replaceChildren(...rows.map(([name, type, unit]) =>
    element("option", { value: name, label: [type, unit, text].filter(Boolean).join(", ") })));
}

function showVariable(name) {
  $("variable_said").textContent = "";
  if (!name || variables.rows.has(name)) return;
  const forget = element("button", { ariaLabel: `forget ${name}`, onclick: () => {
    variables.rows.get(name).remove();
    variables.rows.delete(name);
    watchVariables();
  } }, "×");
  variables.rows.set(name, element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, "-"), element("td", {}, forget)));
  $("variables").append(variables.rows.get(name));
  watchVariables();
}

function valuesCame(values) {
  for (const [name, [value, word]] of Object.entries(values)) {
    const row = variables.rows.get(name), [unit] = signals[name] || [""];
    if (row) row.cells[1].textContent = `${word || +value.toPrecision(9)}${unit && ` ${unit}`}`;
  }
}

// Eight at most: the last one gives way.
function plotVariable(name) {
  if (name) say(`scope signals ${[name, ...live.names.filter((one) => one !== name).slice(0, 7)].join(",")}`);
}

// A name that is none goes again, and the reason stands among what was said.
function variablesAnswered(line, lines) {
  if (line !== "watch") return;
  for (const [name, row] of variables.rows) if (row.cells[1].textContent === "-") row.querySelector("button").click();
  $("variable_said").textContent = lines[0];
}

$("variable").oninput = () => send({ kind: "find", text: $("variable").value });
$("variable_show").onclick = () => showVariable($("variable").value);
$("variable_plot").onclick = () => plotVariable($("variable").value);
