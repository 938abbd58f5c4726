// The dashboard's words in the reader's language; loading this module translates those in the page itself.

import { fill, language, speaker } from "../language.js";
import { COMMON } from "../words/common.js";
import { DASHBOARD } from "../words/dashboard.js";
import { HELPS } from "../words/helps.js";
import { REASONS_DE, REMEDIES_DE, SOURCES_DE } from "../words/reasons.js";

export const phrase = speaker(COMMON, DASHBOARD, HELPS);

/** The gateway's English texts of reasons, sources and remedies, by name, in the reader's language. */
export function explained({ reasons, sources, remedies }) {
  const inGerman = (german, told) => new Map(Object.entries(language === "de" ? { ...told, ...german } : told));
  const reasonsDe = Object.entries(REASONS_DE).map(([reason, [happened, advice]]) => [reason, { happened, advice }]);
  return {
    reasons: inGerman(Object.fromEntries(reasonsDe), reasons),
    sources: inGerman(SOURCES_DE, sources),
    remedies: inGerman(REMEDIES_DE, remedies),
  };
}

/** What to do about a batch without calibration where the vehicle can be taught; null where it cannot. */
export function taughtHere(learning) {
  if (!learning?.is_allowed) return null;
  return phrase(learning.takes_effect === null ? "none_untaught" : "none_until_next_drive");
}

fill(phrase);
