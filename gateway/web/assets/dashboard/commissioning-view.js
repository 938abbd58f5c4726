// Calibrating on the vehicle itself: one step at a time, each answered by the gateway before the next is shown.

import { unfold } from "/assets/dashboard/fold.js";
import { COMMISSIONING, change, hasToken, load } from "/assets/dashboard/gateway.js";
import { known, learn, show } from "/assets/dashboard/known.js";
import { element, made, say, write } from "/assets/dashboard/page.js";
import { clock, duration, figure, number } from "/assets/dashboard/words.js";

const STEPS = ["line", "vehicle", "empty", "drive", "fit"];
const TONES = { fault: "alarm", warning: "warning", note: "soft" };
const WHY_ENDED = { undone: "undone", back_to_factory: "back to the settings' own" };
const NO_LINE = "";
const OPTIONAL = new Set(["sensor_offset_left_m", "track_width_m", "payload_range_kg", "name", "carries", "payload_length_m", "payload_height_m"]);

const card = element("commissioning");
let lines = [];
let shown = null; // the step whose form is on the page: what is typed in it stays while news come

const windows = (n) => (n === 1 ? "one window" : `${n} windows`);

const lineText = (line) => (line.name ? `of the line ${line.name}` : "without a line");

const madeText = (one) => `${one.vehicle_name}, ${lineText(one.line)}, from ${windows(one.n_batches)}, ${clock(one.at)} by ${one.by}${one.note ? ` (${one.note})` : ""}`;

function sentence({ underway, is_offered, is_allowed, is_pending, why_not }) {
  if (underway === null && is_pending) return "Done. It counts from the next drive on: when the vehicle has stood for a minute, or sleeps.";
  if (underway !== null) return `Begun ${clock(underway.begun_at)} by ${underway.by}.`;
  if (!is_allowed) return `Not possible here: ${why_not}.`;
  return is_offered ? "This vehicle is not calibrated. Its axle weights and a quarter of an hour of empty driving are enough." : "";
}

function learnedText({ learned, n_batches, driven_s, is_fitting }) {
  const driven = `${duration(driven_s)} driven, ${windows(n_batches)}`;
  if (learned === null) return `${driven}${is_fitting ? "; looking at it" : ""}.`;
  const payload = `a payload would be told to ± ${figure(1.96 * learned.payload_std_kg, 0, "kg")}`;
  return `${driven}: ${number(100 * learned.share, 0)} % of what is wanted is known; ${payload}, ± ${figure(1.96 * learned.needed_std_kg, 0, "kg")} are enough.`;
}

function finding({ severity, text, advice }) {
  return made("li", `${text}: ${advice}.`, TONES[severity]);
}

function drawSteps(step) {
  for (const item of element("commissioning-steps").children) {
    const at = STEPS.indexOf(item.dataset.step), now = STEPS.indexOf(step);
    item.className = at < now ? "done" : "";
    item.toggleAttribute("aria-current", at === now);
    if (at === now) item.setAttribute("aria-current", "step");
  }
}

function openForm(step) {
  if (step === shown) return;
  shown = step;
  for (const name of ["line", "vehicle", "empty"]) element(`commissioning-${name}`).hidden = name !== step;
  element("commissioning-drive").hidden = step !== "drive" && step !== "fit";
  if (step === "line") askLines();
  if (step === "vehicle") fillVehicle();
}

show(({ commissioning: told }) => {
  if (told === null) return;
  const { underway, active, history } = told;
  const isWanted = underway !== null || told.is_offered;
  if (isWanted && !card.classList.contains("wanted")) unfold(card);
  card.classList.toggle("wanted", isWanted);
  say("commissioning-said", sentence(told));
  write("commissioning-in-use", active === null ? "that of the settings, or none" : madeText(active));
  element("commissioning-steps").hidden = underway === null;
  drawSteps(underway?.step);
  openForm(underway?.step ?? null);
  element("commissioning-begin").hidden = underway !== null || !told.is_allowed;
  element("commissioning-cancel").hidden = underway === null;
  element("commissioning-undo").hidden = active === null || underway !== null;
  element("commissioning-token").hidden = !hasToken() || !told.is_allowed;
  if (underway !== null) {
    write("commissioning-learned", learnedText(underway));
    element("commissioning-progress").value = underway.learned?.share ?? 0;
    element("commissioning-fit").disabled = underway.n_batches === 0 || underway.step === "fit";
    element("commissioning-fit").hidden = underway.step === "fit";
  }
  say("commissioning-fault", underway?.fault ?? "");
  element("commissioning-findings").replaceChildren(...(underway?.inspection?.findings ?? []).map(finding));
  const looked = underway?.inspection ? `Axes, signs, units and rates, by the last ${duration(underway.inspection.seconds)} of driving:${underway.inspection.findings.length ? "" : " all is well."}` : "";
  say("commissioning-looked", looked);
  element("commissioning-history").hidden = history.length === 0;
  element("commissioning-entries").replaceChildren(...history.map((one) => made("li", `${madeText(one)}${one.ended ? `; ${WHY_ENDED[one.ended.why]} ${clock(one.ended.at)} by ${one.ended.by}` : ""}`)));
}, "commissioning");

