// SPDX-License-Identifier: MIT
// The drive's parameters: in groups, with what each means and how it differs from its default; undo; to and from a file.
"use strict";

const parameters = { words: {}, known: new Map(), undo: [], undoing: null }; // known: name -> what the drive said of it

const fieldOf = (name) => document.querySelector(`#parameters input[name="${name}"]`);
const apply = (values, what) => send({ kind: "set", values, what });

// ---- what the drive says ----

function parametersCame(rows) {
  const before = new Map([...parameters.known].map(([name, { value }]) => [name, value]));
  const same = rows.length === before.size && rows.every(({ name }) => before.has(name));
  parameters.known = new Map(rows.map((row) => [row.name, row]));
  if (same) {
    remember(Object.fromEntries(rows.filter(({ name, value }) => before.get(name) !== value)
      .map(({ name }) => [name, before.get(name)])));
  } else {
    build(rows);
  }
  rows.forEach(refresh);
  limitsCame();
  filter();
}

// What has changed, whoever did it, and what it was. What undo itself changes is not undone by the next one.
function remember(changed) {
  if (!Object.keys(changed).length) return;
  compare(changed);
  if (!parameters.undoing) parameters.undo.push(changed);
  undoable();
}

function undoable() {
  const last = parameters.undo.at(-1), names = Object.keys(last || {});
  $("undo").disabled = !last;
  $("undo").title = names.length === 1 ? `${names[0]} back to ${last[names[0]]}` : `${names.length} parameters back`;
}

function build(rows) {
  const groups = Map.groupBy(rows, ({ name }) => parameters.words[name]?.group || "Others");
  $("parameters").replaceChildren(...[...groups].map(([group, members]) => element("details", {},
    element("summary", {}, `${group} `, element("span", { className: "changed" })),
    element("table", { ariaLabel: group }, ...members.map(parameter)))));
}

function parameter({ name, least, most, unit }) {
  const { meaning = "", initial } = parameters.words[name] || {};
  const input = element("input", { type: "number", min: least, max: most, step: 1, name, id: `p_${name}` });
  input.setAttribute("aria-describedby", `m_${name}`);
  input.oninput = () => mark(name, "");
  input.onchange = () => say(`set ${name} ${input.value}`);
  const back = element("button", { className: "default", title: `${name} to its default`, hidden: true,
    onclick: () => say(`set ${name} ${initial}`) }, `default ${initial}`);
  return element("tr", {}, element("td", {}, element("label", { htmlFor: input.id }, name),
    element("span", { className: "note", id: `m_${name}` }, `${meaning} (${least} ... ${most}${unit && ` ${unit}`})`)),
  element("td", {}, input, ` ${unit} `, back, element("span", { className: "refusal" })));
}

// What somebody is just typing stays.
function refresh({ name, value }) {
  const input = fieldOf(name), row = input.closest("tr"), initial = parameters.words[name]?.initial;
  if (input !== document.activeElement || input.value === input.dataset.known) input.value = value;
  input.dataset.known = value;
  row.classList.toggle("differs", initial !== undefined && initial !== value);
  row.querySelector(".default").hidden = initial === undefined || initial === value;
  const group = row.closest("details"), count = group.querySelectorAll(".differs").length;
  group.querySelector(".changed").textContent = count ? `${count} not as by default` : "";
}

function mark(name, refusal) {
  const row = fieldOf(name).closest("tr");
  row.classList.toggle("wrong", Boolean(refusal));
  row.querySelector(".refusal").textContent = refusal;
}

// A field whose value was refused shows the drive's again, and why.
function refused(name, typed, why) {
  const input = fieldOf(name);
  if (!input) return;
  input.value = input.dataset.known;
  input.closest("details").open = true;
  mark(name, `${typed || "nothing"} refused: ${why.replace(/^error: /, "")}`);
}

function setAnswered(line, lines) {
  const [, name, typed] = line.match(/^set +(\w+) *(.*)$/) || [];
  if (!name || !fieldOf(name)) return;
  if (lines[0] === "ok") mark(name, "");
  else refused(name, typed, lines.join(" "));
}

// Of many at once. What undo could not change is still to be undone.
function applied({ own, what, taken, refusals }) {
  const names = Object.keys(refusals);
  log(`${own ? "" : "another page: "}${what}: ${taken} changed${names.length ? `, ${names.length} refused:` : ""}\n`
    + [...new Set(Object.values(refusals))].join("\n"));
  if (!own) return;
  for (const name of names) refused(name, what, refusals[name]);
  const rest = Object.entries(parameters.undoing || {}).filter(([name]) => name in refusals);
  if (rest.length) parameters.undo.push(Object.fromEntries(rest));
  parameters.undoing = null;
  undoable();
}

function filter() {
  const part = $("filter").value.toLowerCase();
  for (const group of $("parameters").children) {
    const rows = [...group.querySelectorAll("tr")];
    rows.forEach((row) => { row.hidden = !row.textContent.toLowerCase().includes(part); });
    group.hidden = rows.every((row) => row.hidden);
    if (part) group.open = true;
  }
}

// ---- the file ----

const settingsText = () => [`# ${$("title").textContent}, ${new Date().toISOString()}: lines for the console, while it is off`,
  ...[...parameters.known.values()].map(({ name, value }) => `set ${name} ${value}`), ""].join("\n");

// {name: value} of what differs from the drive; throws with the first line that cannot be taken.
function settingsOf(text) {
  const values = {};
  text.split(/\r?\n/).forEach((line, n) => {
    if (/^\s*(#.*)?$/.test(line)) return;
    const [, name, value] = line.match(/^\s*(?:set\s+)?(\w+)(?:\s*=\s*|\s+)(-?\d+)(?:\s.*)?$/) || [];
    const known = parameters.known.get(name);
    if (!name) throw new Error(`line ${n + 1} is not 'set NAME VALUE': ${line}`);
    if (!known) throw new Error(`line ${n + 1}: this drive has no ${name}`);
    if (value < known.least || value > known.most) {
      throw new Error(`line ${n + 1}: ${name} must be ${known.least}...${known.most}, not ${value}`);
    }
    if (Number(value) !== known.value) values[name] = Number(value);
    else delete values[name];
  });
  return values;
}

async function restore(file) {
  try {
    const values = settingsOf(await file.text());
    if (Object.keys(values).length) apply(values, `from ${file.name}`);
    else log(`from ${file.name}: the drive has these settings already`);
  } catch (error) {
    log(`error: ${file.name}, nothing has changed: ${error.message}`);
  }
}

$("filter").oninput = filter;
$("reload").onclick = () => send({ kind: "parameters" });
$("undo").onclick = () => {
  parameters.undoing = parameters.undo.pop();
  apply(parameters.undoing, "undo");
};
$("to_file").onclick = () => download("settings.txt", "text/plain", settingsText());
$("from_file").onchange = () => {
  const [file] = $("from_file").files;
  if (file) restore(file);
  $("from_file").value = "";
};
