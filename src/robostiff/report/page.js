"use strict";
(function () {
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const options = { responsive: true, displaylogo: false };
  const shown = new Map();

  function draw(figure) {
    const level = shown.get(figure.name);
    const drawn = figure.levels[level][dark.matches ? "dark" : "light"];
    const place = document.getElementById("plot-" + figure.name);
    // A view that was turned stays turned.
    const scene = place.layout && place.layout.scene;
    const layout = Object.assign({}, drawn.layout);
    if (scene && scene.camera && layout.scene) {
      layout.scene = Object.assign({}, layout.scene, { camera: scene.camera });
    }
    const made = Plotly.react(place, drawn.data, layout, options);
    const other = figure.levels[level].other;
    return other === undefined ? made : made.then(function () { swing(place, other); });
  }

  for (const figure of figures) {
    shown.set(figure.name, figure.start);
    draw(figure);
    const slider = document.getElementById("slider-" + figure.name);
    if (slider === null) continue;
    const label = document.getElementById("label-" + figure.name);
    slider.addEventListener("input", function () {
      shown.set(figure.name, Number(slider.value));
      label.textContent = figure.labels[Number(slider.value)];
      draw(figure);
    });
  }
  dark.addEventListener("change", function () { figures.forEach(draw); });
})();
