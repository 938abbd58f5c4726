// The dashboard's words in the reader's language; loading this module translates those in the page itself.

import { acceptNumbers, numberText } from "./page.js";
import { fill, language, speaker } from "../language.js";
import { COMMISSIONING_WORDS } from "../words/commissioning.js";
import { COMMON } from "../words/common.js";
import { DASHBOARD } from "../words/dashboard.js";
import { REASONS_DE, REMEDIES_DE, SOURCES_DE } from "../words/reasons.js";

export const phrase = speaker(COMMON, DASHBOARD, COMMISSIONING_WORDS);

/** The gateway's English texts of reasons, sources and remedies, by name, in the reader's language. */
export function explained({ items, sources, remedies }) {
  const isGerman = language === "de";
  const inGerman = (told) => {
    const [happened, advice] = (isGerman && REASONS_DE[told.reason]) || [told.happened, told.advice];
    return { ...told, happened, advice };
  };
  return {
    reasons: new Map(items.map((told) => [told.reason, inGerman(told)])),
    sources: new Map(sources.map((told) => [told.source, (isGerman && SOURCES_DE[told.source]) || told.words])),
    remedies: new Map(remedies.map((told) => [told.remedy, (isGerman && REMEDIES_DE[told.remedy]) || told.advice])),
  };
}

/** What to do about a batch without calibration where this page may calibrate the vehicle; null where it may not. */
export function calibratedHere(commissioning) {
  if (!commissioning?.is_allowed) return null;
  return phrase(commissioning.underway || commissioning.is_pending ? "none_meanwhile" : "none_uncalibrated");
}

fill(phrase);
acceptNumbers(phrase("number_hint", { example: numberText(1.5) }));
