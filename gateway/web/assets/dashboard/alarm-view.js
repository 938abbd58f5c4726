// Alarms: what stands and what ended unseen, each with a button for who has seen it; the rest folded below.

import { ALARMS, change, hasToken } from "/assets/dashboard/gateway.js";
import { learn, show } from "/assets/dashboard/known.js";
import { element, made, say, write } from "/assets/dashboard/page.js";
import { clock } from "/assets/dashboard/words.js";

const STATES = { early: "Early warning", final: "Confirmed", cleared: "Over" };
const ORDER = ["final", "early", "cleared"];

/** Alarms of an answer, newest first, each once. */
export const alarmsOf = ({ active, items }) => [...new Map([...items, ...active].map((alarm) => [alarm.id, alarm])).values()];

const about = (alarm) => `${alarm.kind} ${alarm.where ?? ""}`;

/** Only the last of its kind and place can be acknowledged; its beginning tells which. */
const isLast = (alarm, alarms) => alarms.every((other) => about(other) !== about(alarm) || other.t_start <= alarm.t_start);

const isOpen = (alarm, alarms) => alarm.is_active || (alarm.acknowledged === null && isLast(alarm, alarms));

const seen = ({ acknowledged }) =>
  acknowledged ? `; seen by ${acknowledged.by} ${clock(acknowledged.at)}${acknowledged.note ? ` (${acknowledged.note})` : ""}` : "";

const when = (alarm) => (alarm.t_end ? `${clock(alarm.t_start)} to ${clock(alarm.t_end)}` : `Since ${clock(alarm.t_start)}`);

/** The state stands before it, so the sentence need not say it again. */
const plain = (alarm) => alarm.sentence.replace(/ \((confirmed|over)\)$/, "").replace("+-", "±");

function item(alarm) {
  const parts = [made("strong", STATES[alarm.state]), made("span", `: ${plain(alarm)}. `), made("span", `${when(alarm)}${seen(alarm)} `)];
  if (alarm.acknowledged === null) parts.push(button(alarm));
  const built = made("li", parts, alarm.state === "final" ? "alarm" : alarm.state === "early" ? "warning" : "");
  built.dataset.id = alarm.id;
  return built;
}

function button(alarm) {
  const built = made("button", "I have seen it …");
  built.type = "button";
  built.setAttribute("aria-label", `I have seen it: ${plain(alarm)}`);
  built.addEventListener("click", () => open(alarm));
  return built;
}

const past = (alarm) => made("li", `${when(alarm)}: ${plain(alarm)}${seen(alarm)}`);

show(({ alarms }) => {
  if (alarms === null) return;
  const open_ = alarms.filter((alarm) => isOpen(alarm, alarms));
  open_.sort((a, b) => ORDER.indexOf(a.state) - ORDER.indexOf(b.state));
  const rest = alarms.filter((alarm) => !open_.includes(alarm));
  const focused = document.activeElement?.closest("#alarms-open li")?.dataset.id;
  element("alarms").hidden = alarms.length === 0;
  write("alarms-none", open_.length ? "" : "None stands.");
  element("alarms-open").replaceChildren(...open_.map(item));
  element("alarms-past").hidden = rest.length === 0;
  element("alarms-entries").replaceChildren(...rest.map(past));
  if (focused) document.querySelector(`#alarms-open li[data-id="${focused}"] button`)?.focus(); // news must not lose the place
}, "alarms");

let chosen = null;

function open(alarm) {
  chosen = alarm;
  element("alarm-form").reset();
  write("alarm-sentence", `${STATES[alarm.state]}: ${plain(alarm)}.`);
  element("alarm-token").hidden = !hasToken();
  say("alarm-refusal", "");
  element("alarm-dialog").showModal();
}

async function confirm(event) {
  event.preventDefault();
  element("alarm-confirm").disabled = true;
  try {
    const note = element("alarm-note").value;
    const path = `${ALARMS.split("?")[0]}/${chosen.id}/acknowledgement`;
    const told = await change("POST", path, element("alarm-token-text").value.trim(), note ? { note } : {}, ALARMS);
    element("alarm-dialog").close();
    learn({ alarms: alarmsOf(told) });
    write("alarms-said", "Noted: you have seen it.");
    element("alarms-title").focus();
  } catch (error) {
    say("alarm-refusal", error.message);
  } finally {
    element("alarm-confirm").disabled = false;
  }
}

element("alarm-form").addEventListener("submit", confirm);
element("alarm-cancel").addEventListener("click", () => element("alarm-dialog").close());
element("alarm-dialog").addEventListener("close", () => element("alarm-form").reset()); // no token stays behind
