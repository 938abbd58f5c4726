// The state of the service in words, and whether this page hears it.

import { acceptToken } from "./gateway.js";
import { show } from "./known.js";
import { element, write } from "./page.js";
import { phrase } from "./phrases.js";
import { language } from "../language.js";

const TONES = {
  starting: "busy", waiting_for_bus: "warn", sensor_fault: "bad", waiting_for_speed: "busy", collecting: "busy",
  estimating: "good", not_weighed: "calm", stale: "warn", reader_fault: "bad",
};

const SILENT_AFTER_S = 5; // as gateway/status.py

export const isSilent = (signal) => signal.last_age_s == null || signal.last_age_s > SILENT_AFTER_S;

const silentSignals = (status) => status.signals.filter(isSilent).map((one) => phrase.named("signal", one.signal));

/** A parked vehicle's bus is silent, which is no cause for alarm; one that never had a frame may not be connected. */
export function isAsleep({ status, latest }) {
  if (status?.state !== "waiting_for_bus") return false;
  return status.bus.n_frames > 0 || Boolean(latest?.id);
}

/** The gateway's own English sentence has more details than the translation. */
function sentence(status) {
  if (language === "en") return status.state_in_words;
  const said = [phrase(`sentence.${status.state}`)];
  if (status.state === "sensor_fault") said.push(phrase("silent_signals", { signals: silentSignals(status).join(", ") }));
  if (status.state === "reader_fault" && status.bus.last_fault) said.push(phrase("last_fault", { fault: status.bus.last_fault }));
  if (status.calibration_id === null) said.push(phrase("spectra_only"));
  return [...said, ...status.warnings].join(" ");
}

function told(known) {
  const { status, isReachable, isRefused } = known;
  if (isRefused) return [phrase("locked"), "warn", phrase("wants_token")];
  if (isReachable === false) return [phrase("offline"), "bad", `${phrase("gone")} ${phrase("last_heard")}`];
  if (status === null) return [phrase("loading"), "busy", phrase("asking")];
  const tone = TONES[status.state] ?? "warn";
  if (status.calibration_id === null && tone !== "bad") return [phrase("no_calibration"), "warn", sentence(status)];
  if (isAsleep(known)) return [phrase("asleep"), "calm", `${phrase("asleep_since")} ${status.warnings.join(" ")}`];
  const isVague = known.weights?.verdict.says === "vague"; // it weighs, but not exactly enough to be of use
  return [phrase.named("state", status.state), isVague && tone === "good" ? "calm" : tone, sentence(status)];
}

show((known) => {
  const [name, tone, sentence_] = told(known);
  element("state").dataset.tone = tone;
  write("state-name", name);
  write("state-sentence", sentence_.trim());
  element("token").hidden = !known.isRefused;
  element("cards").hidden = known.status === null; // nothing is claimed that nobody told
  if (known.status) {
    write("vehicle", known.status.vehicle_id ?? "");
    write("version", phrase("version", { version: known.status.version }));
  }
}, "status", "latest", "weights", "isReachable", "isRefused");

show(({ isLive }) => {
  write("link", phrase(isLive ? "live" : "not_live"));
  element("link").className = isLive ? "live" : "lost";
}, "isLive");

acceptToken(() => location.reload());
