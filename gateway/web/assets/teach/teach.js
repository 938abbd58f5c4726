// The page that teaches a vehicle: what it is, what was aboard, how exactly it weighs now, and what would help most.

import { LEARNING, Refused, STATEMENTS, acceptToken, load, send, stateLoad } from "../dashboard/gateway.js";
import { acceptNumbers, element, made, numberText, say, typedNumber, write } from "../dashboard/page.js";
import { button, row } from "../dashboard/parts.js";
import { USEFUL_HELP, clock, duration, figure } from "../dashboard/words.js";
import { fill, speaker } from "../language.js";
import { COMMON } from "../words/common.js";
import { HELPS } from "../words/helps.js";
import { TEACH } from "../words/teach.js";
import { finding, translated } from "./translated.js";

const ASK_EVERY_MS = 5000; // chosen: as the cab page
const REQUIRED = ["kerb_front_axle_kg", "kerb_rear_axle_kg", "wheelbase_m", "sensor_position_m", "gross_limit_kg", "front_axle_limit_kg", "rear_axle_limit_kg"];
const MORE = ["loading_begin_m", "loading_end_m", "sensor_offset_left_m", "track_width_m"];
const SIGNED = ["sensor_position_m", "sensor_offset_left_m", "loading_begin_m"];
const CARRIES = ["", "pallets", "parcels", "long_goods", "tools", "mixed"];

const phrase = speaker(COMMON, HELPS, TEACH);
const kg = (x) => figure(x, 0, "kg");

let learning = null;
let stated = null; // the figures that were sent last, with those that no field shows

/** What the gateway says against a change, with the names of the form's fields. */
function faultText({ message, errors = [] }) {
  const named = errors.map(({ where, what }) => [where.split(".")[1], what]);
  const isOfForm = named.length && named.every(([name]) => [...REQUIRED, ...MORE].includes(name));
  return isOfForm ? named.map(([name, what]) => translated(`${phrase(`field.${name}`)}: ${what}`)).join("; ") : translated(message);
}

/** Waits for the answer to a change; what the gateway says against it becomes the page's fault, and the answer null. */
async function attempt(change) {
  say("fault", "");
  try {
    return await change;
  } catch (error) {
    say("fault", faultText(error));
    element("fault").scrollIntoView({ block: "nearest" });
    return null;
  } finally {
    askNow();
  }
}

const change = (...request) => attempt(send(...request));

// -- the van --

function field(name, isRequired) {
  const input = made("input");
  Object.assign(input, { id: name, name, required: isRequired, autocomplete: "off", inputMode: "decimal" });
  input.dataset.number = "";
  const label = made("label", [made("span", phrase(`field.${name}`)), input]);
  return label;
}

function carriesField() {
  const select = made("select");
  select.id = "carries";
  select.append(...CARRIES.map((name) => new Option(phrase(`carries.${name}`), name)));
  return made("label", [made("span", phrase("field.carries")), select]);
}

function fillVan(figures) {
  const [begin, end] = figures.loading_area_m ?? [null, null];
  const shown = { ...figures, loading_begin_m: begin, loading_end_m: end };
  for (const name of [...REQUIRED, ...MORE]) element(name).value = shown[name] == null ? "" : numberText(shown[name]);
  element("carries").value = figures.carries ?? "";
}

function typedVan() {
  const typed = (name) => (element(name).value.trim() === "" ? null : typedNumber(element(name).value));
  const [begin, end] = [typed("loading_begin_m"), typed("loading_end_m")];
  const numbers = [...REQUIRED, "sensor_offset_left_m", "track_width_m"].map((name) => [name, typed(name)]);
  const area = begin === null || end === null ? null : [begin, end];
  return { ...stated, ...Object.fromEntries(numbers), loading_area_m: area, carries: element("carries").value || null };
}

async function stateVan(isConfirmed) {
  const told = await change("PUT", `api/v1/vehicle${isConfirmed ? "?confirm=true" : ""}`, JSON.stringify(typedVan()));
  if (told !== null) showVan(told);
}

function showVan(vehicle) {
  write("vehicle", vehicle.vehicle_id ?? "");
  showSister(vehicle.sister);
  if (vehicle.stated === null) return;
  stated = vehicle.stated.figures;
  fillVan(stated);
  const doubts = vehicle.stated.is_confirmed ? [] : vehicle.stated.doubts;
  element("doubts").hidden = doubts.length === 0;
  element("doubts-list").replaceChildren(...doubts.map((one) => made("li", `${translated(one.text)}: ${translated(one.advice)}`)));
}

