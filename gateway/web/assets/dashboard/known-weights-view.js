// Known weights: what is in use, what waits for a confirmation, and how one is stated or taken back.

import { KNOWN_WEIGHTS, change, hasToken } from "/assets/dashboard/gateway.js";
import { known, learn, show } from "/assets/dashboard/known.js";
import { element, made, say, write } from "/assets/dashboard/page.js";
import { capital, clock, signed, withStd, words } from "/assets/dashboard/words.js";

const COUNTS = "It counts from the next batch on.";
const STATES = { in_use: "in use", held: "held: nobody has confirmed it yet", other_calibration: "of another calibration" };

const payload = (one) => withStd(one.payload_kg, one.payload_std_kg, 0, "kg");

const estimated = (one) => withStd(one.estimated_payload_kg, one.estimated_payload_std_kg, 0, "kg");

const span = (load) => `from ${clock(load.t_start)} to ${clock(load.t_end)}`;

function inUse({ n_teaching, mean_error_kg, error_std_kg }) {
  if (n_teaching === 0) return "none: weighed by the calibration alone";
  const scatter = error_std_kg === null ? "" : `, scatter ${withStd(error_std_kg, null, 0, "kg")}`;
  return `${n_teaching}; without them estimates were ${signed(mean_error_kg, 0, "kg")} off${scatter}`;
}

function offered({ is_possible, detail, load }) {
  return is_possible ? `would be of the load that was weighed as ${payload(load)}, ${span(load)}` : `not possible: ${detail}`;
}

function stateText(one) {
  if (one.state !== "ended") return STATES[one.state];
  return `${one.ended.why === "withdrawn" ? "taken back" : "all taken back"} ${clock(one.ended.at)} by ${one.ended.by}`;
}

function button(text, one, name) {
  const pressed = made("button", text);
  pressed.type = "button";
  pressed.setAttribute("aria-label", `${text.replace(" …", "")}: ${words(one.kind)} of ${clock(one.t_start)}`);
  pressed.addEventListener("click", () => open(name, one));
  return pressed;
}

function entry(one) {
  const said = `${clock(one.t_start)}, ${words(one.kind)}: ${payload(one)} known, ${estimated(one)} estimated without it; by ${one.by}${one.note ? ` (${one.note})` : ""}; ${stateText(one)} `;
  const parts = [made("span", said)];
  if (one.state === "held") parts.push(button("Confirm …", one, "confirm"), made("span", " "));
  if (one.ended === null) parts.push(button("Take back …", one, "back"));
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

/** What can be asked for: the question, what would come of it, and how the gateway is asked. */
const CHOICES = {
  empty: {
    question: () => "The vehicle is empty now?",
    effect: () => `It was weighed as ${payload(known.knownWeights.offer.load)}. Every later estimate takes into account what it truly carries: nothing.`,
    confirm: "It is empty",
    ask: (token, note) => change("POST", KNOWN_WEIGHTS, token, { kind: "empty", ...note }, KNOWN_WEIGHTS),
    done: `Kept. ${COUNTS}`,
  },
  confirm: {
    question: (one) => `Is it truly ${payload(one)}?`,
    effect: (one) => `The load was weighed as ${estimated(one)}: one of these numbers is wrong. Confirmed, the known weight moves every later estimate.`,
    confirm: "The known weight is right",
    ask: (token, note, one) => change("POST", `${KNOWN_WEIGHTS}/${one.id}/confirm`, token, undefined, KNOWN_WEIGHTS),
    done: `Confirmed. ${COUNTS}`,
  },
  back: {
    question: (one) => `Take back the known weight of ${payload(one)}?`,
    effect: () => "From the next batch on all numbers are as if it had never been stated.",
    confirm: "Take it back",
    ask: (token, note, one) => change("DELETE", `${KNOWN_WEIGHTS}/${one.id}`, token, undefined, KNOWN_WEIGHTS),
    done: "Taken back.",
  },
};

let chosen = null, subject = null;

function open(name, one = null) {
  [chosen, subject] = [CHOICES[name], one];
  element("weights-form").reset();
  write("weights-question", chosen.question(one));
  write("weights-effect", chosen.effect(one));
  write("weights-confirm", chosen.confirm);
  element("weights-claim").hidden = name !== "empty";
  element("weights-claimed").disabled = name !== "empty"; // what is hidden must not be required
  if (name === "empty") write("weights-claim-text", `The vehicle is empty, and was so while it was weighed, ${span(known.knownWeights.offer.load)}.`);
  element("weights-token").hidden = !hasToken();
  say("weights-refusal", "");
  element("weights-dialog").showModal();
}

async function confirm(event) {
  event.preventDefault();
  element("weights-confirm").disabled = true;
  try {
    const note = element("weights-note").value;
    learn({ knownWeights: await chosen.ask(element("weights-token-text").value.trim(), note ? { note } : {}, subject) });
    element("weights-dialog").close();
    write("weights-said", capital(chosen.done));
  } catch (error) {
    say("weights-refusal", error.message);
  } finally {
    element("weights-confirm").disabled = false;
  }
}

element("weights-empty").addEventListener("click", () => open("empty"));
element("weights-form").addEventListener("submit", confirm);
element("weights-cancel").addEventListener("click", () => element("weights-dialog").close());
element("weights-dialog").addEventListener("close", () => element("weights-form").reset()); // no token stays behind
