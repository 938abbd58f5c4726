// Whether silence is normal: a parked vehicle's bus is silent, which is no cause for alarm.

import { phrase } from "./phrases.js";

const SILENT_AFTER_S = 5; // as gateway/status.py

export const isSilent = (signal) => signal.last_age_s == null || signal.last_age_s > SILENT_AFTER_S;

export const silentSignals = (status) => status.signals.filter(isSilent).map((one) => phrase.named("signal", one.signal));

/** No frames at all on a bus that had some before; a bus that never had any may not be connected. */
export function isAsleep({ status, latest }) {
  if (status?.state !== "waiting_for_bus") return false;
  return status.bus.n_frames > 0 || Boolean(latest?.id);
}
