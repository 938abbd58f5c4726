// The fleet: fetches every few seconds, shows a line per vehicle, alarms first; the search keeps matching lines.

import { element, made, write } from "../dashboard/page.js";
import { withInterval } from "../dashboard/plus-minus.js";
import { UNKNOWN, ago, alarmName, capital, clock, figure, placeName } from "../dashboard/words.js";
import { fill, speaker } from "../language.js";
import { COMMON } from "../words/common.js";
import { FLEET } from "../words/fleet.js";

const ASK_EVERY_MS = 5000; // chosen: as the other pages
const OLD_AFTER_S = 24 * 3600; // chosen: not weighed today
const phrase = speaker(COMMON, FLEET);

const rows = new Map(); // by vehicle: each stays the same element, so that pointer, keyboard and screen reader keep it
let vehicles = null;
let nUnreadable = 0;

const vinOf = (one) => one.status?.vin ?? one.estimate?.vin ?? "";
const overOf = (one) => Object.entries(one.estimate?.weights ?? {}).filter(([, weight]) => weight?.is_over_limit).map(([place]) => place);
const alarmText = ({ kind, where }) => capital(alarmName(kind, where));

function loadCell(one) {
  const bar = made("div", [made("span")], "bar");
  bar.setAttribute("aria-hidden", "true"); // the number says it
  bar.style.setProperty("--used", `${Math.min(100, 100 * (one.used_share ?? 0))}%`);
  const weight = made("span", withInterval(one.estimate?.payload_kg, one.estimate?.payload_interval95_kg, 0, "kg"), "weight");
  return made("td", one.used_share === null ? [weight] : [weight, bar], "load");
}

function alarmItem(alarm) {
  return made("li", [made("span", alarmText(alarm), "alarmed"), made("small", phrase("since", { time: clock(alarm.t_start) }))]);
}

function line(one) {
  const head = made("th", [one.vehicle_id]);
  head.scope = "row";
  const beside = [vinOf(one), one.status?.state === "offline" ? phrase("offline") : ""].filter(Boolean).join(", ");
  if (beside) head.append(made("small", beside));
  const { kg = null, limit_kg: limit = null } = one.estimate?.weights?.gross ?? {};
  const gross = made("td", limit === null ? figure(kg, 0, "kg") : phrase("of_limit", { kg: figure(kg, 0, "kg"), limit: figure(limit, 0, "kg") }));
  const over = overOf(one);
  if (over.length) gross.append(made("small", phrase("over", { places: over.map(placeName).join(", ") }), "alarmed"));
  const age = made("td", one.age_s === null ? UNKNOWN : ago(one.age_s), one.age_s > OLD_AFTER_S ? "aged" : "");
  const alarms = made("td", [made("ul", one.alarms.map(alarmItem))]);
  return made("tr", [head, loadCell(one), gross, age, alarms], over.length ? "over" : "");
}

/** The vehicle's row, with those cells written anew whose content has changed. */
function rowOf(one) {
  const fresh = line(one);
  const row = rows.get(one.vehicle_id) ?? fresh;
  rows.set(one.vehicle_id, row);
  if (row === fresh) return row;
  row.className = fresh.className;
  [...fresh.cells].forEach((now, n) => {
    if (row.cells[n].outerHTML !== now.outerHTML) {
      row.cells[n].className = now.className;
      row.cells[n].replaceChildren(...now.childNodes);
    }
  });
  return row;
}

/** These rows and no others, in this order; what is in its place stays untouched. */
function arrange(body, shown) {
  shown.forEach((row, n) => {
    if (body.children[n] !== row) body.insertBefore(row, body.children[n] ?? null);
  });
  while (body.children.length > shown.length) body.lastElementChild.remove();
}

const urgency = (one) => 2 * one.alarms.length + overOf(one).length;

function draw() {
  if (vehicles === null) return;
  const sought = element("search").value.trim().toLowerCase();
  const shown = vehicles.filter((one) => `${one.vehicle_id} ${vinOf(one)} ${one.alarms.map(alarmText).join(" ")}`.toLowerCase().includes(sought));
  shown.sort((a, b) => urgency(b) - urgency(a) || a.vehicle_id.localeCompare(b.vehicle_id, undefined, { numeric: true }));
  const count = (is) => vehicles.filter(is).length;
  const said = { n: vehicles.length, over: count((one) => overOf(one).length), alarmed: count((one) => one.alarms.length) };
  const found = shown.length < vehicles.length ? `; ${phrase("found", { shown: shown.length, n: vehicles.length })}` : "";
  const unreadable = nUnreadable ? ` ${phrase("unreadable", { n: nUnreadable })}.` : "";
  write("said", vehicles.length ? `${phrase("summary", said)}${found}.${unreadable}` : phrase("no_vehicle"));
  element("said").className = "";
  element("fleet").hidden = vehicles.length === 0;
  arrange(element("vehicles"), shown.map(rowOf));
}

async function askNow() {
  try {
    const response = await fetch("api/v1/fleet", { cache: "no-store" });
    if (!response.ok) throw new Error(`status ${response.status}`);
    ({ items: vehicles, n_unreadable: nUnreadable } = await response.json());
    draw();
  } catch (error) {
    console.info(error.message);
    write("said", phrase("gone"));
    element("said").className = "gone";
  }
}

fill(phrase);
document.title = phrase("title");
element("search").addEventListener("input", draw);
askNow();
setInterval(askNow, ASK_EVERY_MS);
