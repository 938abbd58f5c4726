// The gateway's doubts about stated facts, in the reader's language, and the answers that were probably meant.

import { phrase } from "./phrases.js";
import { capital, figure, number } from "./words.js";

const ADVICE = {
  wheelbase: "measure", mass: "scales", front_share: "scales", sister_mass: "sister", sister_axles: "sister", sister_track: "place",
  sensor_place: "place", sensor_side: "place", track: "place", unsprung: "leave", sprung: "leave", payload: "papers",
  payload_limit: "papers", gross_limit: "papers", axle_limit: "papers", load_length: "place", load_height: "place",
  driven_weight: "aboard", driven_sister: "other_sister", driven_wheelbase: "speed", driven_sensor: "place",
};
const FIELDS = {
  kerb_front_axle_kg: "com_front", kerb_rear_axle_kg: "com_rear", wheelbase_m: "com_wheelbase", sensor_position_m: "com_sensor",
  sensor_offset_left_m: "com_sensor_left", track_width_m: "com_track", payload_range_kg: "com_payload", payload_length_m: "com_length", payload_height_m: "com_height",
};

function written(name, x) {
  if (name.endsWith("_pct")) return figure(x, 0, "%");
  return name.endsWith("_kg") ? figure(x, x < 10 ? 1 : 0, "kg") : figure(x, 2, "m");
}

/** One doubt: what is unlikely, and what to do. */
export function asked({ kind, numbers }) {
  const fields = Object.fromEntries(Object.entries(numbers).map(([name, x]) => [name, written(name, x)]));
  return `${capital(phrase(`doubt.${kind}`, fields))}. ${phrase(`do.${ADVICE[kind]}`)}`;
}

const answer = (x) => (Array.isArray(x) ? x[1] : x);

/** The button that accepts the probable answer; empty if no slip explains the doubts. */
export function meantText(doubts) {
  const meant = Object.entries(doubts[0]?.meant ?? {}).filter(([name]) => name in FIELDS);
  if (meant.length === 0) return "";
  const digits = (name) => (name.endsWith("_kg") ? 0 : 2);
  const label = (name) => phrase(FIELDS[name]).split(/[[:]/)[0].trim(); // without the unit and the explanation
  const answers = meant.map(([name, x]) => `${number(answer(x), digits(name))} ${name.endsWith("_kg") ? "kg" : "m"} (${label(name)})`);
  return phrase("com_meant", { answers: answers.join(", ") });
}

/** The vehicle with these answers in place of the typed ones; only typed answers are replaced. */
export function changed(vehicle, doubts) {
  const typed = Object.entries(vehicle).filter(([, x]) => x !== null);
  return { ...Object.fromEntries(typed), ...doubts[0].meant };
}
