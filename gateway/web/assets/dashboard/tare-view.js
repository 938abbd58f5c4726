// The zero of the empty vehicle: which is in use, and, once confirmed, another or the one before.

import { TARE, change, hasToken } from "/assets/dashboard/gateway.js";
import { known, learn, show } from "/assets/dashboard/known.js";
import { element, made, say, write } from "/assets/dashboard/page.js";
import { clock, signed, signedWithStd } from "/assets/dashboard/words.js";

const CLEAR_STDS = 2; // an offset of more standard deviations than this speaks for a drift
const WHY_ENDED = { undone: "undone", back_to_factory: "back to the calibration's zero", other_calibration: "another calibration came" };
const COUNTS = "It counts from the next batch on.";

const offset = (zero) => {
  const payload = signedWithStd(zero.payload_kg, zero.payload_std_kg, 0, "kg");
  return `${payload} and ${signedWithStd(zero.front_share_pct, zero.front_share_std_pct, 1, "points")} on the front axle`;
};

const isClear = (zero) =>
  Math.abs(zero.payload_kg) > CLEAR_STDS * zero.payload_std_kg || Math.abs(zero.front_share_pct) > CLEAR_STDS * zero.front_share_std_pct;

const advice = (zero) => (isClear(zero) ? "" : " That is within its own uncertainty: nothing speaks for a drift.");

const batches = (n) => (n === 1 ? "one batch" : `${n} batches`);

const span = (zero) => `from ${clock(zero.t_start)} to ${clock(zero.t_end)}`;

function active(tare) {
  if (tare === null) return "that of the calibration";
  const note = tare.note ? ` (${tare.note})` : "";
  return `${offset(tare)} are taken off, set ${clock(tare.at)} by ${tare.by}${note}`;
}

function offered({ is_possible, detail, zero }) {
  if (!is_possible) return `not possible: ${detail}`;
  return `would take off ${offset(zero)}, as weighed ${span(zero)}.${advice(zero)}`;
}

function entry(tare) {
  const end = tare.ended ? `; ${WHY_ENDED[tare.ended.why]} ${clock(tare.ended.at)} by ${tare.ended.by}` : "";
  return made("li", `${clock(tare.at)}: ${signed(tare.payload_kg, 0, "kg")}, ${signed(tare.front_share_pct, 1, "points")}, from ${batches(tare.n_batches)}, by ${tare.by}${tare.note ? ` (${tare.note})` : ""}${end}`);
}

show(({ tare }) => {
  if (tare === null) return;
  write("tare-active", active(tare.active));
  write("tare-offer", offered(tare.offer));
  element("tare-set").disabled = !tare.offer.is_possible;
  element("tare-undo").hidden = element("tare-factory").hidden = tare.active === null;
  element("tare-history").hidden = tare.history.length === 0;
  element("tare-entries").replaceChildren(...tare.history.map(entry));
}, "tare");

/** What can be asked for: the question, what would come of it, and how the gateway is told. */
const CHOICES = {
  set: {
    question: "Make this the zero of the empty vehicle?",
    effect: ({ offer }) => `${offset(offer.zero)} will be taken off every payload and share from the next batch on.${advice(offer.zero)}`,
    confirm: "Set the zero",
    ask: (token) => change("POST", TARE, token, { is_empty: true, ...(element("tare-note").value ? { note: element("tare-note").value } : {}) }),
    done: `The zero is set. ${COUNTS}`,
  },
  undo: {
    question: "Undo the last re-zeroing?",
    effect: () => "The zero before it counts again from the next batch on.",
    confirm: "Undo it",
    ask: (token) => change("DELETE", TARE, token),
    done: `Undone. ${COUNTS}`,
  },
  factory: {
    question: "Go back to the calibration's zero?",
    effect: () => "Nothing will be taken off any more from the next batch on.",
    confirm: "Go back",
    ask: (token) => change("DELETE", `${TARE}?to=factory`, token),
    done: `Back to the calibration's zero. ${COUNTS}`,
  },
};

let chosen = null;

function open(name) {
  chosen = CHOICES[name];
  element("tare-form").reset();
  write("tare-question", chosen.question);
  write("tare-effect", chosen.effect(known.tare));
  write("tare-confirm", chosen.confirm);
  element("tare-claim").hidden = name !== "set";
  element("tare-empty").disabled = name !== "set"; // what is hidden must not be required
  if (name === "set") write("tare-empty-text", `The vehicle is empty, and was so while it was weighed, ${span(known.tare.offer.zero)}.`);
  element("tare-token").hidden = !hasToken();
  say("tare-refusal", "");
  element("tare-dialog").showModal();
}

async function confirm(event) {
  event.preventDefault();
  element("tare-confirm").disabled = true;
  try {
    learn({ tare: await chosen.ask(element("tare-token-text").value.trim()) });
    element("tare-dialog").close();
    write("tare-said", chosen.done);
  } catch (error) {
    say("tare-refusal", error.message);
  } finally {
    element("tare-confirm").disabled = false;
  }
}

for (const name of Object.keys(CHOICES)) element(`tare-${name}`).addEventListener("click", () => open(name));
element("tare-form").addEventListener("submit", confirm);
element("tare-cancel").addEventListener("click", () => element("tare-dialog").close());
element("tare-dialog").addEventListener("close", () => element("tare-form").reset()); // no token stays behind
