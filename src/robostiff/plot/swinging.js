"use strict";
// Moves the lines of a figure between two ends of a vibration: those that it has, and others.
function swing(place, other) {
  const period = 2400, pause = 50; // ms
  const ends = place._fullData.map(function (trace, i) {
    return { one: trace, other: other[i], axes: ["x", "y", "z"].filter(function (axis) {
      return trace[axis] && other[i][axis] && trace[axis].length === other[i][axis].length;
    }) };
  });
  const moving = ends.map(function (_, i) { return i; }).filter(function (i) {
    return ends[i].axes.some(function (axis) {
      return ends[i].one[axis].some(function (x, k) { return x !== ends[i].other[axis][k]; });
    });
  });
  const kept = {};
  for (const axis of ["xaxis", "yaxis"]) {
    const own = place._fullLayout[axis];
    if (own && own.range) kept[axis + ".range"] = own.range.slice();
  }
  const starts = moving.map(function (i) {
    const found = {};
    for (const axis of ends[i].axes) found[axis] = Array.from(ends[i].one[axis]);
    return found;
  });
  window.clearInterval(place.swinging);
  if (window.matchMedia("(prefers-reduced-motion: reduce)").matches || !moving.length) return;
  Plotly.relayout(place, kept);
  const begun = Date.now();
  let busy = false;
  place.swinging = window.setInterval(function () {
    const box = place.getBoundingClientRect();
    if (busy || box.bottom < 0 || box.top > window.innerHeight) return;
    const s = 0.5 - 0.5 * Math.cos(2 * Math.PI * (Date.now() - begun) / period);
    const update = { x: [], y: [], z: [] };
    moving.forEach(function (i, n) {
      for (const axis of ["x", "y", "z"]) {
        const from = starts[n][axis];
        update[axis].push(from && from.map(function (x, k) {
          return x === null ? null : (1 - s) * x + s * ends[i].other[axis][k];
        }));
      }
    });
    if (update.z.every(function (z) { return z === undefined; })) delete update.z;
    busy = true;
    Plotly.restyle(place, update, moving).then(function () { busy = false; });
  }, pause);
}
