// Whether silence is as it should be: a parked vehicle's bus is silent, and nobody need be alarmed.

import { phrase } from "/assets/dashboard/phrases.js";

const SILENT_AFTER_S = 5;

export const isSilent = (signal) => signal.last_age_s == null || signal.last_age_s > SILENT_AFTER_S;

export const silentSignals = (status) => status.signals.filter(isSilent).map((one) => phrase.named("signal", one.signal));

/** Nothing at all on the bus, where there was something before; a bus never heard may well not be connected. */
export function isAsleep({ status, latest }) {
  if (status?.state !== "waiting_for_bus" || status.bus.n_identifiers) return false;
  return status.bus.n_frames > 0 || Boolean(latest?.id);
}
