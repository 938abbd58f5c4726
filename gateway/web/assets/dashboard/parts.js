// Pieces of pages with tables, buttons and drawings; the small cab page does without.

import { made } from "./page.js";

/** A button that sends no form; `label` says more than `text` to a screen reader. */
export function button(text, label, onClick, className = "") {
  const built = made("button", text, className);
  built.type = "button";
  built.setAttribute("aria-label", label);
  built.addEventListener("click", onClick);
  return built;
}

/** A table row; the first text heads it. */
export function row(texts, className = "") {
  const [first, ...rest] = texts;
  const head = made("th", first);
  head.scope = "row";
  return made("tr", [head, ...rest.map((text) => made("td", text))], className);
}

/** A new element of a drawing. */
export function shape(name, attributes, text = "") {
  const built = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, content] of Object.entries(attributes)) built.setAttribute(key, content);
  built.textContent = text;
  return built;
}
