// Alarms: active ones come first on the dashboard, ended ones are on the engineer's page.

import { show } from "./known.js";
import { element, made } from "./page.js";
import { phrase } from "./phrases.js";
import { withInterval } from "./plus-minus.js";
import { alarmName, capital, clock, figure, placeName, reasons, span } from "./words.js";

/** Alarms of an answer, newest first, each once. */
export const alarmsOf = ({ active, items }) => [...new Map([...items, ...active].map((alarm) => [alarm.id, alarm])).values()];

const when = (alarm) => (alarm.t_end ? span(alarm.t_start, alarm.t_end) : phrase("alarm_since", { time: clock(alarm.t_start) }));

function plain({ kind, where, found_kg, interval95_kg, limit_kg, detail }) {
  if (kind === "overload") {
    const measured = { found: withInterval(found_kg, interval95_kg, 0, "kg"), limit: figure(limit_kg, 0, "kg") };
    return phrase("over_limit", { place: capital(placeName(where)), ...measured });
  }
  const why = where === "refused" && detail ? reasons(detail.split(", ")) : detail;
  return `${capital(alarmName(kind, where))}${why ? `: ${why}` : ""}`;
}

/** An overload alarm that stands is red only where the verdict on the present load is. */
function item(alarm, verdict) {
  const isEnding = alarm.is_active && alarm.kind === "overload" && verdict?.light !== "over";
  const tone = !alarm.is_active ? "" : isEnding ? "warning" : "alarm";
  const built = made("li", [made("span", `${plain(alarm)}. `), made("span", `${when(alarm)}${isEnding ? `. ${phrase("alarm_ending")}` : ""}`)], tone);
  built.dataset.id = alarm.id;
  return built;
}

/** Those that stand are on the dashboard, those that ended on the engineer's page. */
function list(card, entries, alarms, verdict) {
  if (element(card) === null) return;
  element(card).hidden = alarms.length === 0;
  element(entries).replaceChildren(...alarms.map((alarm) => item(alarm, verdict)));
}

show(({ alarms, weights }) => {
  if (alarms === null) return;
  list("alarms", "alarms-open", alarms.filter((alarm) => alarm.is_active), weights?.verdict);
  list("alarms-past", "alarms-entries", alarms.filter((alarm) => !alarm.is_active));
}, "alarms", "weights");
