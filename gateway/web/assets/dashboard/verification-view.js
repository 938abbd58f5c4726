// Known loads: their last comparison with the estimates, and the form that states one.

import { dialog } from "./dialog.js";
import { KNOWN_WEIGHTS, VERIFICATIONS, change, download } from "./gateway.js";
import { learn, show } from "./known.js";
import { button, element, made, typedNumber, write } from "./page.js";
import { phrase } from "./phrases.js";
import { clock, figure, signed } from "./words.js";

const FIELDS = { gross: ["gross_kg"], axles: ["front_axle_kg", "rear_axle_kg"], payload: ["payload_kg", "position_m"] };
const OPTIONAL = new Set(["position_m"]);

const loadText = (load) => phrase("record_load", { kg: figure(load.known_payload_kg, 0, "kg"), error: signed(load.error_kg, 0, "kg"), percent: signed(load.error_pct, 1, "%") });

const recordText = (record) => phrase("record", {
  time: clock(record.at), by: record.by, verdict: phrase.named("verdict", record.verdict),
  loads: record.loads.map(loadText).join("; "), note: record.note ? ` (${record.note})` : "",
});

function due({ due_at, is_due }) {
  if (due_at === null) return phrase("due_any");
  return is_due ? phrase("due_now") : phrase("due_at", { time: clock(due_at) });
}

/** The page of a record opens on its own, to be printed. */
function print(record) {
  download(`${VERIFICATIONS}/${record.id}`, `verification-${record.at.slice(0, 10)}.html`).catch((error) => write("known-said", error.message));
}

function entry(record) {
  const save = button(phrase("save_page"), phrase("save_page_of", { time: clock(record.at) }), () => print(record));
  return made("li", [made("span", `${recordText(record)} `), save]);
}

show(({ verifications }) => {
  if (verifications === null) return;
  const [last] = verifications.history;
  write("verified-due", due(verifications.due));
  write("verified-last", last ? recordText(last) : phrase("never"));
  element("known-add").disabled = false;
  element("verified-history").hidden = !last;
  element("verified-entries").replaceChildren(...verifications.history.map(entry));
}, "verifications");

/** The uses of a known load; the words `NAME_effect`, `NAME_confirm` and `NAME_done` go with each. */
const PURPOSES = {
  verify: { path: VERIFICATIONS, part: "verifications", claim: (loads) => ({ loads }) },
  teach: { path: KNOWN_WEIGHTS, part: "knownWeights", claim: ([weight]) => ({ kind: element("known-kind").value, weight }) },
};

let listed = [], purpose = "verify";

/** The fields of the kind of weight that was chosen, and no others: an invalid hidden field would block the form. */
function fit() {
  const by = element("known-by").value;
  for (const label of document.querySelectorAll("#known-form [data-by]")) {
    label.hidden = label.dataset.by !== by;
    const input = label.querySelector("input");
    input.disabled = label.hidden;
    input.required = !OPTIONAL.has(input.name);
  }
}

/** The typed values, as the gateway expects them. */
function typed() {
  const by = element("known-by").value, load = { by };
  for (const name of [...FIELDS[by], "std_kg"]) {
    const text = element("known-form").elements[name].value;
    if (text !== "") load[name] = typedNumber(text);
  }
  if (element("known-at").value) load.at = new Date(element("known-at").value).toISOString();
  if (element("known-drive").value) load.drive = element("known-drive").value;
  return load;
}

function list() {
  write("known-listed", listed.length === 0 ? "" : phrase("listed", { n: listed.length }));
}

const openDialog = dialog(
  "known",
  async (token, note) => {
    const { path, part, claim } = PURPOSES[purpose];
    learn({ [part]: await change("POST", path, token, { ...claim([...listed, typed()]), ...note }, path) });
  },
  () => write(purpose === "teach" ? "weights-said" : "known-said", phrase(`${purpose}_done`)),
);

function open(name) {
  listed = [];
  purpose = name;
  openDialog(() => {
    write("known-effect", phrase(`${name}_effect`));
    write("known-confirm", phrase(`${name}_confirm`));
    element("known-more").hidden = name !== "verify";
    element("known-kinds").hidden = name !== "teach";
    list();
    fit();
  });
}

element("known-add").addEventListener("click", () => open("verify"));
element("known-teach").addEventListener("click", () => open("teach"));
element("known-by").addEventListener("change", fit);
element("known-more").addEventListener("click", () => {
  if (!element("known-form").reportValidity()) return;
  listed.push(typed());
  for (const name of Object.values(FIELDS).flat()) element("known-form").elements[name].value = "";
  list();
});
