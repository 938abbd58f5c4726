// Calibrating on the vehicle itself: one step at a time, each answered by the gateway before the next is shown. What the
// gateway has is shown again whenever somebody goes back or returns; what is typed and not yet sent stays in this browser.

import { asked, changed, meantText } from "./commissioning-doubts.js";
import { summary } from "./commissioning-summary.js";
import { unfold } from "./fold.js";
import { COMMISSIONING, change, hasToken } from "./gateway.js";
import { known, learn, show } from "./known.js";
import { button, element, made, numberText, say, typedNumber, write } from "./page.js";
import { phrase } from "./phrases.js";
import { Z95, clock, duration, figure } from "./words.js";

const STEPS = ["vehicle", "empty", "drive", "fit"];
const TONES = { fault: "alarm", warning: "warning", note: "soft" };
const DRAFT = "springscale-commissioning-draft";
const OPTIONAL = new Set(["sensor_offset_left_m", "track_width_m", "payload_range_kg", "name", "carries", "payload_length_m", "payload_height_m"]);

const card = element("commissioning");
const form = element("commissioning-vehicle");
let at = null; // an earlier step that somebody went back to; null: the one that is wanted next
let shown = null; // the step whose form is on the page: what is typed in it stays while news come
let told = ""; // what was done last, where the gateway's state does not say it
let windowAt = null; // [seconds until the next window, when that was learned]

const sisterText = (name) => (name === null ? phrase("com_without_sister") : phrase("com_of_sister", { name }));

const madeText = (one) =>
  phrase("com_made", { n: one.n_batches, vehicle: one.vehicle_name, sister: sisterText(one.sister), time: clock(one.at), by: one.by, note: one.note ? ` (${one.note})` : "" });

const activeText = (one) => (one === null ? phrase("com_of_settings") : madeText(one));

function sentence({ underway, is_offered, is_allowed, is_pending, active, why_not }) {
  if (underway !== null) return phrase("com_begun", { time: clock(underway.begun_at), by: underway.by });
  if (told) return told;
  if (is_pending && active !== null) return phrase("com_done");
  if (!is_allowed) return phrase("com_not_here", { why: why_not });
  return is_offered ? phrase("com_offer") : "";
}

function learnedText({ learned, n_batches, driven_s, is_fitting }) {
  const driven = phrase("com_driven", { n: n_batches, duration: duration(driven_s) });
  if (learned === null) return `${driven}${is_fitting ? `; ${phrase("com_fitting")}` : ""}.`;
  return phrase("com_learned", {
    driven, percent: figure(100 * learned.share, 0, "%"), now: figure(Z95 * learned.payload_std_kg, 0, "kg"), enough: figure(Z95 * learned.needed_std_kg, 0, "kg"),
  });
}

/** Time until the next window counts, as a clock that runs on between two answers of the gateway. */
function showWindow() {
  if (windowAt === null) return;
  const [seconds, since] = windowAt;
  const left = Math.max(0, Math.round(seconds - (performance.now() - since) / 1000));
  write("commissioning-window", phrase("com_next_in", { time: `${Math.floor(left / 60)}:${String(left % 60).padStart(2, "0")}` }));
}

function drawWindow({ step, next_window_s }) {
  windowAt = next_window_s === null ? null : [next_window_s, performance.now()];
  if (step === "fit") write("commissioning-window", "");
  else if (windowAt === null) write("commissioning-window", phrase("com_standing"));
  else showWindow();
}

const finding = ({ severity, text, advice }) => made("li", `${text}: ${advice}.`, TONES[severity]);

function drawSteps(wanted, current) {
  const items = STEPS.map((name, i) => {
    const isDone = i < STEPS.indexOf(wanted), isCurrent = name === current;
    const name_ = phrase(`com_step.${name}`);
    const item = made("li", "", isDone ? "done" : "");
    if (isCurrent) item.setAttribute("aria-current", "step");
    if ((isDone || name === wanted) && !isCurrent && wanted !== "fit") {
      item.append(button(name_, phrase("com_step_back", { step: name_ }), () => goTo(name), "link"));
    } else item.textContent = name_;
    return item;
  });
  element("commissioning-steps").replaceChildren(...items);
}

/** Shows a step again, with the keyboard in it. */
export function goTo(step) {
  at = step === known.commissioning.underway?.step ? null : step;
  shown = null;
  draw(known);
  const place = element(`commissioning-${step === "fit" ? "drive" : step}`);
  (place.querySelector("select, input:not([type=file])") || element("commissioning-title")).focus();
}