/** The vehicle of the same model; one that was handed in here can be removed. */
function showSister(sister) {
  element("sister").hidden = sister === null;
  if (sister === null) return;
  const forget = button(phrase("withdraw"), `${phrase("withdraw")}: ${sister.name}`, () => changeSister("DELETE"), "link");
  const isGiven = sister.calibration_id !== null;
  element("sister").replaceChildren(`${phrase("sister_is", { name: sister.name })} `, ...(isGiven ? [forget] : []));
}

async function changeSister(method, body) {
  const told = await change(method, "api/v1/vehicle/sister", body);
  element("sister-file").value = "";
  if (told !== null) showSister(told.sister);
}

// -- what it has learnt --

/** What to do now, as a name of a row of the words. */
function next({ lacks, is_learning: isLearning, takes_effect: takesEffect, versions, statements }) {
  if (lacks.length) return lacks[0];
  if (isLearning) return "learning";
  if (takesEffect !== null) return "next_drive";
  if (versions.some((one) => one.state === "in_use")) return "learnt";
  return Object.entries(statements).some(([name, n]) => n > 0 && name !== "withdrawn") ? "drives" : "state";
}

function accuracy({ plus_minus_kg: now, useful_at_kg: useful, tested_on: n }) {
  if (now === null) return phrase("accuracy_none");
  const told = n ? phrase("accuracy_tested", { now: phrase("accuracy_now", { kg: kg(now) }), n }) : phrase("accuracy_now", { kg: kg(now) });
  return useful !== null && now > useful ? phrase("accuracy_rough", { now: told, useful: kg(useful) }) : `${told}.`;
}

/** How far it is: the driving so far until something is learnt, then the accuracy; never full before it is of use. */
function progress({ driven_s: drivenS, plus_minus_kg: now, useful_at_kg: useful }) {
  if (now === null || useful === null) return Math.min(0.5, drivenS / 3600); // half an hour is half of it
  return Math.min(1, Math.max(0.5, useful / now));
}

function showLearning() {
  if (!learning.is_allowed) say("fault", phrase("closed", { why: translated(learning.why_not) }));
  else if (learning.fault) say("fault", learning.fault);
  write("now", phrase(`now.${next(learning)}`));
  write("accuracy", accuracy(learning));
  element("progress").value = progress(learning);
  write("driven", phrase("driven_so_far", { duration: duration(learning.driven_s), n: learning.n_drives }));
  const worth = learning.helps.filter((one) => one.then_plus_minus_kg <= (1 - USEFUL_HELP) * learning.plus_minus_kg);
  const helps = worth.map((one) => made("li", phrase("helps_to", { what: phrase.named("help", one.do), kg: kg(one.then_plus_minus_kg) })));
  const isStuck = learning.plus_minus_kg > learning.useful_at_kg && learning.useful_at_kg !== null && !helps.length;
  element("helps").replaceChildren(...helps, ...(isStuck ? [made("li", phrase("only_statement"))] : []), ...learning.findings.map((text) => made("li", finding(text, phrase))));
  element("questions-card").hidden = learning.questions.length === 0;
  element("questions").replaceChildren(...learning.questions.map(question));
  element("versions-card").hidden = learning.versions.length === 0;
  element("versions").replaceChildren(...learning.versions.map((one) => made("li", `${translated(one.text)} (${phrase(`version.${one.state}`)})`)));
}

/** A question with its answers: yes sends what it proposes, or confirms the statement that it is about; no is noted. */
function question(one) {
  const asked = translated(one.text);
  const yes = async () => {
    if (one.statement_id) await change("POST", `${STATEMENTS}/${encodeURIComponent(one.statement_id)}/confirm`);
    else await change("POST", STATEMENTS, JSON.stringify(one.propose));
  };
  const answers = [button(phrase("yes"), `${phrase("yes")}: ${asked}`, yes)];
  const no = () => change("PUT", LEARNING, JSON.stringify({ not_empty: one.propose.map(({ from }) => from) }));
  if (one.statement_id) answers.push(button(phrase("withdraw"), `${phrase("withdraw")}: ${asked}`, () => withdraw(one.statement_id)));
  else answers.push(button(phrase("no"), `${phrase("no")}: ${asked}`, no));
  return made("li", [made("span", `${asked} `), ...answers]);
}

// -- statements --

const withdraw = (id) => change("DELETE", `${STATEMENTS}/${encodeURIComponent(id)}`);

function loadText({ payload_kg: payload, gross_kg: gross, front_axle_kg: front, rear_axle_kg: rear, change_kg: change, plus_minus_kg: half }) {
  const half95 = (x) => (half === null ? kg(x) : phrase("with_plus_minus", { kg: figure(x, 0, ""), half: kg(half) }));
  if (payload !== null) return phrase("payload", { kg: half95(payload) });
  if (gross !== null) return phrase("gross", { kg: half95(gross) });
  if (front !== null) return phrase("axles", { front: kg(front), rear: kg(rear) });
  return phrase("change", { kg: half95(change) });
}

