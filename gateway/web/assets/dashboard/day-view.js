// The last day: what was loaded and unloaded where, and the trips between; as a chart over time, and as a list in words.

import { show } from "./known.js";
import { element, made, write } from "./page.js";
import { TIME_AXIS, colour, local, plot } from "./plot.js";
import { phrase } from "./phrases.js";
import { withInterval } from "./plus-minus.js";
import { SURE, figure, number, span } from "./words.js";

const DAY_MS = 24 * 3600 * 1000;
const N_SHOWN = 10; // chosen: entries before the fold
const UNKNOWN_HEIGHT = 0.06; // chosen: of the highest bar, for a trip with an unknown load

const at = (iso) => new Date(iso).getTime();

function eventText(event) {
  const place = event.place ? phrase("day_place", { latitude: event.place.latitude_deg, longitude: event.place.longitude_deg }) : "";
  const stops = event.stops.length > 1 ? phrase("day_stops", { n: event.stops.length }) : "";
  const sure = event.probability >= SURE ? "" : phrase("sure", { percent: number(100 * event.probability, 0) });
  const kg = withInterval(Math.abs(event.change_kg), event.change_interval95_kg, 0, "kg");
  return phrase(event.change_kg >= 0 ? "day_loaded" : "day_unloaded", { kg, place, stops, sure });
}

function tripText(trip) {
  const over = trip.overloaded_share ? phrase("trip_over", { percent: number(100 * trip.overloaded_share, 0) }) : "";
  const said = { km: figure(trip.distance_m / 1000, 1, "km"), kg: withInterval(trip.payload_kg, trip.payload_interval95_kg, 0, "kg"), over, going: trip.is_over ? "" : phrase("trip_going") };
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

const during = (entry) => at(entry.t_end) - at(entry.t_start);
const middle = (entry) => local(at(entry.t_start) + during(entry) / 2);
const HOVER = { textposition: "none", hovertemplate: "%{text}<extra></extra>" };

/** Trips as bars from start to end, as high as their load. */
function bars(trips) {
  const most = Math.max(...trips.map((trip) => trip.payload_kg ?? 0), 1);
  const kind = (trip) => (trip.payload_kg == null ? "line" : trip.overloaded_share > 0 ? "refused" : "accent");
  return {
    type: "bar",
    x: trips.map(middle),
    width: trips.map(during),
    y: trips.map((trip) => trip.payload_kg ?? UNKNOWN_HEIGHT * most),
    marker: { color: trips.map((trip) => colour(kind(trip))) },
    text: trips.map(tripText),
    ...HOVER,
  };
}

/** Changes of load as triangles above the bars beside them. */
function changes(events) {
  return {
    type: "scatter",
    mode: "markers",
    x: events.map(middle),
    y: events.map((event) => Math.max(event.before.payload_kg, event.after.payload_kg)),
    marker: { symbol: events.map((event) => (event.change_kg >= 0 ? "triangle-up" : "triangle-down")), size: 11, color: colour("ink") },
    text: events.map(eventText),
    ...HOVER,
  };
}

function item(entry) {
  const kind = isTrip(entry) ? "trip" : entry.change_kg >= 0 ? "loaded" : "unloaded";
  const time = made("time", span(entry.t_start, entry.t_end));
  time.dateTime = entry.t_start;
  return made("li", [time, made("span", `${isTrip(entry) ? tripText(entry) : eventText(entry)}.`)], kind);
}

show(({ events, trips }) => {
  if (events === null || trips === null) return;
  const told = events.length + trips.length ? lastDay(events, trips) : [];
  element("day-figure").hidden = told.length === 0;
  write("day-words", told.length ? summary(told) : phrase("no_trip"));
  if (!told.length) return;
  const drawn = [bars(told.filter(isTrip)), changes(told.filter((entry) => !isTrip(entry)))];
  plot(element("day-chart"), drawn, { xaxis: TIME_AXIS, yaxis: { rangemode: "tozero" } });
  const items = told.reverse().map(item); // newest first
  element("day-entries").replaceChildren(...items.slice(0, N_SHOWN));
  element("day-more").hidden = items.length <= N_SHOWN;
  element("day-earlier").replaceChildren(...items.slice(N_SHOWN));
  write("day-more-title", phrase("list_more", { n: items.length - N_SHOWN }));
}, "events", "trips", "palette");
