// SPDX-License-Identifier: MIT
// The vectors of current and voltage in the rotor's frame: d to the right, q upwards, a ring where i_max_ma is.
"use strict";

const TAIL = 300; // samples before the last one

// [[d, q], ...] of i or v, or null where they are not both among the signals.
function pointsOf(letter, names, rows) {
  const d = names.indexOf(`${letter}_d`) + 1, q = names.indexOf(`${letter}_q`) + 1;
  return d && q ? rows.slice(-TAIL).map((row) => [row[d], row[q]]) : null;
}

const polar = ([d, q]) => [Math.hypot(d, q), Math.atan2(q, d) * 180 / Math.PI];

function drawVector(canvas, points, full, name) {
  const pen = canvas.getContext("2d"), half = canvas.width / 2, scale = 0.9 * half / full;
  const to = ([d, q]) => [half + d * scale, half - q * scale];
  pen.clearRect(0, 0, canvas.width, canvas.height);
  pen.strokeStyle = colour("line");
  pen.beginPath();
  pen.arc(half, half, 0.9 * half, 0, 2 * Math.PI);
  pen.moveTo(0, half); pen.lineTo(canvas.width, half); pen.moveTo(half, 0); pen.lineTo(half, canvas.height);
  pen.stroke();
  pen.fillStyle = colour(name);
  points.forEach((point) => pen.fillRect(...to(point), 1.5, 1.5));
  pen.strokeStyle = colour(name);
  pen.lineWidth = 3;
  pen.beginPath();
  pen.moveTo(half, half);
  pen.lineTo(...to(points.at(-1)));
  pen.stroke();
  pen.lineWidth = 1;
}

// Full scale: i_max_ma for currents; for voltages what a circle in the hexagon has, 1 / sqrt(3) of the bus.
function drawVectors() {
  if (!$("vector_view").open || !live.plots.isSeen()) return;
  const iMax = (parameters.known.get("i_max_ma")?.value || 1000) / 1000;
  for (const [letter, unit, full, name] of [["i", "A", iMax, "curve-1"], ["v", "% of bus", 100 / Math.sqrt(3), "curve-2"]]) {
    const points = pointsOf(letter, live.names, live.rows), canvas = $(`vector_${letter}`), text = $(`vector_${letter}_text`);
    canvas.hidden = !points;
    if (!points) text.textContent = `${letter}_d and ${letter}_q are not both among the signals`;
    if (!points?.length) continue;
    drawVector(canvas, points, full, name);
    const [length, degrees] = polar(points.at(-1));
    text.textContent = `${letter}: ${short(length)} ${unit}, ${Math.round(degrees)} degrees from d; ring ${short(full)} ${unit}`;
  }
}
