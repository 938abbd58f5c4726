// The gateway's sentences in the reader's language, with times of the reader's place.

import { clock } from "../dashboard/words.js";
import { language } from "../language.js";
import { LEFT_OUT, SAID } from "../words/said.js";

const INSTANT = /\d{4}-\d\d-\d\dT\d\d:\d\dZ/g;
const atHome = (text) => text.replace(INSTANT, clock);

const literal = (text) => text.replace(/[.*+?^$()|[\]\\]/g, "\\$&");
const ROWS = SAID.map(([english, german]) => {
  const names = [...english.matchAll(/\{(\w+)\}/g)].map(([, name]) => name);
  const pattern = literal(english).replace(/\{(\w+)\}/g, (_, name) => (name === "n" ? "(\\d+)" : "(.+?)"));
  return { pattern: new RegExp(`^${pattern}$`, "s"), names, german };
});

/** A sentence by the row whose English it is, its parts translated too; as it is where no row fits. */
export function translated(text) {
  if (language !== "de") return atHome(text);
  for (const { pattern, names, german } of ROWS) {
    const found = pattern.exec(text);
    if (found) return german.replace(/\{(\w+)\}/g, (_, name) => translated(found[1 + names.indexOf(name)]));
  }
  return atHome(text).replace(/^([+-]?\d+)\.(\d+)( ± \d+)?$/, "$1,$2$3");
}

/** What was found: of drives that are left out, what to do about it. */
export function finding(text, phrase) {
  const [, advice] = LEFT_OUT.find(([english]) => text.endsWith(english)) ?? [];
  return language === "de" && advice ? phrase("left_out", { advice }) : translated(text);
}
