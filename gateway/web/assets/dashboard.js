import { follow } from "/assets/event-stream.js";
import { Refused, load, setToken } from "/assets/gateway.js";

const N_RECENT = 25;
const STATUS_EVERY_MS = 5000;

const element = (id) => document.getElementById(id);
const write = (id, text) => { element(id).textContent = text; };

let recent = [];
let latest = null;
let latestAtMs = 0; // when the page learned it: the age goes on even where the service is gone

const number = (x, digits) => x.toLocaleString(undefined, { minimumFractionDigits: digits, maximumFractionDigits: digits });
const figure = (x, digits, unit) => (x == null ? "unknown" : `${number(x, digits)} ${unit}`);
const range = (bounds, digits, unit) =>
  bounds == null ? "" : `${number(bounds[0], digits)} to ${number(bounds[1], digits)} ${unit} (95 %)`;
const clock = (iso) => new Date(iso).toLocaleString(undefined, { dateStyle: "short", timeStyle: "medium" });
const words = (reason) => reason.replaceAll("_", " ");

function duration(seconds) {
  if (seconds < 90) return `${Math.round(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  if (seconds < 172800) return `${number(seconds / 3600, 1)} h`;
  return `${Math.round(seconds / 86400)} days`;
}

function ageNow() {
  return latest?.age_s == null ? null : latest.age_s + (performance.now() - latestAtMs) / 1000;
}

function showAge() {
  const age = ageNow();
  write("age", age == null ? "unknown" : duration(age));
}

function showLatest() {
  write("payload", figure(latest.payload_kg, 0, "kg"));
  write("payload-range", range(latest.payload_interval95_kg, 0, "kg"));
  write("share", figure(latest.front_share_pct, 1, "%"));
  write("share-range", range(latest.front_share_interval95_pct, 1, "%"));
  write("age-at", latest.t_end ? `batch until ${clock(latest.t_end)}` : "");
  element("latest").classList.toggle("stale", latest.is_stale);
  const notes = [];
  if (latest.is_stale) notes.push("This estimate is old: the load may have changed since.");
  if (latest.provisional) notes.push("Early value: the first batch of this drive is not complete yet.");
  if (latest.rejected.length) notes.push(`No estimate: ${latest.rejected.map(words).join(", ")}.`);
  write("note", notes.join(" "));
  element("note").hidden = notes.length === 0;
  showAge();
}

function cell(text) {
  const td = document.createElement("td");
  td.textContent = text;
  return td;
}

function row(texts, kind = "") {
  const tr = document.createElement("tr");
  tr.className = kind;
  tr.append(...texts.map(cell));
  return tr;
}

function showRecent() {
  const rows = recent.map((e) => {
    const isRejected = e.rejected.length > 0;
    const speed = e.mean_speed_mps == null ? "unknown" : `${number(e.mean_speed_mps * 3.6, 0)} km/h`;
    const outcome = isRejected ? `rejected: ${e.rejected.map(words).join(", ")}` : "estimate";
    const texts = [clock(e.t_end), figure(e.payload_kg, 0, "kg"), figure(e.front_share_pct, 1, "%"), speed, outcome];
    return row(texts, isRejected ? "rejected" : "");
  });
  if (rows.length) element("recent").replaceChildren(...rows);
}

function remember(record) {
  recent = [record, ...recent.filter((e) => e.id !== record.id)].slice(0, N_RECENT);
  showRecent();
}

function pair(name, text) {
  const div = document.createElement("div");
  const dt = document.createElement("dt");
  const dd = document.createElement("dd");
  dt.textContent = name;
  dd.textContent = text;
  div.append(dt, dd);
  return div;
}

function showStatus(status) {
  write("state", status.state_in_words);
  write("vehicle", status.vehicle_id ?? "");
  write("version", `version ${status.version}`);
  const bus = status.bus;
  element("bus").replaceChildren(
    pair("Bus", `${bus.interface} ${bus.channel}: ${words(bus.state)}`),
    pair("Frames", number(bus.n_frames, 0)),
    pair("Dropped", number(bus.n_inbox_dropped + (bus.n_kernel_dropped ?? 0), 0)),
    pair("Batches", `${status.batches.n_estimates} estimates, ${status.batches.n_rejected} rejected`),
    pair("Store", status.store.state === "ok" ? "on disk" : `in memory only: ${status.store.reason}`),
    pair("Running for", duration(status.uptime_s)),
  );
  element("signals").replaceChildren(...status.signals.map((s) => row([
    words(s.signal),
    s.rate_hz == null ? "unknown" : `${number(s.rate_hz, 1)} Hz`,
    s.last_age_s == null ? "never" : `${duration(s.last_age_s)} ago`,
    s.rejected_share == null ? "unknown" : `${number(100 * s.rejected_share, 1)} %`,
  ])));
}

async function refreshLatest() {
  latest = await load("/api/v1/estimates/latest");
  latestAtMs = performance.now();
  showLatest();
}

async function refreshStatus() {
  try {
    showStatus(await load("/api/v1/status"));
    await refreshLatest();
    element("token").hidden = true;
  } catch (error) {
    const isRefused = error instanceof Refused;
    if (isRefused) element("token").hidden = false;
    write("state", isRefused ? "The gateway wants a token." : "The gateway does not answer. What is shown is the last it said.");
  }
}

function onEvent(kind, record) {
  if (kind === "estimate" || kind === "rejection") remember(record);
  if (kind === "estimate" || kind === "rejection" || kind === "provisional") refreshLatest().catch(() => {});
}

function onLink(isLive) {
  write("link", isLive ? "live" : "not connected: trying again");
  element("link").className = isLive ? "live" : "lost";
}

async function begin() {
  await refreshStatus();
  let cursor = null;
  try {
    const page = await load(`/api/v1/estimates?order=newest_first&spectra=false&limit=${N_RECENT}`);
    recent = page.items;
    cursor = page.last_cursor;
    showRecent();
  } catch (error) {
    console.info(error.message);
  }
  setInterval(refreshStatus, STATUS_EVERY_MS);
  setInterval(showAge, 1000);
  await follow("/api/v1/stream", cursor, onEvent, onLink);
}

element("token").addEventListener("submit", (event) => {
  event.preventDefault();
  setToken(element("token-text").value);
  location.reload();
});

begin();
