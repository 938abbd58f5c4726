// The answers so far, each with a link back to it.

import { asked } from "./commissioning-doubts.js";
import { button, made, pair } from "./page.js";
import { phrase } from "./phrases.js";
import { UNKNOWN, clock, figure } from "./words.js";

function place({ sensor_position_m, sensor_offset_left_m }) {
  const m = figure(sensor_position_m, 2, "m");
  return sensor_offset_left_m === null ? phrase("com_behind", { m }) : phrase("com_behind_left", { m, left: figure(sensor_offset_left_m, 2, "m") });
}

function axles({ kerb_front_axle_kg: front, kerb_rear_axle_kg: rear }) {
  const kg = (x) => figure(x, Number.isInteger(x) ? 0 : 1, "kg");
  return phrase("com_axles", { front: kg(front), rear: kg(rear), share: figure((100 * front) / (front + rear), 0, "%") });
}

const ifTyped = (typed, digits, unit) => (typed === null || typed === undefined ? UNKNOWN : figure(typed, digits, unit));

function entered({ vehicle, empty }) {
  const rows = [];
  if (vehicle !== null) {
    rows.push(
      ["com_sum_axles", axles(vehicle), "vehicle"],
      ["com_sum_gross", figure(vehicle.kerb_front_axle_kg + vehicle.kerb_rear_axle_kg, 0, "kg"), "vehicle"],
      ["com_sum_wheelbase", figure(vehicle.wheelbase_m, 2, "m"), "vehicle"],
      ["com_sum_track", ifTyped(vehicle.track_width_m, 2, "m"), "vehicle"],
      ["com_sum_sensor", place(vehicle), "vehicle"],
      ["com_sum_payload", ifTyped(vehicle.payload_range_kg?.[1], 0, "kg"), "vehicle"],
    );
    if (vehicle.carries) rows.push(["com_sum_carries", phrase(`com_carries.${vehicle.carries}`), "vehicle"]);
  }
  if (empty) rows.push(["com_sum_empty", phrase("com_empty_by", { time: clock(empty.at), by: empty.by }), null]);
  return rows;
}

/** Terms and descriptions for a <dl class="pairs">; `goTo` shows a step again, null: nothing can be changed now. */
export function summary(underway, goTo) {
  const steps = new Set();
  const rows = entered(underway).map(([key, text, step]) => {
    const row = pair(phrase(key), text);
    if (goTo !== null && step !== null && !steps.has(step)) {
      steps.add(step); // one way back to each step
      row.lastChild.append(" ", button(phrase("com_change"), phrase("com_change_of", { what: phrase(key) }), () => goTo(step), "link"));
    }
    return row;
  });
  const confirmed = underway.confirmed.map((one) => made("div", phrase("com_confirmed", { what: asked(one).replace(/\.$/, "") }), "soft wide"));
  return [...rows, ...confirmed];
}