function openForm(step) {
  if (step === shown) return;
  shown = step;
  for (const name of ["vehicle", "empty"]) element(`commissioning-${name}`).hidden = name !== step;
  element("commissioning-drive").hidden = step !== "drive" && step !== "fit";
  if (step === "vehicle") fillVehicle();
  if (step === "empty") element("commissioning-claim").checked = false;
}

function drawDoubts({ doubts, step }) {
  const isOfDrive = doubts.some((one) => one.is_of_drive);
  element("commissioning-doubts").hidden = doubts.length === 0 || step === "fit";
  element("commissioning-doubts-drive").hidden = !isOfDrive;
  element("commissioning-asked").replaceChildren(...doubts.map((one) => made("li", asked(one))));
  const meant = meantText(doubts);
  element("commissioning-meant").hidden = meant === "";
  if (meant !== "") write("commissioning-meant", meant);
}

function drawDone({ underway, active, is_pending }) {
  const learned = active?.learned;
  element("commissioning-done").hidden = underway !== null || active === null || !learned;
  if (underway !== null || !learned) return;
  write("commissioning-reached", phrase("com_reached", { payload: figure(Z95 * learned.payload_std_kg, 0, "kg"), share: figure(Z95 * learned.front_share_std_pct, 1, "%") }));
  const better = active.sister === null ? "com_better_sister" : learned.is_enough ? "com_better_load" : "com_better_drive";
  write("commissioning-better", phrase(better));
  card.classList.toggle("wanted", is_pending);
}

function draw({ commissioning: state }) {
  if (state === null) return;
  const { underway, active, history } = state;
  if (underway === null) at = null;
  else told = "";
  if (at !== null && STEPS.indexOf(at) >= STEPS.indexOf(underway.step)) at = null;
  if (underway?.step === "fit") at = null;
  const isWanted = underway !== null || state.is_offered;
  if (isWanted && !card.classList.contains("wanted")) unfold(card);
  card.classList.toggle("wanted", isWanted);
  const current = at ?? underway?.step ?? null;
  say("commissioning-said", sentence(state));
  write("commissioning-in-use", activeText(active));
  element("commissioning-steps").hidden = underway === null;
  if (underway !== null) drawSteps(underway.step, current);
  else element("commissioning-doubts").hidden = true;
  openForm(current);
  element("commissioning-begin").hidden = underway !== null || !state.is_allowed;
  element("commissioning-cancel").hidden = underway === null;
  element("commissioning-undo").hidden = active === null || underway !== null;
  element("commissioning-token").hidden = !hasToken() || !state.is_allowed;
  element("commissioning-summary").hidden = underway === null || underway.vehicle === null || current === "vehicle";
  if (underway !== null) {
    drawDoubts(underway);
    drawWindow(underway);
    element("commissioning-entered").replaceChildren(...summary(underway, underway.step === "fit" ? null : goTo));
    write("commissioning-drive-what", phrase(underway.step === "fit" ? "com_fit_what" : "com_drive_what"));
    write("commissioning-learned", learnedText(underway));
    element("commissioning-progress").value = underway.learned?.share ?? 0;
    const isFit = underway.step === "fit";
    element("commissioning-fit").disabled = underway.n_batches === 0 || isFit;
    for (const one of element("commissioning-drive").querySelectorAll("button")) one.hidden = isFit;
  }
  drawDone(state);
  say("commissioning-fault", underway?.fault ?? "");
  element("commissioning-findings").replaceChildren(...(underway?.inspection?.findings ?? []).map(finding));
  const looked = underway?.inspection;
  say("commissioning-looked", looked ? `${phrase("com_looked", { duration: duration(looked.seconds) })}${looked.findings.length ? "" : ` ${phrase("com_all_well")}`}` : "");
  element("commissioning-history").hidden = history.length === 0;
  element("commissioning-entries").replaceChildren(...history.map(historyEntry));
}

function historyEntry(one) {
  const ended = one.ended ? phrase("com_ended", { why: phrase(`com_ended.${one.ended.why}`), time: clock(one.ended.at), by: one.ended.by }) : "";
  return made("li", madeText(one) + ended);
}

show(draw, "commissioning");
setInterval(showWindow, 1000);

const fields = () => [...form.querySelectorAll("input, select")];

function put(field, answer) {
  const text = field.name === "payload_range_kg" && Array.isArray(answer) ? answer[1] : (answer ?? "");
  if (field.type === "checkbox") field.checked = answer === true;
  else field.value = typeof text === "number" ? numberText(text) : text;
}

