// Spectra of the last batch, the fitted model over them, and the bands of the ratio indexes.

import { show } from "./known.js";
import { element, made, write } from "./page.js";
import { colour, plot } from "./plot.js";
import { phrase } from "./phrases.js";
import { clock, figure, reasons } from "./words.js";

const PANELS = [
  { name: "vertical_acceleration_mps2_rthz", title: phrase("spectra_acceleration"), bands: "acceleration_bands" },
  { name: "pitch_rate_radps_rthz", title: phrase("spectra_pitch"), bands: "pitch_rate_bands" },
  { name: "coherence", title: phrase("spectra_coherence"), range: [0, 1.05] },
  { name: "phase_rad", title: phrase("spectra_phase"), range: [-Math.PI, Math.PI] },
];

const TICKS = [0.00001, 0.00003, 0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1, 3, 10]; // evenly apart on a log scale
const RESONANCE_BELOW_HZ = 4; // chosen: spectra are high there: names of bands stand at the foot, elsewhere at the head

function panel({ name, title }) {
  const place = made("div", "", "chart");
  place.id = `spectra-${name}`;
  place.setAttribute("role", "img");
  place.setAttribute("aria-label", phrase("spectra_chart", { title }));
  return made("figure", [made("figcaption", title), place]);
}

function line(spectra, name, colourName, width) {
  return {
    x: spectra.freq_hz,
    y: spectra[name],
    type: "scatter",
    mode: "lines",
    line: { color: colour(colourName), width },
    hovertemplate: "%{x:.2f} Hz: %{y:.3g}<extra></extra>",
  };
}

/** A phase that wraps is interrupted at the jump, not drawn across. */
function wrapped(trace) {
  const y = trace.y.map((phase, n) => (n > 0 && Math.abs(phase - trace.y[n - 1]) > Math.PI ? null : phase));
  return { ...trace, y };
}

function bandShapes(bands) {
  return (bands ?? []).map((band, n) => ({
    type: "rect",
    yref: "paper",
    x0: band.centre_hz - Math.max(band.width_hz, 0.06) / 2,
    x1: band.centre_hz + Math.max(band.width_hz, 0.06) / 2,
    y0: 0,
    y1: 1,
    line: { width: 0 },
    fillcolor: colour("soft", 0.45),
    label: {
      text: phrase(n === 0 ? "band_over" : "band_under"),
      textposition: band.centre_hz < RESONANCE_BELOW_HZ ? "bottom left" : "top left",
      font: { size: 10, color: colour("soft") },
      textangle: 0,
    },
  }));
}

function drawPanels(told) {
  for (const each of PANELS) {
    const lines = [line(told.spectra, each.name, "accent", 1.8)];
    if (told.model) lines.push(line(told.model, each.name, "model", 2.2));
    plot(element(`spectra-${each.name}`), each.name === "phase_rad" ? lines.map(wrapped) : lines, {
      xaxis: { title: { text: "Hz", standoff: 2 }, range: [0.5, 15] },
      yaxis: each.range ? { range: each.range } : { type: "log", tickvals: TICKS, ticktext: TICKS.map(String) },
      shapes: bandShapes(told[each.bands]),
    });
  }
}

function caption(told) {
  const said = { time: clock(told.t_end), kg: figure(told.payload_kg, 0, "kg"), share: figure(told.front_share_pct, 1, "%"), reasons: reasons(told.rejected) };
  return phrase(told.model ? "spectra_model" : told.rejected.length ? "spectra_refused" : "spectra_none", said);
}

function drawLegend(told) {
  element("spectra-legend").replaceChildren(
    made("li", phrase("measured"), "estimate"),
    ...(told.model ? [made("li", phrase("fitted"), "model")] : []),
    ...(told.acceleration_bands || told.pitch_rate_bands ? [made("li", phrase("bands"), "index-band band-key")] : []),
  );
}

show(({ spectra: told }) => {
  if (told !== null && told.id === null) write("spectra-of", phrase("no_batch"));
  if (!told?.spectra) return;
  if (!element("spectra-charts").children.length) element("spectra-charts").append(...PANELS.map(panel));
  write("spectra-of", caption(told));
  drawLegend(told);
  drawPanels(told);
}, "spectra", "palette");
