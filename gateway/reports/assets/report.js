"use strict";
// Lets plotly take the place of each still picture on screen. Without plotly.min.js the pictures stay.
(() => {
  if (!window.Plotly) return;
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  const themed = (layout) => {
    const axes = Object.keys(layout).filter((key) => /^[xy]axis\d*$/.test(key));
    const looks = { gridcolor: colour("--grid"), linecolor: colour("--line"), tickcolor: colour("--line") };
    return {
      ...layout,
      ...Object.fromEntries(axes.map((key) => [key, { ...layout[key], ...looks }])),
      paper_bgcolor: "rgba(0,0,0,0)",
      plot_bgcolor: "rgba(0,0,0,0)",
      font: { color: colour("--ink"), family: "system-ui, sans-serif", size: 12 },
      hoverlabel: { bgcolor: colour("--card"), font: { color: colour("--ink") } },
    };
  };

  const isPhone = matchMedia("(max-width: 48rem)");
  const draw = (figure) => {
    const place = figure.querySelector(".live");
    const chart = JSON.parse(figure.querySelector("script").textContent);
    const layout = isPhone.matches ? chart.narrow : chart.layout;
    const options = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d"] };
    place.hidden = false;
    const still = figure.querySelector("img");
    if (still) still.style.display = "none";
    place.firstElementChild || place.append(document.createElement("div"));
    Plotly.react(place.firstElementChild, chart.data, themed(layout), options);
  };

  const visible = () => [...document.querySelectorAll("figure")].filter((one) => !one.closest("details:not([open])"));
  const drawAll = () => visible().forEach(draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);
  isPhone.addEventListener("change", drawAll);
  document.querySelectorAll("details").forEach((one) => one.addEventListener("toggle", () => {
    if (one.open) one.querySelectorAll("figure").forEach(draw);
  }));
  let shut = [];
  addEventListener("beforeprint", () => {
    shut = [...document.querySelectorAll("details:not([open])")];
    shut.forEach((one) => { one.open = true; });
  });
  addEventListener("afterprint", () => shut.forEach((one) => { one.open = false; }));
  drawAll();
})();
