"use strict";
(async function () {
  // What is folded is printed, too.
  const folded = document.getElementsByTagName("details");
  let unfolded = [];
  window.addEventListener("beforeprint", function () {
    unfolded = [...folded].filter((one) => !one.open);
    for (const one of unfolded) one.open = true;
  });
  window.addEventListener("afterprint", function () {
    for (const one of unfolded) one.open = false;
  });

  // RFC 1924 with a full stop for the sign that begins a tag
  const digits = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;.=>?@^_`{|}~";
  const value = new Uint8Array(128);
  for (let i = 0; i < digits.length; i++) value[digits.charCodeAt(i)] = i;

  // Text that was compressed and written in 85 characters, four bytes in five of them.
  async function unpacked(name) {
    const text = document.getElementById(name).textContent.trim();
    const length = text.length - Math.ceil(text.length / 5);
    const bytes = new Uint8Array(4 * Math.ceil(text.length / 5));
    for (let i = 0, place = 0; i < text.length; i += 5, place += 4) {
      let word = 0;
      for (let k = 0; k < 5; k++) word = 85 * word + (i + k < text.length ? value[text.charCodeAt(i + k)] : 84);
      for (let k = 0; k < 4; k++) bytes[place + k] = Math.floor(word / 2 ** (24 - 8 * k)) % 256;
    }
    const packed = new Blob([bytes.subarray(0, length)]).stream();
    return new Response(packed.pipeThrough(new DecompressionStream("gzip"))).text();
  }

  const { colours, figures } = JSON.parse(await unpacked("figures"));
  if (figures.length === 0) return;
  const script = document.createElement("script");
  script.textContent = await unpacked("plotly");
  document.head.append(script);

  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const options = { responsive: true, displaylogo: false, showSendToCloud: false };
  const shown = new Map();

  function layoutOf(figure, theme, width) {
    // names of colours become those of the theme
    const text = JSON.stringify(figure.levels[shown.get(figure.name)].drawn);
    const drawn = JSON.parse(text.replace(/hsl\((\d+),0%,0%\)/g, (_, i) => colours[theme][i]));
    const place = document.getElementById("plot-" + figure.name);
    // A view that was turned stays turned.
    const scene = place.layout && place.layout.scene;
    if (drawn.layout.scene) {
      const eye = drawn.layout.scene.camera.eye;
      // where there is little room, numbers on axes at both sides need a step back
      const away = Math.max(1, 700 / (width || 700));
      for (const axis in eye) eye[axis] *= away;
      if (scene && scene.camera) drawn.layout.scene.camera = scene.camera;
    }
    return drawn;
  }

  function draw(figure) {
    const place = document.getElementById("plot-" + figure.name);
    const { chart } = figure.levels[shown.get(figure.name)];
    if (chart !== undefined) {
      place.innerHTML = chart;
      return;
    }
    const drawn = layoutOf(figure, dark.matches ? "dark" : "light", place.clientWidth);
    const made = Plotly.react(place, drawn.data, drawn.layout, options);
    const other = figure.levels[shown.get(figure.name)].other;
    return other === undefined ? made : made.then(function () { swing(place, other); });
  }

  // What is printed: an image on light ground, as printers leave out what a graphics card has drawn.
  async function print(figure) {
    const drawn = layoutOf(figure, "light", 560);
    const size = { width: 560, height: (drawn.layout.height || 480) - (drawn.layout.scene ? 100 : 0) };
    const light = { data: drawn.data, layout: Object.assign({}, drawn.layout, size) };
    const image = document.getElementById("print-" + figure.name);
    image.src = await Plotly.toImage(light, Object.assign({ format: "png", scale: 2 }, size));
  }

  let printing = Promise.resolve();
  const waiting = new Map();
  function printLater(figure) {
    if (figure.levels[0].chart !== undefined) return;
    clearTimeout(waiting.get(figure.name));
    const begin = () => { printing = printing.then(() => print(figure)); };
    waiting.set(figure.name, setTimeout(begin, 400));
  }

  for (const figure of figures) {
    shown.set(figure.name, figure.start);
    await draw(figure);
    if (figure.levels[0].chart === undefined) {
      document.getElementById("plot-" + figure.name).on("plotly_relayout", () => printLater(figure));
    }
    printLater(figure);
    const slider = document.getElementById("slider-" + figure.name);
    if (slider === null) continue;
    const label = document.getElementById("label-" + figure.name);
    slider.addEventListener("input", function () {
      shown.set(figure.name, Number(slider.value));
      label.textContent = figure.labels[Number(slider.value)];
      draw(figure);
      printLater(figure);
    });
  }
  dark.addEventListener("change", function () { figures.forEach(draw); });
})();
