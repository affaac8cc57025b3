// SPDX-License-Identifier: MIT
// What can be read from plots: values at and between two cursors, ranges, a spectrum, the vectors of current and voltage.
"use strict";

// Of a column of rows [time, values...], between two times.
function statistics(rows, column, from, to) {
  const values = rows.filter((row) => row[0] >= from && row[0] <= to).map((row) => row[column]);
  if (!values.length) return null;
  const mean = values.reduce((sum, v) => sum + v, 0) / values.length;
  const least = Math.min(...values), most = Math.max(...values);
  return { mean, least, most, span: most - least, rms: Math.sqrt(values.reduce((sum, v) => sum + v * v, 0) / values.length) };
}

// The row that is nearest in time; rows are in its order.
function nearest(rows, time) {
  let low = 0, high = rows.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (rows[middle][0] < time) low = middle; else high = middle;
  }
  return time - rows[low][0] < rows[high][0] - time ? rows[low] : rows[high];
}

// In place, of a length that is a power of two: [real, imaginary] becomes its discrete Fourier transform.
function transform(re, im) {
  const n = re.length;
  for (let i = 1, j = 0; i < n; i++) { // bits reversed
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) [re[i], re[j], im[i], im[j]] = [re[j], re[i], im[j], im[i]];
  }
  for (let size = 2; size <= n; size *= 2) {
    for (let k = 0; k < size / 2; k++) {
      const c = Math.cos(2 * Math.PI * k / size), s = -Math.sin(2 * Math.PI * k / size);
      for (let a = k; a < n; a += size) {
        const b = a + size / 2, x = c * re[b] - s * im[b], y = c * im[b] + s * re[b];
        [re[a], re[b], im[a], im[b]] = [re[a] + x, re[a] - x, im[a] + y, im[a] - y];
      }
    }
  }
}

// [[Hz, peak amplitude], ...] of the last 2^n values, without their mean, through a Hann window.
function spectrum(values, perS) {
  const n = 2 ** Math.floor(Math.log2(values.length)), last = values.slice(-n);
  const mean = last.reduce((sum, v) => sum + v, 0) / n;
  const re = Float64Array.from(last, (v, k) => (v - mean) * (1 - Math.cos(2 * Math.PI * k / n))), im = new Float64Array(n);
  transform(re, im);
  return Array.from({ length: n / 2 }, (_, k) => [k * perS / n, 2 * Math.hypot(re[k], im[k]) / n]);
}

// ---- on the page ----

const measure = { graph: null };

// What is measured on: {plots, names, units, rows, perS}. Live rows may have gaps: where frames were lost.
function source() {
  const on = $("measure_on").value === "live" ? live : captured;
  const units = on === live ? unitsOf(live.names) : captured.units;
  const span = on.rows.length > 1 ? on.rows.at(-1)[0] - on.rows[0][0] : 0;
  return { plots: on.plots, names: on.names, units, rows: on.rows, perS: span ? (on.rows.length - 1) / span : 0 };
}

const cursor = (name) => ($(`cursor_${name}`).value === "" ? null : Number($(`cursor_${name}`).value));
const short = (x) => (Number.isFinite(x) ? String(+x.toPrecision(5)) : "");

function measured() {
  const { names, units, rows, perS } = source(), a = cursor("a"), b = cursor("b");
  if (!rows.length) return;
  const [from, to] = a !== null && b !== null ? [Math.min(a, b), Math.max(a, b)] : [rows[0][0], rows.at(-1)[0]];
  const at = [a, b].map((time) => (time === null ? null : nearest(rows, time)));
  $("measured").replaceChildren(
    element("tr", {}, ...["", "at A", "at B", "B - A", "mean", "rms", "least", "most", "span"].map((text) =>
      element(text ? "th" : "td", {}, text))),
    ...names.map((name, k) => {
      const s = statistics(rows, k + 1, from, to) || {}, [inA, inB] = at.map((row) => (row ? row[k + 1] : NaN));
      return element("tr", {}, element("th", {}, `${name}${units[k] && ` [${units[k]}]`}`),
        ...[inA, inB, inB - inA, s.mean, s.rms, s.least, s.most, s.span].map((x) => element("td", {}, short(x))));
    }));
  $("between").textContent = a === null || b === null ? `${short(to - from)} s, ${Math.round(perS)} samples a second`
    : `B - A: ${short(b - a)} s, ${short(1 / Math.abs(b - a))} Hz`;
}

function frequencies() {
  const { names, units, rows, perS } = source(), k = names.indexOf($("fft_of").value);
  if (k < 0 || rows.length < 16) return;
  const lines = spectrum(rows.map((row) => row[k + 1]), perS);
  const [hz, amplitude] = lines.slice(2).reduce((most, line) => (line[1] > most[1] ? line : most), [0, 0]);
  $("fft_peak").textContent = `most: ${short(amplitude)} ${units[k]} at ${short(hz)} Hz, lines ${short(perS / 2 / lines.length)} Hz apart`;
  measure.graph?.destroy();
  measure.graph = chart($("fft"), $("fft_legend"), lines, [names[k]], ["Hz", units[k]]);
  $("fft").setAttribute("aria-label", `spectrum of ${names[k]}; ${$("fft_peak").textContent}`);
}

function offer() {
  const { names, units } = source();
  for (const [id, words] of [["fft_of", names], ["range_of", [...new Set(units)]]]) {
    const before = $(id).value;
    $(id).replaceChildren(...words.map((word) => new Option(word || "no unit", word)));
    if (words.includes(before)) $(id).value = before;
  }
}

function placeCursors() {
  const { plots, rows } = source();
  for (const name of ["a", "b"]) {
    if (cursor(name) === null) delete plots.lines[`cursor-${name}`];
    else plots.lines[`cursor-${name}`] = cursor(name);
  }
  plots.draw(plots.rows.length ? plots.rows : rows);
  measured();
}

function setRange(automatic) {
  const { plots, rows } = source(), [least, most] = ["range_least", "range_most"].map((id) => Number($(id).value));
  if (automatic || !(least < most)) delete plots.ranges[$("range_of").value];
  else plots.ranges[$("range_of").value] = [least, most];
  $("range_said").textContent = automatic || least < most ? "" : "the lower one first";
  plots.draw(plots.rows.length ? plots.rows : rows);
}

// A click sets A, with Shift B.
function cursorsOf(plots, name) {
  plots.onClick = (event, time) => {
    $("measure_on").value = name;
    $(event.shiftKey ? "cursor_b" : "cursor_a").value = +time.toFixed(6);
    offer();
    placeCursors();
  };
}

cursorsOf(live.plots, "live");
cursorsOf(captured.plots, "captured");
$("cursor_a").oninput = $("cursor_b").oninput = placeCursors;
$("measure_on").onchange = () => { offer(); placeCursors(); showTask(); };
$("range_set").onclick = () => setRange(false);
$("range_auto").onclick = () => setRange(true);
$("between_cursors").onclick = () => {
  const times = [cursor("a"), cursor("b")].sort((x, y) => x - y);
  if (times[0] !== null && times[0] < times[1]) source().plots.zoom(times);
};
$("all").onclick = () => source().plots.zoom(null);
$("fft_of").onchange = $("fft_now").onclick = frequencies;
