// Numbers with what they may be off: ± is half a 95 % interval, which may lean.

import { GLUE, UNKNOWN, number } from "./words.js";

export const Z95 = 1.96; // standard deviations to either side of the middle 95 %

export const halfOf = (bounds) => (bounds == null ? null : (bounds[1] - bounds[0]) / 2);

const plusMinus = (x, half, digits, unit) =>
  x == null ? UNKNOWN : `${number(x, digits)}${half == null ? "" : ` ± ${number(half, digits)}`}${GLUE}${unit}`;

export const withInterval = (x, bounds, digits, unit) => plusMinus(x, halfOf(bounds), digits, unit);

export const withStd = (x, std, digits, unit) => plusMinus(x, std == null ? null : Z95 * std, digits, unit);
