// SPDX-License-Identifier: MIT
// Plots of signals against time, one for each unit, below each other with one zoom.
"use strict";

const POINTS = 700; // drawn of each signal; a download has them all

class Plots {
  constructor(place) {
    this.place = place;
    this.graphs = [];
  }

  // names of the columns behind the time, and their units
  layout(names, units) {
    this.graphs.forEach((g) => g.dygraph.destroy());
    this.place.replaceChildren();
    this.graphs = [...new Set(units)].map((unit) => {
      const columns = names.map((_, k) => k).filter((k) => units[k] === unit);
      const box = document.createElement("div");
      box.className = "plot";
      this.place.append(box);
      const labels = ["time", ...columns.map((k) => names[k])];
      const dygraph = new Dygraph(box, [[0, ...columns.map(() => 0)]], {
        labels, ylabel: unit, xlabel: "", legend: "always", animatedZooms: false, strokeWidth: 1.2, rightGap: 4, yRangePad: 6,
        axes: { x: { axisLabelFormatter: (x) => `${+x.toFixed(4)} s`, valueFormatter: (x) => `${x.toFixed(5)} s` } },
      });
      return { columns, dygraph };
    });
  }

  draw(rows, mark) {
    if (!rows.length) return;
    const step = Math.max(1, Math.ceil(rows.length / POINTS));
    const shown = step === 1 ? rows : rows.filter((_, i) => i % step === 0);
    for (const { columns, dygraph } of this.graphs) {
      const options = { file: shown.map((row) => [row[0], ...columns.map((k) => row[k + 1])]) };
      if (mark !== undefined) {
        options.underlayCallback = (canvas, area, g) => {
          const x = g.toDomXCoord(mark);
          canvas.fillStyle = "#c228";
          canvas.fillRect(x - 1, area.y, 2, area.h);
        };
      }
      dygraph.updateOptions(options);
    }
  }
}

function download(name, names, units, rows) {
  const heading = ["time_s", ...names.map((n, k) => (units[k] ? `${n} [${units[k]}]` : n))];
  const text = [heading, ...rows].map((row) => row.join(",")).join("\n") + "\n";
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000); // the browser has read it by then
}
