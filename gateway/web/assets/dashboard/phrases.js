// The dashboard's words in the reader's language; loading this module translates those in the page itself.

import { fill, language, speaker } from "../language.js";
import { COMMON } from "../words/common.js";
import { DASHBOARD } from "../words/dashboard.js";
import { HELPS } from "../words/helps.js";
import { REASONS_DE, REMEDIES_DE, SOURCES_DE } from "../words/reasons.js";

export const phrase = speaker(COMMON, DASHBOARD, HELPS);

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

/** What to do about a batch without calibration where the vehicle can be taught; null where it cannot. */
export function taughtHere(learning) {
  if (!learning?.is_allowed) return null;
  return phrase(learning.takes_effect === null ? "none_untaught" : "none_until_next_drive");
}

fill(phrase);
