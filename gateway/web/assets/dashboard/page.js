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

/** A button that sends no form; `label` says more than `text` to a screen reader. */
export function button(text, label, onClick, className = "") {
  const built = made("button", text, className);
  built.type = "button";
  built.setAttribute("aria-label", label);
  built.addEventListener("click", onClick);
  return built;
}

/** A new element of a drawing. */
export function shape(name, attributes, text = "") {
  const built = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, content] of Object.entries(attributes)) built.setAttribute(key, content);
  built.textContent = text;
  return built;
}

/** One term and its description, for a <dl class="pairs">. */
export const pair = (term, text, className = "") => made("div", [made("dt", term), made("dd", text, className)]);

/** A table row; the first text heads it. */
export function row(texts, className = "") {
  const [first, ...rest] = texts;
  const head = made("th", first);
  head.scope = "row";
  return made("tr", [head, ...rest.map((text) => made("td", text))], className);
}

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
 * Lets the fields with `data-number` accept numbers only, negative ones if it says "signed"; `hint` tells how one looks.
 * A field of type "number" drops a comma without a word where the browser's own language writes a point.
 */
export function acceptNumbers(hint) {
  const digits = `\\d+(${DECIMAL_SIGN === "," ? "[,.]" : "\\."}\\d*)?`;
  for (const field of document.querySelectorAll("input[data-number]")) {
    field.pattern = ` *${field.dataset.number === "signed" ? "(-|−)?" : ""}${digits} *`;
    field.title = hint;
  }
}
