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

export const lightText = (cab, isCurrent) => {
  const text = phrase(`says.${cab.says}`);
  return cab.light === "unknown" ? text : said(text, isCurrent);
};

/** The places that the light refers to, and the probability of an overload. */
export function about(cab) {
  if (!cab.light_about.length) return "";
  const percent = Math.min(99, Math.max(1, Math.round(100 * cab.over_limit_probability)));
  return phrase("about", { places: capital(cab.light_about.map(placeName).join(", ")), percent });
}

const half = (best, plusMinus) => phrase("best", { best: figure(best, 0, "kg"), half: figure(plusMinus, 0, "kg") });

/** Each half rounded by itself, so that both together are the number shown. */
const rounded = (halves, round) => ({ front: round(halves.front_half_kg), rear: round(halves.rear_half_kg) });

function where({ front, rear }) {
  if (!front && !rear) return "";
  if (!front || !rear) return phrase(front ? "all_front" : "all_rear");
  return phrase("both_halves", { front: figure(front, 0, "kg"), rear: figure(rear, 0, "kg") });
}

/**
 * The one answer: the question, the kilograms (null: unknown), where they go, and how they are found.
 * They are safe: by the unfavourable ends of the 95 % intervals of the gross weight and both axles.
 */
export function question(cab, isCurrent) {
  const { room } = cab;
  if (room === null) return unknownRoom(cab);
  if (room.kg < 0) return tooMuch(cab, room, isCurrent);
  const safe = cab.light === "go" ? rounded(room.safe, down) : { front: 0, rear: 0 };
  const total = room.is_anywhere && cab.light === "go" ? down(room.safe.front_half_kg + room.safe.rear_half_kg) : safe.front + safe.rear;
  const place = total === 0 ? "" : room.is_anywhere ? phrase("anywhere") : where(safe);
  return [said(phrase("load_more"), isCurrent), total, place, phrase("safe", { safe: figure(total, 0, "kg"), best: half(room.kg, room.plus_minus_kg) })];
}

function tooMuch(cab, room, isCurrent) {
  const best = phrase("too_heavy", { best: half(-room.kg, room.plus_minus_kg) });
  if (room.take_out === null) return [said(phrase("move_load"), isCurrent), null, "", best];
  const out = rounded(room.take_out, up);
  const gross = cab.spare.find((spare) => spare.place === "gross");
  const isByPlace = cab.light_about.length > 0 && !cab.light_about.includes("gross") && !(gross?.kg < 0);
  return [said(phrase("take_out"), isCurrent), out.front + out.rear, where(out), `${best}${isByPlace ? phrase("or_move") : ""}`];
}

function unknownRoom(cab) {
  if (cab.payload_kg === null || cab.is_doubted) return [phrase("load_more"), null, "", whyNot(cab)];
  const missing = phrase(cab.has_limits ? "missing_empty" : "missing_limit");
  return [phrase("aboard_now"), cab.payload_kg, "", cab.says === "vague" ? "" : phrase("room_unknown", { missing })];
}

function whyNot(cab) {
  if (cab.rejected.length) return phrase("not_weighed", { reasons: reasons(cab.rejected) });
  return phrase(cab.says === "not_calibrated" ? "not_calibrated" : "not_yet");
}

export const spareText = (spare) => [capital(placeName(spare.place)), phrase(spare.kg < 0 ? "too_much" : "spare", { kg: figure(Math.abs(spare.kg), 0, "kg") })];

/** What cannot be known now; empty if the weighed load is still aboard. */
export function notSeen(cab) {
  if (cab.load === "standing") return phrase("unseen", { time: clock(cab.t_end) });
  return cab.load === "not_weighed_yet" ? phrase("changed") : "";
}

/** Active alarms of sensors: the light and its sentence tell of an overload. */
export function alarmText(cab) {
  const names = cab.alarms.map((name) => name.split(".")).filter(([kind]) => kind !== "overload").map((name) => alarmName(...name));
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
