// What the cab page says, from the answer of /api/v1/cab.

import { ago, between, capital, duration, figure, number, words } from "/assets/dashboard/words.js";

const STEP_KG = 5; // finer than that nothing is loaded
const SURE = 0.99;
const SILENT_S = 30;

const LIGHTS = { go: "Go", near: "Near the limit", over: "Too heavy", unknown: "Not known" };
const PLACES = { gross: "whole vehicle" };
const OWN = { axle_weight: "Axle weight", air_spring_pressure: "Air spring pressure", ride_height: "Ride height" };

const ALARMS = {
  "imbalance.left_right": "load too far to one side",
  "imbalance.front_rear": "load too far to one end",
  "sensor_fault.silent": "a sensor is silent",
  "sensor_fault.refused": "a sensor is not believed",
  no_estimate: "not weighed for long",
};

const placeName = (place) => PLACES[place] || words(place);

const hour = (iso) => new Date(iso).toLocaleTimeString(undefined, { hour: "2-digit", minute: "2-digit" });

const down = (kg) => Math.floor(kg / STEP_KG) * STEP_KG;
const up = (kg) => Math.ceil(kg / STEP_KG) * STEP_KG;

export function lightText(cab, isCurrent) {
  if (cab.light !== "unknown") return isCurrent ? LIGHTS[cab.light] : `${LIGHTS[cab.light]}, when weighed last`;
  if (cab.load === "never_weighed") return "Not weighed yet";
  return cab.has_limits ? LIGHTS.unknown : "No limit is known";
}

/** Which places the light is about, and how probable too much is. */
export function about(cab) {
  if (!cab.light_about.length) return "";
  const percent = Math.min(99, Math.max(1, Math.round(100 * cab.over_limit_probability)));
  return `${capital(cab.light_about.map(placeName).join(", "))}: ${percent} % likely too heavy.`;
}

const by = (room) => `by the limit of the ${placeName(room.place)}`;

/** What is asked, the kilograms that answer it (null: nobody knows), and how sure that is. */
export function question(cab, isCurrent) {
  if (!cab.room.length) return unknownRoom(cab);
  const [tightest] = cab.room;
  const interval = tightest.interval95_kg === null ? "" : ` (95 %: ${between(tightest.interval95_kg, 0, "kg")})`;
  const low = tightest.interval95_kg === null ? tightest.kg : tightest.interval95_kg[0];
  const when = isCurrent ? "" : ", when weighed last";
  if (tightest.kg < 0) {
    return [`Too heavy by${when}`, up(-tightest.kg), `${capital(by(tightest))}. To be sure take out ${figure(up(-low), 0, "kg")}.`];
  }
  return [`May still go in${when}`, Math.max(0, down(low)), `That much surely; most likely ${figure(tightest.kg, 0, "kg")}${interval}, ${by(tightest)}.`];
}

function unknownRoom(cab) {
  if (cab.payload_kg === null) return ["May still go in", null, whyNot(cab)];
  const missing = cab.has_limits ? "what the vehicle weighs empty is not known" : "no limit is set ([vehicle] gross_limit_kg in springscale.toml)";
  return ["Aboard", cab.payload_kg, `What may still go in is not known: ${missing}.`];
}

function whyNot(cab) {
  if (cab.rejected.length) return `The last minutes could not be weighed: ${cab.rejected.map(words).join(", ")}.`;
  return cab.lacks === "calibration" ? "This vehicle is not calibrated." : "It is weighed after some minutes of driving.";
}

export const roomText = (room) => [capital(placeName(room.place)), room.kg < 0 ? `${figure(-room.kg, 0, "kg")} too much` : `${figure(room.kg, 0, "kg")} left`];

/** What nobody can see now; empty where what was weighed is what is aboard. */
export function notSeen(cab) {
  if (cab.load === "standing") return `Weighed last at ${hour(cab.t_end)}. What is loaded or unloaded now is not seen.`;
  if (cab.load === "not_weighed_yet") return "The load may have changed at the last stop. These numbers are of before it; the new load is weighed after some minutes of driving.";
  return "";
}

function alarmName(name) {
  const [kind, where] = name.split(".");
  if (kind === "overload") return `${placeName(where)} too heavy`;
  return ALARMS[name] || words(name.replace(".", ": "));
}

/** Those that stand, the confirmed ones first. */
export function alarmText(cab) {
  const told = (level) => Object.keys(cab.alarms).filter((name) => cab.alarms[name] === level).map(alarmName);
  const [sure, early] = [told("final"), told("early")];
  return [sure.length ? `Alarm: ${sure.join(", ")}.` : "", early.length ? `First sign: ${early.join(", ")}.` : ""].filter(Boolean).join(" ");
}

export const stood = (cab, silentS) => (cab.load === "standing" ? `Standing for ${duration(cab.stood_s + silentS)}.` : "");

export function aboard(cab, ageS) {
  if (cab.payload_kg === null) return "";
  const interval = cab.payload_interval95_kg === null ? "" : ` (95 %: ${between(cab.payload_interval95_kg, 0, "kg")})`;
  const early = cab.is_early ? " A first look; a whole batch is surer." : "";
  const refused = cab.rejected.length ? ` Not weighed since: ${cab.rejected.map(words).join(", ")}.` : "";
  return `Aboard: ${figure(cab.payload_kg, 0, "kg")}${interval}, weighed ${ageS === null ? "before the gateway was started" : ago(ageS)}.${early}${refused}`;
}

export function eventText(event) {
  if (event === null) return "";
  const done = event.change_kg < 0 ? "unloaded" : "loaded";
  const interval = event.change_kg < 0 ? event.change_interval95_kg.map((kg) => -kg).reverse() : event.change_interval95_kg;
  const sure = event.probability >= SURE ? "" : `, ${number(100 * event.probability, 0)} % sure`;
  return `Last change, by ${hour(event.t_end)}: ${figure(Math.abs(event.change_kg), 0, "kg")} ${done} (95 %: ${between(interval, 0, "kg")})${sure}. ${figure(event.payload_kg, 0, "kg")} aboard then.`;
}

export function ownReading(reading, silentS) {
  const age = reading.age_s + silentS;
  const digits = reading.unit === "kg" || reading.unit === "mm" ? 0 : 1;
  const name = OWN[reading.signal] || capital(words(reading.signal));
  return [name, `${figure(reading.number, digits, reading.unit)}${age > SILENT_S ? `, silent for ${duration(age)}` : ""}`];
}
