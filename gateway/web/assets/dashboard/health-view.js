// Bus and sensors, the vehicle and its calibration.

import { show } from "/assets/dashboard/known.js";
import { element, made, pair, row } from "/assets/dashboard/page.js";
import { between, capital, duration, figure, kmh, number, words } from "/assets/dashboard/words.js";

const SILENT_AFTER_S = 5;

function signalRow(signal) {
  const isSilent = signal.last_age_s == null || signal.last_age_s > SILENT_AFTER_S;
  const heard = signal.last_age_s == null ? "never heard" : `silent for ${duration(signal.last_age_s)}`;
  const built = row([
    capital(words(signal.signal)),
    isSilent ? heard : "heard",
    isSilent ? "–" : figure(signal.rate_hz, 1, "Hz"),
    signal.rejected_share == null ? "–" : `${number(100 * signal.rejected_share, 1)} %`,
  ]);
  built.cells[1].className = isSilent ? "silent" : "";
  return built;
}

/** How estimates get to the fleet; nothing where no broker is configured. */
function uplinkPairs(uplink) {
  if (uplink === null) return [];
  const age = uplink.waiting_age_s === null ? "" : `, the oldest for ${duration(uplink.waiting_age_s)}`;
  const queue = uplink.n_waiting ? `${number(uplink.n_waiting, 0)} wait${age}` : "nothing waits";
  const link = uplink.is_connected ? "connected" : "not connected";
  return [
    pair("Fleet's broker", `${link}; ${queue}`, uplink.is_connected ? "" : "over"),
    pair("Delivered to it", number(uplink.n_delivered, 0)),
  ];
}

/** How alarms and events are pushed; nothing where no address is configured. */
function webhookPairs(webhook) {
  if (webhook === null) return [];
  const age = webhook.waiting_age_s === null ? "" : `, the oldest for ${duration(webhook.waiting_age_s)}`;
  const queue = webhook.n_waiting ? `${number(webhook.n_waiting, 0)} wait${age}` : "nothing waits";
  const link = webhook.last_fault === null ? "takes letters" : `does not: ${webhook.last_fault}`;
  const pairs = [pair("Webhook", `${link}; ${queue}`, webhook.last_fault === null ? "" : "over")];
  if (webhook.n_dead) pairs.push(pair("Letters it refused", number(webhook.n_dead, 0), "over"));
  return pairs;
}

show(({ status }) => {
  const { bus, batches, store, uplink, webhook } = status;
  element("signals").replaceChildren(...status.signals.map(signalRow));
  element("bus").replaceChildren(
    pair("Bus", `${bus.interface} ${bus.channel}: ${words(bus.state)}`),
    pair("Frames", number(bus.n_frames, 0)),
    pair("Dropped", number(bus.n_inbox_dropped + (bus.n_kernel_dropped ?? 0), 0)),
    pair("Batches since the start", `${batches.n_estimates} weighed, ${batches.n_rejected} not`),
    pair("Store", store.state === "ok" ? "on disk" : `in memory only: ${store.reason}`, store.state === "ok" ? "" : "over"),
    ...uplinkPairs(uplink),
    ...webhookPairs(webhook),
    pair("Running for", duration(status.uptime_s)),
  );
}, "status");

show(({ vehicle }) => {
  if (vehicle === null) return;
  const { calibration, figures } = vehicle;
  const pairs = [pair("Vehicle", vehicle.vehicle_id ?? figures?.name ?? "unnamed")];
  if (vehicle.vin) pairs.push(pair("VIN", vehicle.vin));
  if (calibration === null) pairs.push(pair("Calibration", "none: spectra only, no payload"));
  else {
    pairs.push(
      pair("Empty sprung mass", figure(figures.empty_mass_kg, 0, "kg")),
      pair("Wheelbase", figure(figures.wheelbase_m, 2, "m")),
      pair("Estimator", words(vehicle.estimator ?? "none")),
      pair("Calibrated with payloads of", between(calibration.payload_seen_kg, 0, "kg")),
      pair("with front shares of", between(calibration.front_share_seen_pct, 1, "%")),
      pair("at mean speeds of", calibration.speed_seen_mps ? `${kmh(calibration.speed_seen_mps[0])} to ${kmh(calibration.speed_seen_mps[1])}` : "unknown"),
      pair("Calibration", calibration.id.replace("sha256:", "").slice(0, 12)),
    );
  }
  element("calibrated").replaceChildren(...pairs);
}, "vehicle");

/** Names of settings stand in backquotes: as code on the page. */
function withCode(text) {
  return text.split("`").map((part, n) => (n % 2 ? made("code", part) : part));
}

const N_SHOWN = 3;
const USUAL = "The drive"; // a cause that asks nobody for anything

function rejection(batch, reasons) {
  const when = made("time", new Date(batch.t_end).toLocaleString(undefined, { dateStyle: "short", timeStyle: "short" }));
  when.dateTime = batch.t_end;
  const parts = batch.rejected.map((reason) => {
    const told = reasons.get(reason);
    const said = told ? [": ", ...withCode(told.happened), ". ", made("em", "What to do: "), ...withCode(told.advice), "."] : [];
    return made("p", [made("strong", capital(words(reason))), ...said], told?.cause === USUAL ? "usual" : "");
  });
  return made("li", [when, ...parts]);
}

show(({ batches, reasons }) => {
  if (batches === null) return;
  const rejected = batches.filter((batch) => batch.rejected.length > 0).slice(0, N_SHOWN);
  const items = rejected.map((batch) => rejection(batch, reasons));
  element("rejected").replaceChildren(...(items.length ? items : [made("li", "None.")]));
}, "batches", "reasons");
