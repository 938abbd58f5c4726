// plotly.js, fetched after the numbers are on the page, and what all charts have in common.

import { learn } from "./known.js";
import { language, locale } from "../language.js";

const CONFIG = { displayModeBar: false, responsive: true, showTips: false };
const isTouch = matchMedia("(pointer: coarse)");

const part = (type) => new Intl.NumberFormat(locale, { useGrouping: "always" }).formatToParts(1234.5).find((one) => one.type === type).value;
const SEPARATORS = part("decimal") + part("group"); // as the page writes its numbers

/** A day on an axis, in the notation of d3-time-format: in the order of the locale, by number in German. */
function axisDay() {
  if (language === "de") return "%-d.%-m.";
  return new Intl.DateTimeFormat(locale, { month: "short", day: "numeric" }).formatToParts(0)[0].type === "month" ? "%b %-d" : "%-d %b";
}

const HALF_DAY_MS = 43_200_000;
const TICKS = [{ dtickrange: [null, HALF_DAY_MS], value: `%H:%M\n${axisDay()}` }, { dtickrange: [HALF_DAY_MS, null], value: axisDay() }];
export const TIME_AXIS = { type: "date", tickformatstops: TICKS };

/** Local time without a zone, as the charts expect it. */
export function local(time) {
  const when = new Date(time);
  return new Date(when.getTime() - when.getTimezoneOffset() * 60e3).toISOString().slice(0, 23);
}

let loading = null;

/** Stand-ins for the elements into which the library would write styles for maps, which the page's policy forbids. */
function standIns() {
  return document.body.dataset.chartStyles.split(" ").filter(Boolean).map((id) => {
    const meta = document.createElement("meta");
    meta.id = id;
    return meta;
  });
}

/** Resolves once the library is there; if it fails to load, the table and the text remain. */
function library() {
  loading ??= new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = document.body.dataset.chartLibrary;
    script.onload = () => resolve(globalThis.Plotly);
    script.onerror = () => reject(new Error("the chart library did not load"));
    document.head.append(...standIns(), script);
  });
  return loading;
}

/** A colour of the page as the charts understand it, with an opacity. */
export function colour(name, opacity = 1) {
  const probe = document.createElement("span");
  probe.style.color = `var(--${name})`;
  document.body.append(probe);
  const [red, green, blue] = getComputedStyle(probe).color.match(/[\d.]+/g);
  probe.remove();
  return `rgba(${red},${green},${blue},${opacity})`;
}

function axis(more = {}) {
  return {
    color: colour("soft"),
    gridcolor: colour("line"),
    linecolor: colour("line"),
    zerolinecolor: colour("line"),
    automargin: true,
    fixedrange: isTouch.matches, // on a phone a finger scrolls the page
    ...more,
  };
}

function layout({ xaxis, yaxis, ...more }) {
  return {
    margin: { l: 44, r: 8, t: 6, b: 28 },
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: "system-ui, sans-serif", size: 12, color: colour("soft") },
    hoverlabel: { bgcolor: colour("card"), bordercolor: colour("soft"), font: { color: colour("ink") } },
    hovermode: "closest",
    separators: SEPARATORS,
    showlegend: false,
    dragmode: isTouch.matches ? false : "zoom",
    xaxis: axis(xaxis),
    yaxis: axis(yaxis),
    ...more,
  };
}

const wanted = new WeakMap(); // place -> [traces, shape] to be drawn there next

/** Draws or redraws a chart, once numbers are on the page and there is room for it; of several requests, the last. */
export async function plot(place, traces, shape) {
  const wish = [traces, shape];
  wanted.set(place, wish);
  await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
  try {
    if (!place.checkVisibility()) return;
    const plotly = await library();
    if (wanted.get(place) !== wish) return;
    await plotly.react(place, traces, layout(shape), CONFIG);
    place.dataset.drawn = "yes";
  } catch (error) {
    console.info(error.message);
  }
}

document.addEventListener("unfold", ({ target }) => {
  for (const place of target.querySelectorAll(".chart")) if (wanted.has(place)) plot(place, ...wanted.get(place));
});

let palette = 0;
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => learn({ palette: ++palette }));
