// The cab page's sentences, from the answer of /api/v1/cab.

import { SURE, ago, alarmName, between, capital, clock, duration, figure, number, placeName, reasons } from "../dashboard/words.js";
import { speaker } from "../language.js";
import { CAB } from "../words/cab.js";
import { COMMON } from "../words/common.js";

const STEP_KG = 5; // chosen: finer than that nothing is loaded
const SILENT_S = 30; // chosen: after that the age of a reading is shown

export const phrase = speaker(COMMON, CAB);

const intervalText = (bounds) => (bounds === null ? "" : phrase("interval", { between: between(bounds, 0, "kg") }));

const down = (kg) => Math.floor(kg / STEP_KG) * STEP_KG;
const up = (kg) => Math.ceil(kg / STEP_KG) * STEP_KG;

const said = (text, isCurrent) => (isCurrent ? text : phrase("earlier", { text }));

/** A wheel carries too much, but neither an axle nor the whole does: unloading is not the remedy. */
const isUneven = (cab) => cab.light === "over" && cab.room.length > 0 && cab.room.every((room) => room.kg >= 0);

export function lightText(cab, isCurrent) {
  if (cab.light !== "unknown") return said(phrase(`light.${isUneven(cab) ? "uneven" : cab.light}`), isCurrent);
  if (cab.load === "never_weighed") return phrase("light_never");
  return phrase(cab.has_limits ? "light.unknown" : "light_no_limit");
}

/** The places that the light refers to, and the probability of an overload. */
export function about(cab) {
  if (!cab.light_about.length) return "";
  const percent = Math.min(99, Math.max(1, Math.round(100 * cab.over_limit_probability)));
  return phrase("about", { places: capital(cab.light_about.map(placeName).join(", ")), percent });
}

/**
 * The one answer: the question, the kilograms (null: unknown), and how they are found.
 * They are safe: by the lower end of the 95 % interval, of the tightest of the whole and the axles. What must come out
 * uses the same end of the interval, so that the load is safe afterwards too.
 */
export function question(cab, isCurrent) {
  if (!cab.room.length) return unknownRoom(cab);
  const [tightest] = cab.room; // by the lower end
  const low = tightest.interval95_kg === null ? tightest.kg : tightest.interval95_kg[0];
  const place = placeName(tightest.place);
  if (cab.room.some((room) => room.kg < 0)) {
    const over = { ...tightest, interval95_kg: tightest.interval95_kg && tightest.interval95_kg.map((kg) => -kg).reverse() };
    return [
      said(phrase("take_out"), isCurrent), up(-low),
      phrase("too_heavy", { best: figure(-tightest.kg, 0, "kg"), interval: intervalText(over.interval95_kg), place }),
    ];
  }
  const safe = cab.light === "go" ? Math.max(0, down(low)) : 0;
  return [
    said(phrase("load_more"), isCurrent), safe,
    phrase("safe", { safe: figure(safe, 0, "kg"), best: figure(tightest.kg, 0, "kg"), interval: intervalText(tightest.interval95_kg), place }),
  ];
}

function unknownRoom(cab) {
  if (cab.payload_kg === null || cab.is_doubted) return [phrase("load_more"), null, whyNot(cab)];
  return [phrase("aboard_now"), cab.payload_kg, phrase("room_unknown", { missing: phrase(cab.has_limits ? "missing_empty" : "missing_limit") })];
}

function whyNot(cab) {
  if (cab.rejected.length) return phrase("not_weighed", { reasons: reasons(cab.rejected) });
  return phrase(cab.lacks === "calibration" ? "not_calibrated" : "not_yet");
}

export const roomText = (room) => [capital(placeName(room.place)), phrase(room.kg < 0 ? "too_much" : "spare", { kg: figure(Math.abs(room.kg), 0, "kg") })];

/** What cannot be known now; empty if the weighed load is still aboard. */
export function notSeen(cab) {
  if (cab.load === "standing") return phrase("unseen", { time: clock(cab.t_end) });
  return cab.load === "not_weighed_yet" ? phrase("changed") : "";
}

/** Active alarms, without those that the red light shows already. */
export function alarmText(cab) {
  const isSaid = (name) => cab.light === "over" && cab.light_about.some((place) => name === `overload.${place}`);
  const names = cab.alarms.filter((name) => !isSaid(name)).map((name) => alarmName(...name.split(".")));
  return names.length ? phrase("alarms", { names: names.join(", ") }) : "";
}

export const stood = (cab, silentS) => (cab.load === "standing" ? phrase("standing", { duration: duration(cab.stood_s + silentS) }) : "");

export function aboard(cab, ageS) {
  if (cab.payload_kg === null) return "";
  const early = cab.is_early ? phrase("early") : "";
  const refused = cab.rejected.length ? phrase("refused", { reasons: reasons(cab.rejected) }) : "";
  const when = ageS === null ? phrase("before_start") : ago(ageS);
  return phrase("aboard", { kg: figure(cab.payload_kg, 0, "kg"), interval: intervalText(cab.payload_interval95_kg), ago: when }) + early + refused;
}

export function eventText(event) {
  if (event === null) return "";
  const isLoss = event.change_kg < 0;
  const bounds = isLoss ? event.change_interval95_kg.map((kg) => -kg).reverse() : event.change_interval95_kg;
  const sure = event.probability >= SURE ? "" : phrase("sure", { percent: number(100 * event.probability, 0) });
  return phrase(isLoss ? "unloaded" : "loaded", { time: clock(event.t_end), kg: figure(Math.abs(event.change_kg), 0, "kg"), interval: intervalText(bounds), sure });
}

export function ownReading(reading, silentS) {
  const age = reading.age_s + silentS;
  const digits = reading.unit === "kg" || reading.unit === "mm" ? 0 : 1;
  const silent = age > SILENT_S ? phrase("silent_for", { duration: duration(age) }) : "";
  return [capital(phrase.named("own", reading.signal)), `${figure(reading.number, digits, reading.unit)}${silent}`];
}

/** The most urgent sentence, and its part that changes from second to second: a screen reader skips that part. */
export function alarm(cab, { isRefused, isGone, silentS }) {
  if (isRefused) return [phrase("wants_token"), ""];
  if (isGone) return [`${phrase("gone")}${cab ? ` ${phrase("last_heard")}` : ""}`, phrase("gone_for", { duration: duration(silentS) })];
  if (cab === null) return ["", ""];
  if (cab.is_stale) return [phrase("old"), cab.age_s === null ? phrase("weighed_before") : phrase("weighed_ago", { ago: ago(cab.age_s + silentS) })];
  if (cab.state === "sensor_fault" || cab.state === "reader_fault") return [phrase("no_sensor"), ""];
  return ["", ""];
}
