// The last day: what was loaded and unloaded where, and the trips between; as bars over time, and as a list in words.

import { known, show } from "./known.js";
import { element, made, write } from "./page.js";
import { shape } from "./parts.js";
import { phrase } from "./phrases.js";
import { SURE, clock, figure, number, span, withStd } from "./words.js";

const DAY_MS = 24 * 3600 * 1000;
const N_SHOWN = 10; // chosen: entries before the fold
const HEIGHT = 130; // chosen, as the next three: pixels of the drawing
const FLOOR = 108; // of the bars
const CEILING = 20;
const LEAST_WIDTH = 3;
const LETTER_PX = 10; // chosen: of a label, on average: a bold sign is wider than a digit

const at = (iso) => new Date(iso).getTime();

function eventText(event) {
  const place = event.place ? phrase("day_place", { latitude: event.place.latitude_deg, longitude: event.place.longitude_deg }) : "";
  const stops = event.stops.length > 1 ? phrase("day_stops", { n: event.stops.length }) : "";
  const sure = event.probability >= SURE ? "" : phrase("day_sure", { percent: number(100 * event.probability, 0) });
  const kg = withStd(Math.abs(event.change_kg), event.change_std_kg, 0, "kg");
  return phrase(event.change_kg >= 0 ? "day_loaded" : "day_unloaded", { kg, place, stops, sure });
}

function tripText(trip) {
  const over = trip.overloaded_share ? phrase("trip_over", { percent: number(100 * trip.overloaded_share, 0) }) : "";
  const said = { km: figure(trip.distance_m / 1000, 1, "km"), kg: withStd(trip.payload_kg, trip.payload_std_kg, 0, "kg"), over, going: trip.is_over ? "" : phrase("trip_going") };
  return phrase(trip.payload_kg == null ? "trip_unknown" : "trip_known", said);
}

const isTrip = (entry) => "distance_m" in entry;

/** The entries of the last 24 hours of data, oldest first, without withdrawn ones. */
function lastDay(events, trips) {
  const told = [...events.filter((event) => !event.is_withdrawn), ...trips];
  const newest = Math.max(...told.map((entry) => at(entry.t_end)));
  return told.filter((entry) => newest - at(entry.t_end) < DAY_MS).sort((a, b) => at(a.t_end) - at(b.t_end));
}

function summary(entries) {
  const trips = entries.filter(isTrip), events = entries.filter((entry) => !isTrip(entry));
  const sum = (some, name) => some.reduce((total, one) => total + (one[name] ?? 0), 0);
  return phrase("day_sum", {
    trips: phrase("n_trips", { n: trips.length }),
    km: figure(sum(trips, "distance_m") / 1000, 1, "km"),
    tkm: number(sum(trips, "carried_tkm"), 1),
    changes: phrase("n_changes", { n: events.length }),
    loaded: figure(sum(events.filter((event) => event.change_kg > 0), "change_kg"), 0, "kg"),
    unloaded: figure(-sum(events.filter((event) => event.change_kg < 0), "change_kg"), 0, "kg"),
  });
}

function tripBar(trip, x, y) {
  const [left, right] = [x(trip.t_start), x(trip.t_end)];
  const top = trip.payload_kg == null ? FLOOR - 6 : Math.min(y(trip.payload_kg), FLOOR - 2);
  const kind = trip.payload_kg == null ? "unknown" : trip.overloaded_share > 0 ? "over" : "known";
  return shape("rect", { class: `day-${kind}`, x: left, y: top, width: Math.max(right - left, LEAST_WIDTH), height: FLOOR - top });
}

/** Places labels that overlap no earlier one, and omits those without room; the list below is complete. */
function labels(wanted, width) {
  const taken = [];
  return wanted.filter((label) => {
    const half = (label.text.length * LETTER_PX) / 2;
    label.x = Math.min(Math.max(label.x, half), width - half);
    const isFree = taken.every((other) => Math.abs(other.x - label.x) > other.half + half || Math.abs(other.y - label.y) > 14);
    if (isFree) taken.push({ ...label, half });
    return isFree;
  }).map(({ text, x, y, kind }) => shape("text", { class: kind, x, y }, text));
}

function changeLabel(event, x, y) {
  const top = y(Math.max(event.before.payload_kg, event.after.payload_kg)) - 6;
  const text = `${event.change_kg >= 0 ? "+" : "−"}${number(Math.abs(event.change_kg), 0)}`;
  return { text, kind: "day-change", x: (x(event.t_start) + x(event.t_end)) / 2, y: Math.max(top, 12), size: Math.abs(event.change_kg) };
}

/** Bars of load over time, scaled to the pixels available. */
function timeline(entries, width) {
  const [first, last] = [Math.min(...entries.map((entry) => at(entry.t_start))), Math.max(...entries.map((entry) => at(entry.t_end)))];
  const loads = entries.flatMap((entry) => (isTrip(entry) ? [entry.payload_kg ?? 0] : [entry.before.payload_kg, entry.after.payload_kg]));
  const most = Math.max(...loads, 1);
  const x = (iso) => (width * (at(iso) - first)) / Math.max(last - first, 1);
  const y = (kg) => FLOOR - ((FLOOR - CEILING) * Math.max(kg, 0)) / most;
  const picture = shape("svg", { viewBox: `0 0 ${width} ${HEIGHT}`, width, height: HEIGHT, "aria-hidden": "true" });
  picture.append(shape("line", { class: "day-floor", x1: 0, x2: width, y1: FLOOR, y2: FLOOR }));
  picture.append(...entries.filter(isTrip).map((trip) => tripBar(trip, x, y)));
  const changes = entries.filter((entry) => !isTrip(entry)).map((event) => changeLabel(event, x, y)).sort((a, b) => b.size - a.size);
  const ends = [[first, 0], [last, width]].map(([ms, where]) => ({ text: clock(ms), kind: "day-hour", x: where, y: HEIGHT - 6 }));
  picture.append(...labels([...ends, ...changes], width));
  return picture;
}

function item(entry) {
  const kind = isTrip(entry) ? "trip" : entry.change_kg >= 0 ? "loaded" : "unloaded";
  const time = made("time", span(entry.t_start, entry.t_end));
  time.dateTime = entry.t_start;
  return made("li", [time, made("span", `${isTrip(entry) ? tripText(entry) : eventText(entry)}.`)], kind);
}

function entries() {
  const { events, trips } = known;
  return events === null || trips === null || !(events.length + trips.length) ? [] : lastDay(events, trips);
}

function drawChart() {
  const told = entries(), width = element("day-chart").clientWidth;
  if (told.length && width) element("day-chart").replaceChildren(timeline(told, width));
}

show(({ events, trips }) => {
  if (events === null || trips === null) return;
  const told = entries();
  element("day-figure").hidden = told.length === 0;
  write("day-words", told.length ? summary(told) : phrase("no_trip"));
  if (!told.length) return;
  drawChart();
  const items = told.reverse().map(item); // newest first
  element("day-entries").replaceChildren(...items.slice(0, N_SHOWN));
  element("day-more").hidden = items.length <= N_SHOWN;
  element("day-earlier").replaceChildren(...items.slice(N_SHOWN));
  write("day-more-title", phrase("list_more", { n: items.length - N_SHOWN }));
}, "events", "trips");

new ResizeObserver(drawChart).observe(element("day-chart"));