function draft(begunAt) {
  const kept = JSON.parse(localStorage.getItem(DRAFT) || "null");
  return kept?.begun_at === begunAt ? kept.answers : null;
}

/** Filled with the typed answers, else with those sent before. */
function fillVehicle() {
  const { vehicle, begun_at } = known.commissioning.underway;
  const answers = draft(begun_at) ?? vehicle ?? {};
  for (const field of fields()) put(field, answers[field.name]);
}

const typedNow = () => Object.fromEntries(fields().map((field) => [field.name, field.type === "checkbox" ? field.checked : field.value]));

form.addEventListener("input", () => {
  localStorage.setItem(DRAFT, JSON.stringify({ begun_at: known.commissioning.underway.begun_at, answers: typedNow() }));
});

/** One request to the gateway: shows its own words if it refuses, and disables the button meanwhile. */
async function step(place, path, claim, method = "POST") {
  const buttons = [...place.querySelectorAll("button")];
  for (const one of buttons) one.disabled = true;
  say("commissioning-refusal", "");
  try {
    const token = element("commissioning-token-text").value.trim();
    const state = await change(method, COMMISSIONING + path, token, claim, COMMISSIONING);
    at = null;
    learn({ commissioning: state });
    return true;
  } catch (error) {
    say("commissioning-refusal", error.message);
    return false;
  } finally {
    for (const one of buttons) one.disabled = false;
    element("commissioning-fit").disabled = !known.commissioning.underway?.n_batches;
  }
}

async function sendVehicle(said) {
  const isTaken = await step(form, "/vehicle", said);
  if (!isTaken) return;
  localStorage.removeItem(DRAFT);
  if (known.commissioning.underway?.step === "vehicle") fillVehicle();
  if (known.commissioning.underway?.doubts.length) element("commissioning-doubts").scrollIntoView({ block: "nearest" });
}

function stateVehicle() {
  const said = {};
  for (const field of fields()) {
    if (field.type === "checkbox") said[field.name] = field.checked;
    else if (field.value !== "" || !OPTIONAL.has(field.name)) said[field.name] = "number" in field.dataset ? typedNumber(field.value) : field.value;
  }
  if (said.payload_range_kg) said.payload_range_kg = [0, said.payload_range_kg];
  return sendVehicle(said);
}

const SUBMITTED = { vehicle: stateVehicle, empty: (place) => step(place, "/empty", { is_empty: true }) };

for (const [name, submit] of Object.entries(SUBMITTED)) {
  element(`commissioning-${name}`).addEventListener("submit", (event) => {
    event.preventDefault();
    submit(event.target);
  });
}

for (const back of card.querySelectorAll("button.back")) {
  back.addEventListener("click", () => goTo(STEPS[Math.max(0, STEPS.indexOf(shown) - 1)]));
}

element("commissioning-meant").addEventListener("click", () => {
  const { vehicle, doubts } = known.commissioning.underway;
  sendVehicle(changed(vehicle, doubts));
});
element("commissioning-confirm").addEventListener("click", () => step(element("commissioning-doubts"), "/confirm"));

/** The calibration that takes effect once the present one is gone. */
function before({ history, active }) {
  return activeText(history.find((one) => one.ended === null && one.id !== active.id) ?? null);
}

const undoing = () => ({ made: madeText(known.commissioning.active), before: before(known.commissioning) });

/** Asks the gateway to end something; `words` say so if it does. */
async function end(words, path, claim, method) {
  told = words;
  if (!(await step(card, path, claim, method))) told = "";
}

/** What is done after a question; the words `com_NAME_question` and `com_NAME_effect` go with each. */
const SURE = {
  cancel: () => end(phrase("com_cancelled"), "", undefined, "DELETE"),
  undo: () => end(phrase("com_undone", undoing()), "/undo", {}),
  again: () => step(element("commissioning-drive"), "/empty", { is_empty: true, again: true }),
};
let sure = null;

for (const name of Object.keys(SURE)) {
  element(`commissioning-${name}`).addEventListener("click", () => {
    sure = SURE[name];
    write("commissioning-question", phrase(`com_${name}_question`));
    write("commissioning-effect", phrase(`com_${name}_effect`, name === "undo" ? undoing() : {}));
    element("commissioning-dialog").showModal();
  });
}
element("commissioning-yes").addEventListener("click", () => {
  element("commissioning-dialog").close();
  sure();
});
element("commissioning-no").addEventListener("click", () => element("commissioning-dialog").close());
element("commissioning-begin").addEventListener("click", () => step(card, "", {}));
element("commissioning-fit").addEventListener("click", () => step(element("commissioning-drive"), "/fit", {}));
