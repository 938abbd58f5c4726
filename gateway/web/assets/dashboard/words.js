// Numbers, times and names for people, as their language writes them.

import { locale, speaker } from "../language.js";
import { COMMON } from "../words/common.js";

const common = speaker(COMMON);

export const UNKNOWN = common("unknown");
export const USEFUL_HELP = 0.1; // chosen: what narrows ± by less is not worth saying
export const SURE = 0.99; // chosen: a change of load that is less probable says how probable
export const GLUE = "\u00a0"; // a number and its unit stay on one line

export function number(x, digits) {
  const shown = Number(x.toFixed(digits)) || 0; // never a negative nought
  return shown.toLocaleString(locale, { minimumFractionDigits: digits, maximumFractionDigits: digits }).replace("-", "−");
}

export const figure = (x, digits, unit) => (x == null ? UNKNOWN : `${number(x, digits)}${GLUE}${unit}`);

export const between = (bounds, digits, unit) =>
  bounds == null ? "" : `${common("between", { low: number(bounds[0], digits), high: number(bounds[1], digits) })}${GLUE}${unit}`;

export const kmh = (mps) => figure(mps == null ? null : mps * 3.6, 0, "km/h");

const TIME = { hour: "2-digit", minute: "2-digit" };
const DAY = { day: "numeric", month: "short", ...TIME };
const YEAR = { year: "numeric", ...DAY };

/** Shows the day unless it is today, and the year unless it is this one: one way of writing times on all pages. */
function format(...instants) {
  const now = new Date();
  if (instants.every((one) => one.toDateString() === now.toDateString())) return new Intl.DateTimeFormat(locale, TIME);
  return new Intl.DateTimeFormat(locale, instants.every((one) => one.getFullYear() === now.getFullYear()) ? DAY : YEAR);
}

export const clock = (iso) => format(new Date(iso)).format(new Date(iso));

/** From one instant to another, as "09:05 – 09:35". */
export function span(from, to) {
  const [start, end] = [new Date(from), new Date(to)];
  return format(start, end).formatRange(start, end);
}

export const reasons = (names) => names.map((name) => common.named("reason", name)).join(", ");

export const placeName = (place) => common.named("place", place);

export function alarmName(kind, where) {
  return kind === "overload" ? common("alarm.overload", { place: placeName(where) }) : common.named("alarm", `${kind}.${where}`);
}

export function capital(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

export function duration(seconds) {
  if (seconds < 90) return common("seconds", { x: Math.round(seconds) });
  if (seconds < 5400) return common("minutes", { x: Math.round(seconds / 60) });
  if (seconds < 172800) return common("hours", { x: number(seconds / 3600, 1) });
  const x = Math.round(seconds / 86400);
  return common("days", { x, n: x });
}

export const ago = (seconds) => (seconds == null ? common("never") : common("ago", { duration: duration(seconds) }));
