// Bus and sensors, the vehicle and its calibration.

import { show } from "./known.js";
import { element, made, pair } from "./page.js";
import { row } from "./parts.js";
import { phrase, taughtHere } from "./phrases.js";
import { isAsleep, isSilent } from "./state-view.js";
import { UNKNOWN, between, capital, clock, duration, figure, number } from "./words.js";

const NEEDED = new Set(["vertical_acceleration", "pitch_rate", "speed"]);

/** Highlights faults: silence of a needed signal while the vehicle is awake. */
function stateOf(signal, isCalm) {
  if (!isSilent(signal)) return [phrase("heard"), ""];
  const isNeeded = NEEDED.has(signal.signal);
  if (signal.last_age_s == null) return [phrase("never_heard"), isCalm ? "" : "silent"];
  const text = phrase(isCalm ? "paused" : "silent_for", { duration: duration(signal.last_age_s) });
  return [text, isNeeded && !isCalm ? "silent" : ""];
}

function signalRow(signal, isCalm) {
  const [text, tone] = stateOf(signal, isCalm);
  const built = row([
    capital(phrase.named("signal", signal.signal)),
    text,
    isSilent(signal) ? "–" : figure(signal.rate_hz, 1, "Hz"),
    signal.rejected_share == null ? "–" : `${number(100 * signal.rejected_share, 1)} %`,
  ]);
  built.cells[1].className = tone;
  return built;
}

/** Optional signals that were never received take one line. */
function signalRows(signals, isCalm) {
  const isNotSent = ({ signal, last_age_s: age }) => age == null && !NEEDED.has(signal);
  const rows = signals.filter((signal) => !isNotSent(signal)).map((signal) => signalRow(signal, isCalm));
  const names = signals.filter(isNotSent).map(({ signal }) => phrase.named("signal", signal));
  if (!names.length) return rows;
  const last = made("tr", [made("td", phrase("not_sent", { signals: names.join(", ") }), "not-sent")]);
  last.firstChild.colSpan = 4;
  return [...rows, last];
}

function queue({ n_waiting, waiting_age_s }) {
  if (!n_waiting) return phrase("nothing_waits");
  return phrase(waiting_age_s === null ? "waiting_some" : "waiting", { n: n_waiting, duration: waiting_age_s === null ? "" : duration(waiting_age_s) });
}

/** How estimates get to the fleet; empty if no broker is configured. */
function uplinkPairs(uplink) {
  if (uplink === null) return [];
  return [
    pair(phrase("broker"), phrase(uplink.is_connected ? "connected" : "not_connected", { queue: queue(uplink) }), uplink.is_connected ? "" : "over"),
    pair(phrase("delivered"), number(uplink.n_delivered, 0)),
  ];
}

/** How alarms and events are pushed; empty if no address is configured. */
function webhookPairs(webhook) {
  if (webhook === null) return [];
  const link = webhook.last_fault === null ? "webhook_works" : "webhook_fails";
  const pairs = [pair(phrase("webhook"), phrase(link, { fault: webhook.last_fault, queue: queue(webhook) }), webhook.last_fault === null ? "" : "over")];
  if (webhook.n_dead) pairs.push(pair(phrase("webhook_dead"), number(webhook.n_dead, 0), "over"));
  return pairs;
}

show((known) => {
  if (known.status === null) return;
  const { status } = known;
  const isCalm = isAsleep(known);
  const { bus, batches, store, uplink, webhook } = status;
  element("signals").replaceChildren(...signalRows(status.signals, isCalm));
  element("bus").replaceChildren(
    pair(phrase("bus"), `${bus.interface} ${bus.channel}: ${phrase.named("bus", bus.state)}`),
    pair(phrase("frames"), number(bus.n_frames, 0)),
    pair(phrase("dropped"), number(bus.n_inbox_dropped + (bus.n_kernel_dropped ?? 0), 0)),
    pair(phrase("batches_since"), phrase("batches_of", { weighed: batches.n_estimates, not: batches.n_rejected })),
    pair(phrase("store"), store.state === "ok" ? phrase("on_disk") : phrase("in_memory", { reason: store.reason }), store.state === "ok" ? "" : "over"),
    ...uplinkPairs(uplink),
    ...webhookPairs(webhook),
    pair(phrase("running"), duration(status.uptime_s)),
  );
}, "status", "latest");

show(({ vehicle }) => {
  if (vehicle === null) return;
  const { calibration, figures } = vehicle;
  const pairs = [pair(phrase("vehicle"), vehicle.vehicle_id ?? figures?.name ?? phrase("unnamed"))];
  if (vehicle.vin) pairs.push(pair(phrase("vin"), vehicle.vin));
  if (calibration === null) pairs.push(pair(phrase("calibrated"), phrase("no_calibrated")));
  else {
    pairs.push(
      pair(phrase("empty_mass"), figure(figures.empty_mass_kg, 0, "kg")),
      pair(phrase("wheelbase"), figure(figures.wheelbase_m, 2, "m")),
      pair(phrase("estimator"), vehicle.estimator ? phrase.named("estimator", vehicle.estimator) : UNKNOWN),
      pair(phrase("seen_payloads"), between(calibration.payload_seen_kg, 0, "kg")),
      pair(phrase("seen_shares"), between(calibration.front_share_seen_pct, 1, "%")),
      pair(phrase("seen_speeds"), calibration.speed_seen_mps ? between(calibration.speed_seen_mps.map((mps) => 3.6 * mps), 0, "km/h") : UNKNOWN),
      pair(phrase("calibrated"), calibration.id.replace("sha256:", "").slice(0, 12)),
    );
  }
  element("calibrated").replaceChildren(...pairs);
}, "vehicle");

/** Names of settings are in backquotes: shown as code on the page. */
function withCode(text) {
  return text.split("`").map((part, n) => (n % 2 ? made("code", part) : part));
}

const N_SHOWN = 3; // chosen: refused batches, the newest
const USUAL = "The drive"; // a cause that asks nobody for anything

/** What to do about a reason; a vehicle without calibration is taught where that is allowed. */
function advised(reason, advice, learning) {
  const here = reason === "no_calibration" ? taughtHere(learning) : null;
  return here === null ? [made("em", phrase("what_to_do")), ...withCode(advice), "."] : [here];
}

function rejection(batch, reasons, learning) {
  const when = made("time", clock(batch.t_end));
  when.dateTime = batch.t_end;
  const parts = batch.rejected.map((reason) => {
    const told = reasons.get(reason);
    const said = told ? [": ", ...withCode(told.happened), ". ", ...advised(reason, told.advice, learning)] : [];
    return made("p", [made("strong", capital(phrase.named("reason", reason))), ...said], told?.cause === USUAL ? "usual" : "");
  });
  return made("li", [when, ...parts]);
}

show(({ batches, reasons, learning }) => {
  if (batches === null) return;
  const rejected = batches.filter((batch) => batch.rejected.length > 0).slice(0, N_SHOWN);
  const items = rejected.map((batch) => rejection(batch, reasons, learning));
  element("rejected").replaceChildren(...(items.length ? items : [made("li", phrase("none"))]));
}, "batches", "reasons", "learning");
