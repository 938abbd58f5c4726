// The van from above, front to the left: the load on each axle and wheel, and the load's centre of gravity.
// To scale along by the wheelbase and across by the track width.

import { shape } from "./parts.js";
import { phrase } from "./phrases.js";
import { Z95, withInterval } from "./plus-minus.js";
import { capital, figure, number } from "./words.js";

const FRONT_X = 96, REAR_X = 290, MIDDLE_Y = 96, HALF_TRACK = 58; // chosen: units of the drawing
const LARGEST_RADIUS = 30, LARGEST_REACH = 200; // chosen likewise
const Z95_OF_TWO = 2.448; // 95 % of two normal numbers: the root of chi-squared of two, 5.991
const AXLES = ["front_axle", "rear_axle"];
const WHEELS = [
  ["front_left", FRONT_X, 1], // the vehicle's left is below
  ["front_right", FRONT_X, -1],
  ["rear_left", REAR_X, 1],
  ["rear_right", REAR_X, -1],
];

const overOf = (weight) => (weight?.is_over_limit ? "over" : "");

function wheel([place, x, side], weights) {
  const y = MIDDLE_Y + side * HALF_TRACK;
  return shape("rect", { class: `wheel ${overOf(weights?.[place])}`, x: x - 17, y: y - 7, width: 34, height: 14, rx: 4 });
}

/** Beside the wheel, towards the other axle: its load, and its limit below; empty if unknown. */
function wheelLabel([place, x, side], weights) {
  const weight = weights?.[place];
  if (weight?.kg == null) return [];
  const inwards = x === FRONT_X ? 1 : -1;
  const where = { x: x + inwards * 23, y: MIDDLE_Y + side * HALF_TRACK + (side > 0 ? 5 : 3) };
  const anchor = `${inwards > 0 ? "from" : "to"} ${overOf(weight)}`;
  const limit = weight.limit_kg == null ? [] : [shape("text", { class: `small ${anchor}`, ...where, y: where.y - side * 14 }, limitText(weight))];
  return [shape("text", { class: `on-wheel ${anchor}`, ...where }, withInterval(weight.kg, weight.interval95_kg, 0, "kg")), ...limit];
}

function body(weights) {
  return [
    ...WHEELS.map((one) => wheel(one, weights)),
    shape("path", { class: "body", d: "M52 56 Q36 60 34 96 Q36 132 52 136 L120 146 H344 Q358 146 358 132 V60 Q358 46 344 46 H120 Z" }),
    shape("path", { class: "glass", d: "M122 56 Q104 96 122 136 L142 130 Q134 96 142 62 Z" }),
    ...[FRONT_X, REAR_X].map((x) => shape("line", { class: "axle", x1: x, x2: x, y1: 30, y2: 162 })),
  ];
}

const limitText = (weight) => phrase("of_limit", { kg: figure(weight.limit_kg, 0, "kg") });

function axleLabel(x, place, weight) {
  return [
    shape("text", { class: "small", x, y: 22 }, phrase(`place.${place}`)),
    shape("text", { class: overOf(weight), x, y: 182 }, withInterval(weight?.kg, weight?.interval95_kg, 0, "kg")),
    ...(weight?.limit_kg == null ? [] : [shape("text", { class: `small ${overOf(weight)}`, x, y: 198 }, limitText(weight))]),
  ];
}

/** The 95 % ellipse of two numbers with these deviations and correlation: half axes, and degrees from along to across. */
function ellipse(along, across, correlation) {
  const common = (correlation ?? 0) * along * across, mean = (along ** 2 + across ** 2) / 2;
  const apart = Math.hypot((along ** 2 - across ** 2) / 2, common);
  return {
    rx: Z95_OF_TWO * Math.sqrt(mean + apart),
    ry: Z95_OF_TWO * Math.sqrt(Math.max(0, mean - apart)),
    degrees: (Math.atan2(2 * common, along ** 2 - across ** 2) * 90) / Math.PI,
  };
}

