// The last day: what was loaded and unloaded where, and the trips between; as a timeline, and in words.

import { show } from "/assets/dashboard/known.js";
import { element, made, write } from "/assets/dashboard/page.js";
import { figure, number, withStd } from "/assets/dashboard/words.js";

const DAY_MS = 24 * 3600 * 1000;
const WIDTH = 1000;
const HEIGHT = 170;
const FLOOR = 140; // of the bars
const CEILING = 24;
const LEAST_WIDTH = 3;
const SURE = 0.99;
const SVG = "http://www.w3.org/2000/svg";

const at = (iso) => new Date(iso).getTime();

const hour = (iso) => new Date(iso).toLocaleTimeString(undefined, { hour: "2-digit", minute: "2-digit" });

const span = (entry) => `${hour(entry.t_start)} to ${hour(entry.t_end)}`;

const place = (where) => (where ? ` at ${where.latitude_deg}, ${where.longitude_deg}` : "");

function eventText(event) {
  const done = event.change_kg >= 0 ? "loaded" : "unloaded";
  const sure = event.probability >= SURE ? "" : `, ${number(100 * event.probability, 0)} % sure that anything was`;
  const stops = event.stops.length > 1 ? `, at one of ${event.stops.length} stops or at several` : "";
  const change = withStd(Math.abs(event.change_kg), event.change_std_kg, 0, "kg");
  return `${span(event)}: ${change} ${done}${place(event.place)}${stops}${sure}. ${figure(event.after.payload_kg, 0, "kg")} aboard then.`;
}

function tripText(trip) {
  const load = trip.payload_kg == null ? "with an unknown load" : `with ${withStd(trip.payload_kg, trip.payload_std_kg, 0, "kg")}`;
  const over = trip.overloaded_share ? `, ${number(100 * trip.overloaded_share, 0)} % of the way overloaded` : "";
  const going = trip.is_over ? "" : ", still going";
  return `${span(trip)}: drove ${figure(trip.distance_m / 1000, 1, "km")} ${load}${over}${going}.`;
}

/** Those of the last day before the newest, oldest first; what was withdrawn is gone. */
function lastDay(events, trips) {
  const told = [...events.filter((event) => !event.is_withdrawn), ...trips];
  const newest = Math.max(...told.map((entry) => at(entry.t_end)));
  return told.filter((entry) => newest - at(entry.t_end) < DAY_MS).sort((a, b) => at(a.t_end) - at(b.t_end));
}

const isTrip = (entry) => "distance_m" in entry;

function summary(entries) {
  const trips = entries.filter(isTrip);
  const sum = (name) => trips.reduce((total, trip) => total + (trip[name] ?? 0), 0);
  const count = (n, what) => `${n} ${what}${n === 1 ? "" : "s"}`;
  const events = entries.filter((entry) => !isTrip(entry));
  const loaded = events.filter((event) => event.change_kg > 0).reduce((total, event) => total + event.change_kg, 0);
  const unloaded = events.filter((event) => event.change_kg < 0).reduce((total, event) => total - event.change_kg, 0);
  return (
    `${count(trips.length, "trip")}, ${figure(sum("distance_m") / 1000, 1, "km")}, ${number(sum("carried_tkm"), 1)} tonne-kilometres; ` +
    `${count(events.length, "change")} of load: ${figure(loaded, 0, "kg")} loaded, ${figure(unloaded, 0, "kg")} unloaded.`
  );
}

function drawn(name, attributes, text = "") {
  const built = document.createElementNS(SVG, name);
  for (const [key, x] of Object.entries(attributes)) built.setAttribute(key, x);
  built.textContent = text;
  return built;
}

function tripBar(trip, x, y) {
  const [left, right] = [x(trip.t_start), x(trip.t_end)];
  const top = trip.payload_kg == null ? FLOOR - 6 : Math.min(y(trip.payload_kg), FLOOR - 2);
  const kind = trip.payload_kg == null ? "unknown" : trip.overloaded_share > 0 ? "over" : "known";
  return drawn("rect", { class: `day-${kind}`, x: left, y: top, width: Math.max(right - left, LEAST_WIDTH), height: FLOOR - top });
}

function eventMark(event, x, y) {
  const middle = Math.min(Math.max((x(event.t_start) + x(event.t_end)) / 2, 30), WIDTH - 30);
  const top = y(Math.max(event.before.payload_kg, event.after.payload_kg)) - 6;
  const sign = event.change_kg >= 0 ? "+" : "−";
  return drawn("text", { class: "day-change", x: middle, y: Math.max(top, 14) }, `${sign}${number(Math.abs(event.change_kg), 0)}`);
}

function timeline(entries) {
  const [first, last] = [Math.min(...entries.map((entry) => at(entry.t_start))), Math.max(...entries.map((entry) => at(entry.t_end)))];
  const loads = entries.flatMap((entry) => (isTrip(entry) ? [entry.payload_kg ?? 0] : [entry.before.payload_kg, entry.after.payload_kg]));
  const most = Math.max(...loads, 1);
  const x = (iso) => (WIDTH * (at(iso) - first)) / Math.max(last - first, 1);
  const y = (kg) => FLOOR - ((FLOOR - CEILING) * Math.max(kg, 0)) / most;
  const picture = drawn("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, "aria-hidden": "true" });
  picture.append(drawn("line", { class: "day-floor", x1: 0, x2: WIDTH, y1: FLOOR, y2: FLOOR }));
  for (const entry of entries) picture.append(isTrip(entry) ? tripBar(entry, x, y) : eventMark(entry, x, y));
  picture.append(drawn("text", { class: "day-hour", x: 0, y: HEIGHT - 8 }, hour(new Date(first))));
  picture.append(drawn("text", { class: "day-hour day-end", x: WIDTH, y: HEIGHT - 8 }, hour(new Date(last))));
  return picture;
}

show(({ events, trips }) => {
  if (events === null || trips === null) return;
  const entries = events.length + trips.length ? lastDay(events, trips) : [];
  element("day-figure").hidden = entries.length === 0;
  write("day-words", entries.length ? summary(entries) : "No trip yet.");
  if (!entries.length) return;
  element("day-chart").replaceChildren(timeline(entries));
  element("day-entries").replaceChildren(
    ...entries.map((entry) => made("li", isTrip(entry) ? tripText(entry) : eventText(entry), isTrip(entry) ? "soft" : "")),
  );
}, "events", "trips");