async function askLines() {
  ({ items: lines } = await load(`${COMMISSIONING}/lines`));
  const choices = lines.map((line, at) => {
    const option = made("option", `${line.name} (${line.source}): ${line.fault ?? `${line.vehicle.name}, wheelbase ${line.vehicle.wheelbase_m} m`}`);
    option.value = at;
    option.disabled = line.fault !== null;
    return option;
  });
  const none = made("option", "none of them: as any vehicle, less exact");
  none.value = NO_LINE;
  element("commissioning-choice").replaceChildren(...choices, none);
}

/** What sisters have in common. */
function fillVehicle() {
  const { line } = known.commissioning.underway;
  const sister = lines.find((one) => one.id === line?.id)?.vehicle;
  for (const name of ["wheelbase_m", "track_width_m"]) {
    const field = element("commissioning-vehicle").elements[name];
    if (sister?.[name] && field.value === "") field.value = sister[name];
  }
  const most = element("commissioning-vehicle").elements.payload_range_kg;
  if (sister?.payload_range_kg && most.value === "") most.value = sister.payload_range_kg[1];
}

/** One question to the gateway: its own words where it refuses, and no button twice. */
async function step(form, path, claim, method = "POST") {
  const buttons = [...form.querySelectorAll("button")];
  for (const button of buttons) button.disabled = true;
  say("commissioning-refusal", "");
  try {
    const token = element("commissioning-token-text").value.trim();
    learn({ commissioning: await change(method, COMMISSIONING + path, token, claim, COMMISSIONING) });
    return true;
  } catch (error) {
    say("commissioning-refusal", error.message);
    return false;
  } finally {
    for (const button of buttons) button.disabled = false;
  }
}

async function chooseLine(form) {
  const files = [...element("commissioning-file").files];
  const file = files.find((one) => !one.name.endsWith(".sig"));
  let line = null;
  if (file) {
    const signature = files.find((one) => one.name === `${file.name}.sig`);
    const said = { name: file.name, content: await file.text(), ...(signature ? { signature: await signature.text() } : {}) };
    if (!(await step(form, "/lines", said))) return;
    await askLines();
    line = { name: file.name, source: "uploaded" };
  } else if (element("commissioning-choice").value !== NO_LINE) {
    const { name, source } = lines[Number(element("commissioning-choice").value)];
    line = { name, source };
  }
  await step(form, "/line", { line });
}

function stateVehicle(form) {
  const said = {};
  for (const field of form.querySelectorAll("input, select")) {
    if (field.type === "checkbox") said[field.name] = field.checked;
    else if (field.value !== "" || !OPTIONAL.has(field.name)) said[field.name] = field.type === "number" ? Number(field.value) : field.value;
  }
  if (said.payload_range_kg) said.payload_range_kg = [0, said.payload_range_kg];
  return step(form, "/vehicle", said);
}

const SUBMITTED = { line: chooseLine, vehicle: stateVehicle, empty: (form) => step(form, "/empty", { is_empty: true }) };

for (const [name, submit] of Object.entries(SUBMITTED)) {
  element(`commissioning-${name}`).addEventListener("submit", (event) => {
    event.preventDefault();
    submit(event.target);
  });
}

const SURE = {
  cancel: ["Forget this commissioning?", "What was driven for it no longer counts. Calibrations made before stay.", () => step(card, "", undefined, "DELETE")],
  undo: ["Take this calibration out of use?", "The one before it counts from the next drive on, or that of the settings.", () => step(card, "/undo", {})],
};
let sure = null;

for (const name of Object.keys(SURE)) {
  element(`commissioning-${name}`).addEventListener("click", () => {
    sure = SURE[name];
    write("commissioning-question", sure[0]);
    write("commissioning-effect", sure[1]);
    element("commissioning-dialog").showModal();
  });
}
element("commissioning-yes").addEventListener("click", () => {
  element("commissioning-dialog").close();
  sure[2]();
});
element("commissioning-no").addEventListener("click", () => element("commissioning-dialog").close());
element("commissioning-begin").addEventListener("click", () => step(card, "", {}));
element("commissioning-fit").addEventListener("click", () => step(element("commissioning-drive"), "/fit", {}));
