// Alarms: active ones come first on the page, each with a button to acknowledge it; ended ones are below.

import { dialog } from "/assets/dashboard/dialog.js";
import { ALARMS, change } from "/assets/dashboard/gateway.js";
import { learn, show } from "/assets/dashboard/known.js";
import { button, element, made, write } from "/assets/dashboard/page.js";
import { phrase } from "/assets/dashboard/phrases.js";
import { capital, clock, number, reasons, span, withStd, words } from "/assets/dashboard/words.js";

const ORDER = ["final", "early"];

/** Alarms of an answer, newest first, each once. */
export const alarmsOf = ({ active, items }) => [...new Map([...items, ...active].map((alarm) => [alarm.id, alarm])).values()];

const about = (alarm) => `${alarm.kind} ${alarm.where ?? ""}`;

/** Only the last of its kind and place can be acknowledged; its start identifies it. */
const isLast = (alarm, alarms) => alarms.every((other) => about(other) !== about(alarm) || other.t_start <= alarm.t_start);

const isUnseen = (alarm, alarms) => alarm.acknowledged === null && isLast(alarm, alarms);

const seen = ({ acknowledged }) =>
  acknowledged ? `${phrase("alarm_seen", { by: acknowledged.by, time: clock(acknowledged.at) })}${acknowledged.note ? ` (${acknowledged.note})` : ""}` : "";

const when = (alarm) => (alarm.t_end ? span(alarm.t_start, alarm.t_end) : phrase("alarm_since", { time: clock(alarm.t_start) }));

/** The alarm's content, from the last step before it ended. */
function plain({ kind, where, steps }) {
  const { found, std, limit, unit, detail } = steps.filter((step) => step.state !== "cleared").at(-1);
  const measured = () => ({ found: withStd(found, std, 0, unit), limit: withStd(limit, null, 0, unit) });
  const why = detail && reasons(detail.split(", "));
  if (kind === "overload") return phrase("over_limit", { place: capital(phrase(`place.${where}`)), ...measured() });
  if (kind === "imbalance") return phrase(`uneven_${where}`, measured());
  if (kind === "no_estimate") return phrase("no_estimate", { minutes: number(found, 0), why: why || phrase("no_reason") });
  if (kind === "drift") return phrase("drifts", { what: capital(phrase.named("trend", where)), detail });
  return `${phrase(where === "silent" ? "fault_silent" : "fault_refused")}${why ? `: ${why}` : ""}`;
}

const sentence = (alarm) => `${phrase(`alarm_${alarm.state}`)}: ${plain(alarm)}.`;

function item(alarm, canBeSeen) {
  const parts = [made("strong", phrase(`alarm_${alarm.state}`)), made("span", `: ${plain(alarm)}. `), made("span", `${when(alarm)}${seen(alarm)} `)];
  if (canBeSeen) parts.push(button(`${phrase("acknowledge")} …`, `${phrase("acknowledge")}: ${plain(alarm)}`, () => open(alarm)));
  const built = made("li", parts, alarm.is_active ? (alarm.state === "final" ? "alarm" : "warning") : "");
  built.dataset.id = alarm.id;
  return built;
}

show(({ alarms }) => {
  if (alarms === null) return;
  const items = (some) => some.map((alarm) => item(alarm, isUnseen(alarm, alarms)));
  const standing = alarms.filter((alarm) => alarm.is_active).sort((a, b) => ORDER.indexOf(a.state) - ORDER.indexOf(b.state));
  const ended = alarms.filter((alarm) => !alarm.is_active);
  const nUnseen = ended.filter((alarm) => isUnseen(alarm, alarms)).length;
  const focused = document.activeElement?.closest("li[data-id]")?.dataset.id;
  element("alarms").hidden = standing.length === 0;
  element("alarms-open").replaceChildren(...items(standing));
  element("alarms-past").hidden = ended.length === 0;
  write("alarms-unseen", nUnseen ? phrase("alarms_unseen", { n: nUnseen }) : "");
  element("alarms-entries").replaceChildren(...items(ended));
  if (focused) document.querySelector(`li[data-id="${focused}"] button`)?.focus(); // news must not lose the place
}, "alarms");

let chosen = null;

const openDialog = dialog(
  "alarm",
  async (token, note) => {
    const path = `${ALARMS.split("?")[0]}/${chosen.id}/acknowledgement`;
    learn({ alarms: alarmsOf(await change("POST", path, token, note, ALARMS)) });
  },
  () => {
    write("alarms-said", phrase("alarm_noted"));
    element(chosen.is_active ? "alarms-title" : "alarms-past-title").focus();
  },
);

function open(alarm) {
  chosen = alarm;
  openDialog(() => write("alarm-sentence", sentence(alarm)));
}
