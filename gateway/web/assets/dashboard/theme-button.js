// The button that chooses the theme; theme.js applies it.

import { phrase } from "./phrases.js";
import { element } from "./page.js";

const { CHOICES, chosen, choose } = globalThis.springscaleTheme;

function name() {
  const choice = phrase(`choice.${chosen()}`);
  element("theme").lastElementChild.textContent = ` ${choice}`;
  element("theme").setAttribute("aria-label", phrase("theme", { choice }));
}

element("theme").addEventListener("click", () => {
  choose(CHOICES[(CHOICES.indexOf(chosen()) + 1) % CHOICES.length]);
  name();
});
name();
