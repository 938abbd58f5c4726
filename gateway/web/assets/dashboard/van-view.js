// Where the load lies: the van from above, and its weights in words.

import { show } from "/assets/dashboard/known.js";
import { element, pair, say, write } from "/assets/dashboard/page.js";
import { aside, drawVan } from "/assets/dashboard/van-drawing.js";
import { figure, withStd } from "/assets/dashboard/words.js";

const WHEELS = [
  ["front_left", "Front left wheel"],
  ["front_right", "Front right wheel"],
  ["rear_left", "Rear left wheel"],
  ["rear_right", "Rear right wheel"],
];
const LIMITED = [["gross", "The gross weight"], ["front_axle", "The front axle"], ["rear_axle", "The rear axle"], ...WHEELS.map(([place, name]) => [place, `The ${name.toLowerCase()}`])];
const NO_WHEELS = {
  track_width: "unknown: the campaign states no track width",
  roll_rate: "unknown: no roll rate tells where the load lies sideways",
};

/** Weights and payload come in two answers: the load is drawn only where both are of one estimate. */
const loadOf = (weights, latest) => (weights?.id === latest?.id ? weights?.load : null);

function weightInWords(weight) {
  const limit = weight.limit_kg == null ? "" : ` (limit ${figure(weight.limit_kg, 0, "kg")})`;
  return `${withStd(weight.kg, weight.std_kg, 0, "kg")}${limit}`;
}

const weightPair = (name, weight) => pair(name, weightInWords(weight), weight.is_over_limit ? "over" : "");

function wheelPairs(weights) {
  const known = WHEELS.filter(([place]) => weights[place].kg != null || weights[place].is_over_limit);
  if (known.length) return known.map(([place, name]) => weightPair(name, weights[place]));
  const why = NO_WHEELS[weights.front_left.lacks];
  return why && weights.front_axle.kg != null ? [pair("Wheels", why)] : [];
}

function centreInWords(weights) {
  const place = weights.load;
  if (!place) return weights.id === null ? "unknown" : "no load that is surely there";
  const across = aside(place, (metres, std) => withStd(metres, std, 2, "m"));
  return `${withStd(place.position_m, place.std_m, 2, "m")} behind the front axle${across && `, ${across}`}`;
}

function overloads(weights) {
  return LIMITED.filter(([place]) => weights[place].is_over_limit).map(([, name]) => `${name} is over its limit.`).join(" ");
}

show(({ vehicle, weights, latest, isReachable }) => {
  if (vehicle?.figures) element("van").replaceChildren(drawVan(vehicle, weights, loadOf(weights, latest), latest?.payload_kg));
  element("van").classList.toggle("stale", Boolean(latest?.is_stale) || isReachable === false);
  if (!weights) return;
  element("weights").replaceChildren(
    weightPair("Front axle", weights.front_axle),
    weightPair("Rear axle", weights.rear_axle),
    pair("Load's centre", centreInWords(weights)),
  );
  element("wheels").replaceChildren(...wheelPairs(weights));
  write("gross", weightInWords(weights.gross));
  element("gross").classList.toggle("over", weights.gross.is_over_limit);
  say("overload", overloads(weights));
}, "vehicle", "weights", "latest", "isReachable");
