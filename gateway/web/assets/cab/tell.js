// What the driver says of the load while the vehicle stands. Whoever knows nothing just drives.

import { headers, load } from "../dashboard/gateway.js";
import { acceptNumbers, element, numberText, say, typedNumber } from "../dashboard/page.js";
import { phrase } from "./sentences.js";

/** States a load from the vehicle's present time on; throws the gateway's words. */
async function state(statement) {
  const { vehicle_time: from } = await load("api/v1/learning");
  const said = { ...headers(), "Content-Type": "application/json" };
  const response = await fetch("api/v1/statements", { method: "POST", body: JSON.stringify({ from, ...statement }), headers: said });
  if (!response.ok) throw new Error((await response.json()).detail);
}

async function tell(statement) {
  try {
    await state(statement);
    element("tell").reset();
    say("told", phrase("told"));
  } catch (error) {
    say("told", phrase("not_told", { why: error.message }));
  }
}

/** Shows the question only while the vehicle stands. */
export function offer(cab) {
  element("tell").hidden = cab.load !== "standing";
  if (element("tell").hidden) say("told", "");
}

export function listen() {
  acceptNumbers(phrase("number_hint", { example: numberText(310) }));
  element("tell").addEventListener("submit", (event) => {
    event.preventDefault();
    const source = element("tell-source").value, kg = typedNumber(element("tell-kg").value);
    tell({ source, load: source === "scale" ? { gross_kg: kg } : { payload_kg: kg } });
  });
  element("tell-empty").addEventListener("click", () => tell({ source: "empty" }));
}