/** The 95 % region of the load's position: along and across by an ellipse, along alone by a bar. */
function spread(place, x, y, radius, scale) {
  if (place.left_m == null || place.left_std_m == null) {
    const reach = Math.min(Z95 * place.std_m * scale.along, LARGEST_REACH);
    return [
      shape("rect", { class: "spread", x: x - reach, y: y - radius, width: 2 * reach, height: 2 * radius, rx: 6 }),
      shape("path", { class: "about", d: `M${x - reach} ${y - 5} v10 m0 -5 H${x + reach} m0 -5 v10` }),
    ];
  }
  const { rx, ry, degrees } = ellipse(place.std_m * scale.along, place.left_std_m * scale.across, place.correlation);
  const where = { cx: x, cy: y, rx: Math.min(rx, LARGEST_REACH), ry: Math.min(ry, LARGEST_REACH), transform: `rotate(${degrees} ${x} ${y})` };
  return [shape("ellipse", { class: "spread", ...where }), shape("ellipse", { class: "about", ...where })];
}

/** The load as a disc whose area is its mass, with the 95 % region of its position. */
function load(place, payloadKg, fullKg, scale) {
  if (!place) return [];
  const x = FRONT_X + place.position_m * scale.along, y = MIDDLE_Y + (place.left_m ?? 0) * scale.across;
  const radius = Math.max(8, LARGEST_RADIUS * Math.sqrt(Math.min(1, payloadKg / fullKg)));
  const [under, over] = spread(place, x, y, radius, scale);
  return [
    under,
    shape("circle", { class: "load", cx: x, cy: y, r: radius }),
    over,
    shape("circle", { class: "centre", cx: x, cy: y, r: 3.5 }),
  ];
}

function sensor(figures, scale) {
  const x = FRONT_X + figures.sensor_position_m * scale.along, y = MIDDLE_Y + figures.sensor_offset_left_m * scale.across;
  return [
    shape("path", { class: "sensor", d: `M${x} ${y - 7} l7 7 l-7 7 l-7 -7 Z` }),
    shape("text", { class: "small", x, y: y - 11 }, phrase("sensor")),
  ];
}

/** "0.12 m left of the centre line"; empty if unknown. */
export function aside(place, told) {
  if (place?.left_m == null) return "";
  return phrase(place.left_m < 0 ? "right_of" : "left_of", { metres: told(Math.abs(place.left_m), place.left_std_m) });
}

/** The drawing as text, for people who cannot see it. */
function inWords(weights) {
  const place = weights?.load;
  const across = aside(place, (metres) => `${number(metres, 2)} m`);
  const where = place && `${phrase("behind_front", { metres: `${number(place.position_m, 2)} m` })}${across && `, ${across}`}`;
  const borne = [...AXLES, ...WHEELS.map(([name]) => name)].filter((name) => weights?.[name]?.kg != null)
    .map((name) => `${phrase(`place.${name}`)} ${withInterval(weights[name].kg, weights[name].interval95_kg, 0, "kg")}${weights[name].limit_kg == null ? "" : phrase("limit", { kg: figure(weights[name].limit_kg, 0, "kg") })}`);
  return `${phrase(place ? "van_load" : "van_empty", { where })}${borne.length ? phrase("van_bears", { places: capital(borne.join(", ")) }) : ""}`;
}

/** Pixels per metre along and across; the same for both if the track width is unknown. */
function scaleOf(figures) {
  const along = (REAR_X - FRONT_X) / figures.wheelbase_m;
  return { along, across: figures.track_width_m ? (2 * HALF_TRACK) / figures.track_width_m : along };
}

/** The drawing; `place` is the load's position, null for none. */
export function drawVan(vehicle, weights, place, payloadKg) {
  const scale = scaleOf(vehicle.figures);
  const fullKg = Math.max(vehicle.calibration?.payload_seen_kg[1] ?? 0, 1);
  const drawing = shape("svg", { viewBox: "20 8 352 200", role: "img", "aria-label": inWords(weights) });
  drawing.append(
    ...body(weights),
    ...load(place, payloadKg, fullKg, scale),
    ...sensor(vehicle.figures, scale),
    ...axleLabel(FRONT_X, "front_axle", weights?.front_axle),
    ...axleLabel(REAR_X, "rear_axle", weights?.rear_axle),
    ...WHEELS.flatMap((one) => wheelLabel(one, weights)),
  );
  return drawing;
}