function statementRow(one) {
  const source = one.source === "empty" ? phrase("source.empty") : loadText(one.load);
  const found = one.found === null ? "" : phrase("with_plus_minus", { kg: figure(one.found.payload_kg, 0, ""), half: kg(one.found.plus_minus_kg) });
  const why = translated(one.question ?? one.reason ?? "");
  const built = row([clock(one.from), source, found, `${phrase(`state.${one.state}`)}${why ? `: ${why}` : ""}`]);
  if (one.state === "withdrawn") return built;
  const remove = button(phrase("withdraw"), `${phrase("withdraw")}: ${clock(one.from)}, ${source}`, () => withdraw(one.id), "link");
  built.firstChild.append(made("br"), remove); // in the first column, which no narrow screen cuts off
  return built;
}

function showStatements({ items }) {
  element("no-statements").hidden = items.length > 0;
  element("statements-table").hidden = items.length === 0;
  element("statements").replaceChildren(...items.map(statementRow));
}

// -- a table of notes --

const timezone = () => `timezone=${encodeURIComponent(Intl.DateTimeFormat().resolvedOptions().timeZone)}`;

const KINDS = ["waits", "overlap", "replaced", "unknown_vehicle", "bad"];

/** How many rows match a drive, and which do not. */
function rowsText({ n_rows: nRows, n_match: nMatch, problems }) {
  const of = (kind) => [...new Set(problems.filter((one) => one.kind === kind).map((one) => one.row))];
  const others = KINDS.map((kind) => [kind, of(kind)]).filter(([, rows]) => rows.length);
  const told = others.map(([kind, rows]) => phrase(`rows.${kind}`, { n: rows.length, rows: rows.join(", ") }));
  return `${phrase("rows", { n: nRows })}: ${[phrase("rows.match", { n: nMatch }), ...told].join(", ")}`;
}

const problem = ({ row, text }) => phrase("row_problem", { row, what: translated(text) });

async function importNotes(isDryRun) {
  const [file] = element("import-file").files;
  const told = await change("POST", `${STATEMENTS}?${timezone()}&dry_run=${isDryRun}`, await file.text(), "text/csv");
  element("import-sure").hidden = told === null || !isDryRun;
  if (told === null) return;
  say("import-told", isDryRun ? rowsText(told) : phrase("taken", { text: rowsText(told) }));
  element("import-problems").replaceChildren(...[...told.notes.map(translated), ...told.problems.map(problem)].map((text) => made("li", text)));
  if (!isDryRun) element("import").reset();
}

// -- in step with the gateway --

async function askNow() {
  try {
    const [now, statements] = await Promise.all([load(LEARNING), load(STATEMENTS)]);
    learning = now;
    element("token").hidden = true;
    element("main").hidden = false;
    showLearning();
    showStatements(statements);
  } catch (error) {
    const isRefused = error instanceof Refused;
    element("token").hidden = !isRefused;
    element("main").hidden = isRefused || learning === null;
    if (!isRefused) say("fault", `${phrase("gone")} ${phrase("last_heard")}`);
  }
}

async function begin() {
  await askNow();
  if (learning !== null) showVan(await load("api/v1/vehicle"));
}

fill(phrase);
document.title = phrase("title");
element("van-required").append(...REQUIRED.map((name) => field(name, true)));
element("van-more").append(...MORE.map((name) => field(name, false)), carriesField());
acceptNumbers(phrase("number_hint", { example: numberText(1.5) }));
for (const name of SIGNED) element(name).pattern = element(name).pattern.replace(" *", " *(-|−)?");
element("van").addEventListener("submit", (event) => {
  event.preventDefault();
  stateVan(false);
});
element("confirm").addEventListener("click", () => stateVan(true));
element("sister-file").addEventListener("change", async ({ target }) => changeSister("PUT", await target.files[0].text()));
element("empty").addEventListener("click", () => attempt(stateLoad(learning.vehicle_time, "empty")));
element("aboard").addEventListener("submit", async (event) => {
  event.preventDefault();
  const weight = typedNumber(element("aboard-kg").value);
  const told = await attempt(stateLoad(learning.vehicle_time, element("aboard-source").value, weight));
  if (told !== null) element("aboard").reset();
});
element("import").addEventListener("submit", (event) => {
  event.preventDefault();
  importNotes(true);
});
element("import-send").addEventListener("click", () => importNotes(false));
acceptToken(begin);
begin();
setInterval(askNow, ASK_EVERY_MS);
