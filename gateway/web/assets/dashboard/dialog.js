// A question before something is changed: a form with a note, a token where one is in use, and the gateway's refusal.

import { hasToken } from "./gateway.js";
import { element, say } from "./page.js";

/**
 * Sets the dialog `name` up; returns what opens it, and fills it by `fill()`.
 * Its form calls `send(token, note)`, closes unless that throws, and calls `done()`; `note` is {} or { note }.
 */
export function dialog(name, send, done) {
  const [place, form, confirm] = ["dialog", "form", "confirm"].map((part) => element(`${name}-${part}`));
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    confirm.disabled = true;
    say(`${name}-refusal`, "");
    try {
      const note = element(`${name}-note`).value;
      await send(element(`${name}-token-text`).value.trim(), note ? { note } : {});
      place.close();
      done();
    } catch (error) {
      say(`${name}-refusal`, error.message);
    } finally {
      confirm.disabled = false;
    }
  });
  element(`${name}-cancel`).addEventListener("click", () => place.close());
  place.addEventListener("close", () => form.reset()); // no token stays behind
  return (fill) => {
    form.reset();
    fill();
    element(`${name}-token`).hidden = !hasToken();
    say(`${name}-refusal`, "");
    place.showModal();
  };
}
