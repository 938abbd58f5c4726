// The load now: numbers, intervals, gauges, age.

import { ageNow, known, show } from "./known.js";
import { element, made, say, write } from "./page.js";
import { phrase, taughtHere } from "./phrases.js";
import { halfOf, withInterval } from "./plus-minus.js";
import { UNKNOWN, USEFUL_HELP, ago, between, capital, clock, figure, kmh, reasons as named } from "./words.js";

const interval = (bounds, digits, unit) => (bounds == null ? "" : phrase("interval", { between: between(bounds, digits, unit) }));

/** The outcome of the last batch, if none was weighed yet, and what to do about it. */
function noneYet(refusal, reasons, learning, status) {
  const isFromBefore = refusal?.rejected.includes("no_calibration") && status?.calibration_id != null;
  if (isFromBefore || (refusal == null && status?.calibration_id != null)) return phrase("ready");
  if (refusal == null) return phrase("none_yet");
  const here = refusal.rejected.includes("no_calibration") ? taughtHere(learning) : null;
  if (here !== null) return here;
  const advice = refusal.rejected.map((reason) => reasons.get(reason)?.advice).filter(Boolean).map((text) => `${text.replaceAll("`", "")}.`);
  const todo = advice.length ? phrase("to_do", { advice: advice.join(" ") }) : "";
  return phrase("none_because", { reasons: named(refusal.rejected) }) + todo;
}

/** The last batch was refused, none was weighed since, and the reason is not merely the road. */
function isDoubted({ last_rejection: refusal, ...latest }, reasons) {
  if (refusal == null || latest.payload_kg == null || (!latest.provisional && refusal.t_end <= latest.t_end)) return false;
  return refusal.rejected.some((reason) => ["The sensors", "The answer"].includes(reasons.get(reason)?.cause));
}

function notes(latest, reasons, learning, status) {
  const said = [];
  if (isDoubted(latest, reasons)) said.push(phrase("note_doubted", { reasons: named(latest.last_rejection.rejected) }));
  if (latest.is_stored === false) said.push(phrase("note_unstored"));
  if (latest.is_stale) said.push(phrase("note_old"));
  if (latest.provisional) said.push(phrase("note_early"));
  if (latest.rejected.includes("no_estimate_yet")) said.push(noneYet(latest.last_rejection, reasons, learning, status));
  else if (latest.rejected.length) said.push(phrase("note_none", { reasons: named(latest.rejected) }));
  return said.join(" ");
}

/** A bar over the range that calibration saw, with the interval and the value on it; an interval beyond it sticks out. */
function gauge(id, value, bounds, seen, unit) {
  const place = element(id);
  if (value == null || bounds == null || seen == null) return place.replaceChildren();
  const from = Math.min(seen[0], bounds[0]), to = Math.max(seen[1], bounds[1]);
  const percent = (x) => `${(100 * x) / (to - from)}%`;
  const bar = (name, [low, high]) => {
    const built = made("span", "", name);
    built.style.setProperty("--low", percent(low - from));
    built.style.setProperty("--wide", percent(high - low));
    return built;
  };
  return place.replaceChildren(
    bar("track", seen), bar("band", bounds), bar("mark", [value, value]),
    made("span", phrase("calibrated_range", { between: between(seen, 0, unit) }), "scale"),
  );
}

function writeNumber(id, value, digits, unit) {
  write(id, figure(value, digits, unit));
  element(id).classList.toggle("none", value == null);
}

function loadSoFar(latest) {
  const n = latest.epoch_n_batches;
  if (!(n > 1)) return n === 1 ? phrase("one_batch") : UNKNOWN;
  return phrase("load_so_far_of", { n, weight: withInterval(latest.epoch_payload_kg, latest.epoch_payload_interval95_kg, 0, "kg") });
}

function showAge() {
  const age = ageNow();
  write("age", age == null ? UNKNOWN : ago(age));
}

let announcedId = null;

function announce(latest) {
  if (latest.id === announcedId || latest.payload_kg == null) return;
  const said = { kg: figure(latest.payload_kg, 0, "kg"), share: figure(latest.front_share_pct, 1, "%") };
  write("announcement", phrase(latest.front_share_pct == null ? "announced" : "announced_share", said));
  announcedId = latest.id;
}

/** Each source with its part of the error, and each remedy once; the widths are half those of 95 % intervals, each as much
 * wider than a normal error as that of the payload. */
show(({ latest, sources, remedies: advised }) => {
  const lines = latest?.error_budget ?? [];
  element("budget").hidden = lines.length === 0;
  if (lines.length === 0) return;
  const perStd = halfOf(latest.payload_interval95_kg) / latest.payload_std_kg;
  const half = (std) => figure(perStd * std, 0, "kg");
  write("budget-why", phrase("why", { kg: half(latest.payload_std_kg) }));
  const shown = lines.filter((line) => perStd * line.payload_kg >= 0.5); // less would read as 0 kg
  element("budget-lines").replaceChildren(...shown.map((line) => {
    const built = made("li", [made("span", capital(sources.get(line.source) ?? line.source.replaceAll("_", " "))), made("span", `±\u00a0${half(line.payload_kg)}`)]);
    built.style.setProperty("--part", `${(100 * line.payload_kg) / latest.payload_std_kg}%`);
    return built;
  }));
  const helps = ({ remedy, payload_with_remedy_kg: then }) => advised.has(remedy) && then < (1 - USEFUL_HELP) * latest.payload_std_kg;
  const remedies = new Map(shown.filter(helps).map((line) => [line.remedy, line.payload_with_remedy_kg]));
  element("budget-better").hidden = remedies.size === 0;
  element("budget-remedies").replaceChildren(...[...remedies].sort(([, one], [, other]) => one - other).map(([remedy, then]) =>
    made("li", phrase("budget_remedy", { advice: capital(advised.get(remedy)), now: half(latest.payload_std_kg), then: half(then) }))));
}, "latest", "sources", "remedies");

show(({ latest, vehicle, reasons, learning, status, isReachable }) => {
  if (latest === null) return;
  const seen = vehicle?.calibration;
  writeNumber("payload", latest.payload_kg, 0, "kg");
  write("payload-range", interval(latest.payload_interval95_kg, 0, "kg"));
  gauge("payload-gauge", latest.payload_kg, latest.payload_interval95_kg, seen?.payload_seen_kg, "kg");
  writeNumber("share", latest.front_share_pct, 1, "%");
  write("share-range", interval(latest.front_share_interval95_pct, 1, "%"));
  gauge("share-gauge", latest.front_share_pct, latest.front_share_interval95_pct, seen?.front_share_seen_pct, "%");
  write("age-at", latest.t_end ? phrase("age_at", { time: clock(latest.t_end) }) : "");
  write("load-so-far", loadSoFar(latest));
  write("speed", kmh(latest.mean_speed_mps));
  element("latest").classList.toggle("stale", latest.is_stale || isReachable === false);
  say("note", notes(latest, reasons, learning, status));
  document.title = latest.payload_kg == null ? "Springscale" : `${figure(latest.payload_kg, 0, "kg")} – Springscale`;
  showAge();
  announce(latest);
}, "latest", "vehicle", "reasons", "learning", "status", "isReachable");

element("budget").open = matchMedia("(min-width: 56rem)").matches; // where there is room for it
setInterval(() => known.latest && showAge(), 1000);
