// Requests to the gateway: with the token of this session, if one was entered.

const TOKEN = `springscale-token ${new URL(".", document.baseURI).pathname}`; // one proxy may serve several vehicles
export const LEARNING = "api/v1/learning";
export const STATEMENTS = "api/v1/statements";

export class Refused extends Error {}

/** Takes the token of this session from the page's form, then calls `goOn`. */
export function acceptToken(goOn) {
  document.getElementById("token").addEventListener("submit", (event) => {
    event.preventDefault();
    sessionStorage.setItem(TOKEN, document.getElementById("token-text").value.trim());
    goOn();
  });
}

/** With the token of this session, if there is one. */
function headers(token = sessionStorage.getItem(TOKEN)) {
  return token ? { Authorization: `Bearer ${token}` } : {};
}

/** The response, whatever its body; throws Refused if a token is missing or wrong, Error for anything else. */
export async function ask(path, more = {}, signal = null) {
  const response = await fetch(path, { headers: { ...headers(), ...more }, cache: "no-store", signal });
  if (response.status === 401 || response.status === 403) throw new Refused(path);
  if (!response.ok) throw new Error(`${path}: status ${response.status}`);
  return response;
}

export const load = async (path) => (await ask(path)).json();

/** Sends a change and gives the answer; throws the gateway's words against it, with each wrong field as `errors`. */
export async function send(method, path, body, type = "application/json") {
  const response = await fetch(path, { method, body, headers: { ...headers(), "Content-Type": type } });
  const told = await response.json();
  if (!response.ok) throw Object.assign(new Error(told.detail), { errors: told.errors ?? [] });
  return told;
}

/** States what is aboard from an instant on: a scale weighs the whole vehicle, all other sources name the payload. */
export function stateLoad(from, source, kg = null) {
  const load = kg === null ? {} : { load: source === "scale" ? { gross_kg: kg } : { payload_kg: kg } };
  return send("POST", STATEMENTS, JSON.stringify({ from, source, ...load }));
}
