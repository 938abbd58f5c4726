// The van from above: axle loads, and where the load's centre of gravity lies. Drawn to scale along its length.

import { show } from "/assets/dashboard/known.js";
import { element, pair, say, write } from "/assets/dashboard/page.js";
import { figure, number, withStd } from "/assets/dashboard/words.js";

const SVG = "http://www.w3.org/2000/svg";
const FRONT_X = 96, REAR_X = 290, MIDDLE_Y = 96, HALF_TRACK = 58;
const LARGEST_RADIUS = 30;

function shape(name, attributes, text = "") {
  const built = document.createElementNS(SVG, name);
  for (const [key, content] of Object.entries(attributes)) built.setAttribute(key, content);
  built.textContent = text;
  return built;
}

function wheel(x, side) {
  return shape("rect", { class: "wheel", x: x - 17, y: MIDDLE_Y + side * HALF_TRACK - 7, width: 34, height: 14, rx: 4 });
}

function body() {
  return [
    ...[FRONT_X, REAR_X].flatMap((x) => [wheel(x, -1), wheel(x, 1)]),
    shape("path", { class: "body", d: "M52 56 Q36 60 34 96 Q36 132 52 136 L120 146 H344 Q358 146 358 132 V60 Q358 46 344 46 H120 Z" }),
    shape("path", { class: "glass", d: "M122 56 Q104 96 122 136 L142 130 Q134 96 142 62 Z" }),
    ...[FRONT_X, REAR_X].map((x) => shape("line", { class: "axle", x1: x, x2: x, y1: 30, y2: 162 })),
  ];
}

function axleLabel(x, name, weight) {
  const isOver = weight?.is_over_limit ? "over" : "";
  return [
    shape("text", { class: "small", x, y: 22 }, name),
    shape("text", { class: isOver, x, y: 182 }, withStd(weight?.kg, weight?.std_kg, 0, "kg")),
  ];
}

/** The load as a disc whose area is its mass, with the 95 % interval of its place across it. */
function load(place, payloadKg, fullKg, toX) {
  if (!place) return [];
  const x = toX(place.position_m), reach = Math.min(toX(1.96 * place.std_m) - toX(0), 200);
  const radius = Math.max(8, LARGEST_RADIUS * Math.sqrt(Math.min(1, payloadKg / fullKg)));
  return [
    shape("rect", { class: "spread", x: x - reach, y: MIDDLE_Y - radius, width: 2 * reach, height: 2 * radius, rx: 6 }),
    shape("circle", { class: "load", cx: x, cy: MIDDLE_Y, r: radius }),
    shape("path", { class: "about", d: `M${x - reach} ${MIDDLE_Y - 5} v10 m0 -5 H${x + reach} m0 -5 v10` }),
    shape("circle", { class: "centre", cx: x, cy: MIDDLE_Y, r: 3.5 }),
  ];
}

function sensor(figures, toX) {
  const x = toX(figures.sensor_position_m), pixelsPerMetre = toX(1) - toX(0);
  const y = MIDDLE_Y + figures.sensor_offset_left_m * pixelsPerMetre; // front is left: the vehicle's left is below
  return [
    shape("path", { class: "sensor", d: `M${x} ${y - 7} l7 7 l-7 7 l-7 -7 Z` }),
    shape("text", { class: "small", x, y: y - 11 }, "sensor"),
  ];
}

function inWords(weights) {
  const place = weights?.load;
  if (!place) return "Van from above. No payload that is surely there.";
  return `Van from above. The load's centre lies ${number(place.position_m, 2)} m behind the front axle.`;
}

/** Weights and payload come in two answers: the load is drawn only where both are of one estimate. */
const loadOf = (weights, latest) => (weights?.id === latest?.id ? weights?.load : null);

function draw(vehicle, weights, latest) {
  const figures = vehicle.figures;
  const toX = (metres) => FRONT_X + (metres / figures.wheelbase_m) * (REAR_X - FRONT_X);
  const drawing = shape("svg", { viewBox: "20 8 352 184", role: "img", "aria-label": inWords(weights) });
  const fullKg = Math.max(vehicle.calibration?.payload_seen_kg[1] ?? 0, 1);
  drawing.append(
    ...body(),
    ...load(loadOf(weights, latest), latest?.payload_kg, fullKg, toX),
    ...sensor(figures, toX),
    ...axleLabel(FRONT_X, "front axle", weights?.front_axle),
    ...axleLabel(REAR_X, "rear axle", weights?.rear_axle),
  );
  return drawing;
}

function weightInWords(weight) {
  const limit = weight.limit_kg == null ? "" : ` (limit ${figure(weight.limit_kg, 0, "kg")})`;
  return `${withStd(weight.kg, weight.std_kg, 0, "kg")}${limit}`;
}

const weightPair = (name, weight) => pair(name, weightInWords(weight), weight.is_over_limit ? "over" : "");

function overloads(weights) {
  const named = [["The gross weight", weights.gross], ["The front axle", weights.front_axle], ["The rear axle", weights.rear_axle]];
  return named.filter(([, weight]) => weight.is_over_limit).map(([name]) => `${name} is over its limit.`).join(" ");
}

show(({ vehicle, weights, latest, isReachable }) => {
  if (vehicle?.figures) element("van").replaceChildren(draw(vehicle, weights, latest));
  element("van").classList.toggle("stale", Boolean(latest?.is_stale) || isReachable === false);
  if (!weights) return;
  const place = weights.load;
  element("weights").replaceChildren(
    weightPair("Front axle", weights.front_axle),
    weightPair("Rear axle", weights.rear_axle),
    pair("Load's centre", place ? `${withStd(place.position_m, place.std_m, 2, "m")} behind the front axle` : weights.id === null ? "unknown" : "no load that is surely there"),
  );
  write("gross", weightInWords(weights.gross));
  element("gross").classList.toggle("over", weights.gross.is_over_limit);
  say("overload", overloads(weights));
}, "vehicle", "weights", "latest", "isReachable");
