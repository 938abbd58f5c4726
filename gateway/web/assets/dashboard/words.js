// Numbers, times and names for people.

export const UNKNOWN = "unknown";
export const Z95 = 1.96; // standard deviations to either side of the middle 95 %
const GLUE = "\u00a0"; // a number and its unit stay on one line

export function number(x, digits) {
  const shown = Number(x.toFixed(digits)) || 0; // never a negative nought
  return shown.toLocaleString(undefined, { minimumFractionDigits: digits, maximumFractionDigits: digits }).replace("-", "−");
}

export const figure = (x, digits, unit) => (x == null ? UNKNOWN : `${number(x, digits)}${GLUE}${unit}`);

export const between = (bounds, digits, unit) =>
  bounds == null ? "" : `${number(bounds[0], digits)} to ${number(bounds[1], digits)}${GLUE}${unit}`;

export const withStd = (x, std, digits, unit) =>
  x == null ? UNKNOWN : `${number(x, digits)}${std == null ? "" : ` ± ${number(Z95 * std, digits)}`}${GLUE}${unit}`;

const plus = (x, digits) => (Number(x.toFixed(digits)) > 0 ? "+" : "");

export const signed = (x, digits, unit) => plus(x, digits) + figure(x, digits, unit);

export const kmh = (mps) => figure(mps == null ? null : mps * 3.6, 0, "km/h");

export const clock = (iso) => new Date(iso).toLocaleString(undefined, { dateStyle: "short", timeStyle: "short" });

export const words = (name) => name.replaceAll("_", " ");

export function capital(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

export function duration(seconds) {
  if (seconds < 90) return `${Math.round(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  if (seconds < 172800) return `${number(seconds / 3600, 1)} h`;
  return `${Math.round(seconds / 86400)} days`;
}

export const ago = (seconds) => (seconds == null ? "never" : `${duration(seconds)} ago`);
