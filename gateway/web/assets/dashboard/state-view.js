// The state of the service in words, and whether this page hears it.

import { show } from "/assets/dashboard/known.js";
import { element, write } from "/assets/dashboard/page.js";

const NAMES = {
  starting: ["Starting", "busy"],
  waiting_for_bus: ["Bus silent", "warn"],
  sensor_fault: ["Sensor fault", "bad"],
  waiting_for_speed: ["Waiting for speed", "busy"],
  collecting: ["First batch under way", "busy"],
  estimating: ["Estimating", "good"],
  stale: ["Stale", "warn"],
  reader_fault: ["Bus fault", "bad"],
};

function told({ status, isReachable, isRefused }) {
  if (isRefused) return ["Locked", "warn", "The gateway wants a token."];
  if (isReachable === false) return ["Offline", "bad", "The gateway does not answer. What is shown is the last it said."];
  if (status === null) return ["Loading", "busy", "Asking the gateway."];
  const [name, tone] = NAMES[status.state] ?? [status.state, "warn"];
  if (status.calibration_id === null && tone !== "bad") return ["No calibration", "warn", status.state_in_words];
  return [name, tone, status.state_in_words];
}

show((known) => {
  const [name, tone, sentence] = told(known);
  element("state").dataset.tone = tone;
  write("state-name", name);
  write("state-sentence", sentence);
  element("token").hidden = !known.isRefused;
  element("cards").hidden = known.status === null; // nothing is claimed that nobody told
  if (known.status) {
    write("vehicle", known.status.vehicle_id ?? "");
    write("version", `version ${known.status.version}`);
  }
}, "status", "isReachable", "isRefused");

show(({ isLive }) => {
  write("link", isLive ? "live" : "not connected: trying again");
  element("link").className = isLive ? "live" : "lost";
}, "isLive");
