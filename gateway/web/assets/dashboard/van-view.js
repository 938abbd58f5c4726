// The load's position: the van from above, and its weights in words.

import { show } from "./known.js";
import { element, pair, say } from "./page.js";
import { aside, drawVan } from "./van-drawing.js";
import { phrase } from "./phrases.js";
import { withInterval, withStd } from "./plus-minus.js";
import { UNKNOWN, capital, figure } from "./words.js";

const WHEELS = ["front_left", "front_right", "rear_left", "rear_right"];
const LIMITED = ["gross", "front_axle", "rear_axle", ...WHEELS];
const SAID = ["near", "over", "uneven", "was_over", "vague"];
const NO_WHEELS = { track_width: "no_track", roll_rate: "no_roll" };

/** Weights and payload come in two answers: the load is drawn only if both belong to one estimate. */
const loadOf = (weights, latest) => (weights?.id === latest?.id ? weights?.load : null);

function weightInWords(weight) {
  const limit = weight.limit_kg == null ? "" : phrase("limit", { kg: figure(weight.limit_kg, 0, "kg") });
  return `${withInterval(weight.kg, weight.interval95_kg, 0, "kg")}${limit}`;
}

/** Why no wheel is weighed; the drawing shows the wheel loads. */
function wheelPairs(weights) {
  const why = NO_WHEELS[weights.front_left.lacks];
  return why && weights.front_left.kg == null && weights.front_axle.kg != null ? [pair(phrase("wheels"), phrase(why))] : [];
}

function centreInWords(weights) {
  const place = weights.load;
  if (!place) return weights.id === null ? UNKNOWN : phrase("no_load");
  const across = aside(place, (metres, std) => withStd(metres, std, 2, "m"));
  return `${phrase("behind_front", { metres: withStd(place.position_m, place.std_m, 2, "m") })}${across && `, ${across}`}`;
}

/** The weights with the places that the verdict calls too heavy marked so: the drawing and the sentence agree. */
function judged(weights) {
  const over = weights.verdict.light === "over" ? weights.verdict.light_about : [];
  const marked = LIMITED.map((place) => [place, { ...weights[place], is_over_limit: over.includes(place) }]);
  return { ...weights, ...Object.fromEntries(marked) };
}

/** The verdict as a sentence; empty while nothing is near a limit. */
function verdictText({ says, light_about: about }) {
  if (!SAID.includes(says)) return "";
  return phrase(`verdict.${says}`, { places: capital(about.map((place) => phrase.named("place", place)).join(", ")) });
}

show(({ vehicle, weights: found, latest, isReachable }) => {
  const weights = found && judged(found);
  if (vehicle?.figures) element("van").replaceChildren(drawVan(vehicle, weights, loadOf(weights, latest), latest?.payload_kg));
  element("van").classList.toggle("stale", Boolean(latest?.is_stale) || isReachable === false);
  if (!weights) return;
  element("weights").replaceChildren(
    pair(phrase("gross"), weightInWords(weights.gross), weights.gross.is_over_limit ? "over" : ""),
    pair(phrase("centre"), centreInWords(weights)),
    ...wheelPairs(weights),
  );
  say("overload", verdictText(weights.verdict));
  element("overload").className = weights.verdict.light === "over" ? "alarm" : "warning";
}, "vehicle", "weights", "latest", "isReachable");
