// Small pieces of the page.

import { locale } from "../language.js";

export const element = (id) => document.getElementById(id);

export const write = (id, text) => {
  if (element(id).textContent !== text) element(id).textContent = text;
};

/** A new element with text, or with children. */
export function made(name, content = "", className = "") {
  const built = document.createElement(name);
  built.className = className;
  if (Array.isArray(content)) built.append(...content);
  else built.textContent = content;
  return built;
}

/** One term and its description, for a <dl class="pairs">. */
export const pair = (term, text, className = "") => made("div", [made("dt", term), made("dd", text, className)]);

/** Shows a message, or hides its place. */
export function say(id, text) {
  write(id, text);
  element(id).hidden = text === "";
}

const DECIMAL_SIGN = (0.5).toLocaleString(locale).charAt(1);

/** A number as a person types it in the page's language. */
export const numberText = (x) => String(x).replace(".", DECIMAL_SIGN);

/** The number in a field with `data-number`; its decimal sign is the language's or a point. */
export const typedNumber = (text) => Number(text.trim().replace(DECIMAL_SIGN, ".").replace("−", "-"));

/**
 * Lets the fields with `data-number` accept numbers only; `hint` tells how one looks.
 * A field of type "number" drops a comma without a word where the browser's own language writes a point.
 */
export function acceptNumbers(hint) {
  const digits = `\\d+(${DECIMAL_SIGN === "," ? "[,.]" : "\\."}\\d*)?`;
  for (const field of document.querySelectorAll("input[data-number]")) {
    field.pattern = ` *${digits} *`;
    field.title = hint;
  }
}
