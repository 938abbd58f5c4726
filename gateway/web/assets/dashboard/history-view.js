// History: every batch with its 95 % band over time, as charts and as a table.

import { known, show } from "./known.js";
import { element, made, write } from "./page.js";
import { row } from "./parts.js";
import { TIME_AXIS, colour, local, plot } from "./plot.js";
import { phrase } from "./phrases.js";
import { withStd } from "./plus-minus.js";
import { between, clock, figure, kmh, reasons } from "./words.js";

const HOUR_MS = 3600e3;
const QUANTITIES = {
  payload: { value: "payload_kg", interval: "payload_interval95_kg", digits: 0, unit: "kg" },
  share: { value: "front_share_pct", interval: "front_share_interval95_pct", digits: 1, unit: "%" },
  side: { value: "cg_left_m", interval: "cg_left_interval95_m", digits: 3, unit: "m", isRare: true },
};

function shownBatches({ batches, hours }) {
  if (!batches?.length) return [];
  const earliest = new Date(batches[0].t_end).getTime() - hours * HOUR_MS;
  return batches.filter((batch) => new Date(batch.t_end).getTime() > earliest).reverse();
}

/** Boxes from start to end of each batch and over its interval, apart from one another. */
function band(batches, quantity, name, opacity) {
  const x = [], y = [];
  for (const batch of batches) {
    const [from, to] = [local(batch.t_start), local(batch.t_end)], [low, high] = batch[quantity.interval];
    x.push(from, to, to, from, from, null);
    y.push(low, low, high, high, low, null);
  }
  return { x, y, type: "scatter", mode: "lines", fill: "toself", line: { width: 0 }, fillcolor: colour(name, opacity), hoverinfo: "skip" };
}

function values(batches, quantity) {
  const x = [], y = [], text = [];
  for (const batch of batches) {
    const said = `${figure(batch[quantity.value], quantity.digits, quantity.unit)}<br>${phrase("interval", { between: between(batch[quantity.interval], quantity.digits, quantity.unit) })}<br>${phrase("until", { time: clock(batch.t_end) })}`;
    x.push(local(batch.t_start), local(batch.t_end), null);
    y.push(batch[quantity.value], batch[quantity.value], null);
    text.push(said, said, "");
  }
  return { x, y, text, type: "scatter", mode: "lines", line: { color: colour("accent"), width: 2.5 }, hovertemplate: "%{text}<extra></extra>" };
}

/** Rejected batches as crosses on the floor of the chart. */
function refusals(batches) {
  return {
    x: batches.map((batch) => local(batch.t_end)),
    y: batches.map(() => 0.03),
    yaxis: "y2",
    text: batches.map((batch) => `${phrase("not_weighed_for", { reasons: reasons(batch.rejected) })}<br>${phrase("until", { time: clock(batch.t_end) })}`),
    type: "scatter",
    mode: "markers",
    marker: { symbol: "x", size: 8, color: colour("refused") },
    hovertemplate: "%{text}<extra></extra>",
  };
}

function truthLine(truth, quantity, until) {
  const shown = truth.filter((load) => load.t_start < until && load[quantity.value] != null);
  const x = shown.map((load) => local(load.t_start)), y = shown.map((load) => load[quantity.value]);
  if (shown.length) { x.push(local(until)); y.push(y.at(-1)); }
  return { x, y, type: "scatter", mode: "lines", line: { shape: "hv", color: colour("truth"), width: 5 }, opacity: 0.75, text: y.map((kg) => phrase("actually", { x: figure(kg, quantity.digits, quantity.unit) })), hovertemplate: "%{text}<extra></extra>" };
}

function traces(batches, quantity) {
  const weighed = batches.filter((batch) => batch[quantity.interval] != null);
  const early = known.early?.[quantity.interval] == null ? [] : [known.early];
  const until = [...batches, ...early].at(-1).t_end;
  return [
    truthLine(known.truth, quantity, until),
    band(weighed, quantity, "accent", 0.3),
    band(early, quantity, "accent", 0.15),
    values([...weighed, ...early], quantity),
    refusals(batches.filter((batch) => batch.rejected.length > 0)),
  ];
}

function inWords(batches, quantity) {
  const weighed = batches.filter((batch) => batch[quantity.interval] != null);
  if (!weighed.length) return phrase("none_weighed");
  const last = weighed.at(-1);
  return phrase("chart_words", {
    weighed: weighed.length, all: batches.length, value: figure(last[quantity.value], quantity.digits, quantity.unit),
    interval: between(last[quantity.interval], quantity.digits, quantity.unit), time: clock(last.t_end),
  });
}

function range(batches) {
  const ends = [batches[0].t_start, (known.early ?? batches.at(-1)).t_end].map((iso) => new Date(iso).getTime());
  const margin = 0.02 * (ends[1] - ends[0]);
  return [ends[0] - margin, ends[1] + margin].map(local);
}

const floor = { overlaying: "y", range: [0, 1], visible: false, fixedrange: true };

function drawCharts() {
  const batches = shownBatches(known);
  element("history").classList.toggle("empty", !batches.length);
  if (known.batches !== null) write("history-none", phrase("no_batch"));
  if (!batches.length) return;
  for (const [name, quantity] of Object.entries(QUANTITIES)) {
    const isTold = !quantity.isRare || batches.some((batch) => batch[quantity.interval] != null);
    element(`${name}-chart`).closest("figure").hidden = !isTold;
    if (!isTold) continue;
    element(`${name}-chart-words`).textContent = inWords(batches, quantity);
    plot(element(`${name}-chart`), traces(batches, quantity), {
      xaxis: { ...TIME_AXIS, range: range(batches) },
      yaxis: { zeroline: name !== "share" },
      yaxis2: floor,
    });
  }
}

function drawTable({ batches }) {
  if (batches === null) return;
  const isSideTold = batches.some((batch) => batch.cg_left_m != null);
  element("side-head").hidden = !isSideTold;
  const rows = batches.map((batch) => {
    const isRejected = batch.rejected.length > 0;
    return row([
      clock(batch.t_end),
      isRejected ? "–" : figure(batch.payload_kg, 0, "kg"),
      isRejected ? "–" : between(batch.payload_interval95_kg, 0, "kg"),
      isRejected ? "–" : figure(batch.front_share_pct, 1, "%"),
      isRejected ? "–" : between(batch.front_share_interval95_pct, 1, "%"),
      ...(isSideTold ? [isRejected ? "–" : withStd(batch.cg_left_m, batch.cg_left_std_m, 3, "m")] : []),
      kmh(batch.mean_speed_mps),
      isRejected ? phrase("not_weighed_for", { reasons: reasons(batch.rejected) }) : phrase("weighed"),
    ], isRejected ? "rejected" : "");
  });
  element("recent").replaceChildren(...rows);
}

function drawLegend({ truth }) {
  element("history-legend").replaceChildren(
    made("li", phrase("estimate"), "estimate"),
    made("li", phrase("its_interval"), "estimate band-key"),
    ...(truth.length ? [made("li", phrase("truth"), "truth")] : []),
    made("li", phrase("not_weighed"), "refused"),
  );
}

show(drawCharts, "batches", "early", "truth", "hours", "palette");
show(drawTable, "batches");
show(drawLegend, "batches", "truth");
