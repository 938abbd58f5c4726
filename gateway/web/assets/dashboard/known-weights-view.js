// Known weights: those in use, those that wait for a confirmation, and the forms to state one or take it back.

import { dialog } from "./dialog.js";
import { KNOWN_WEIGHTS, change } from "./gateway.js";
import { known, learn, show } from "./known.js";
import { button, element, made, write } from "./page.js";
import { phrase } from "./phrases.js";
import { clock, signed, span as spanOf, withStd } from "./words.js";

const payload = (one) => withStd(one.payload_kg, one.payload_std_kg, 0, "kg");

const estimated = (one) => withStd(one.estimated_payload_kg, one.estimated_payload_std_kg, 0, "kg");

const span = (load) => spanOf(load.t_start, load.t_end);

function inUse({ n_teaching, mean_error_kg, error_std_kg }) {
  if (n_teaching === 0) return phrase("weights_none");
  const scatter = error_std_kg === null ? "" : phrase("scatter", { kg: withStd(error_std_kg, null, 0, "kg") });
  return phrase("weights_some", { n: n_teaching, error: signed(mean_error_kg, 0, "kg"), scatter });
}

function offered({ is_possible, reason, load }) {
  return is_possible ? phrase("offer", { kg: payload(load), span: span(load) }) : phrase(`no_offer.${reason}`);
}

function stateText(one) {
  if (one.state !== "ended") return phrase(`held.${one.state}`);
  return phrase(one.ended.why === "withdrawn" ? "taken_back" : "all_taken_back", { time: clock(one.ended.at), by: one.ended.by });
}

function opener(text, one, name) {
  const label = phrase("button_of", { button: text, kind: phrase.named("kind", one.kind), time: clock(one.t_start) });
  return button(`${text} …`, label, () => open(name, one));
}

function entry(one) {
  const said = phrase("weight_entry", {
    time: clock(one.t_start), kind: phrase.named("kind", one.kind), known: payload(one), estimated: estimated(one), by: one.by,
    note: one.note ? ` (${one.note})` : "", state: stateText(one),
  });
  const parts = [made("span", said)];
  if (one.state === "held") parts.push(opener(phrase("confirm_weight"), one, "confirm"), made("span", " "));
  if (one.ended === null) parts.push(opener(phrase("take_back"), one, "back"));
  return made("li", parts, one.state === "held" ? "warning" : "");
}

show(({ knownWeights }) => {
  if (knownWeights === null) return;
  const { offer, history } = knownWeights;
  const held = history.filter((one) => one.state === "held");
  write("weights-in-use", inUse(knownWeights));
  write("weights-offer", offered(offer));
  element("weights-empty").disabled = !offer.is_possible;
  element("known-teach").disabled = offer.reason === "no_calibration";
  element("weights-held").replaceChildren(...held.map(entry));
  element("weights-history").hidden = history.length === held.length;
  element("weights-entries").replaceChildren(...history.filter((one) => one.state !== "held").map(entry));
}, "knownWeights");

/** The possible requests; the words `NAME_question`, `NAME_effect`, `NAME_confirm` and `NAME_done` go with each. */
const REQUESTS = {
  empty: (token, note) => change("POST", KNOWN_WEIGHTS, token, { kind: "empty", ...note }, KNOWN_WEIGHTS),
  confirm: (token, note, { id }) => change("POST", `${KNOWN_WEIGHTS}/${id}/confirm`, token, undefined, KNOWN_WEIGHTS),
  back: (token, note, { id }) => change("DELETE", `${KNOWN_WEIGHTS}/${id}`, token, undefined, KNOWN_WEIGHTS),
};

let chosen = "empty", subject = null;

const openDialog = dialog(
  "weights",
  async (token, note) => learn({ knownWeights: await REQUESTS[chosen](token, note, subject) }),
  () => write("weights-said", phrase(`${chosen}_done`)),
);

function open(name, one = null) {
  [chosen, subject] = [name, one];
  openDialog(() => {
    const { load } = known.knownWeights.offer;
    write("weights-question", phrase(`${name}_question`, { kg: one && payload(one) }));
    write("weights-effect", phrase(`${name}_effect`, { kg: one ? estimated(one) : payload(load) }));
    write("weights-confirm", phrase(`${name}_confirm`));
    element("weights-claim").hidden = one !== null;
    element("weights-claimed").disabled = one !== null; // what is hidden must not be required
    if (one === null) write("weights-claim-text", phrase("empty_claim", { span: span(load) }));
  });
}

element("weights-empty").addEventListener("click", () => open("empty"));
