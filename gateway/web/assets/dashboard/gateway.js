// Requests to the gateway: with the token of this session, if one was entered.

const TOKEN = `springscale-token ${new URL(".", document.baseURI).pathname}`; // one proxy may serve several vehicles
export const KNOWN_WEIGHTS = "api/v1/known-weights";
export const COMMISSIONING = "api/v1/calibration/commissioning";
export const VERIFICATIONS = "api/v1/calibration/verifications";
export const ALARMS = "api/v1/alarms?order=newest_first&limit=50";

export class Refused extends Error {}

export const setToken = (text) => sessionStorage.setItem(TOKEN, text.trim());

export const hasToken = () => sessionStorage.getItem(TOKEN) !== null;

/** With the token of this session, if there is one. */
export function headers(token = sessionStorage.getItem(TOKEN)) {
  return token ? { Authorization: `Bearer ${token}` } : {};
}

/** The response, whatever its body; throws Refused if a token is missing or wrong, Error for anything else. */
export async function ask(path, more = {}, signal = null) {
  const response = await fetch(path, { headers: { ...headers(), ...more }, cache: "no-store", signal });
  if (response.status === 401 || response.status === 403) throw new Refused(path);
  if (!response.ok) throw new Error(`${path}: status ${response.status}`);
  return response;
}

/** Saves what is at `path` as a file. A link cannot carry the token; a question can. */
export async function download(path, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(await (await ask(path)).blob());
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}

export const load = async (path) => (await ask(path)).json();

/** Requests a change, with another token if one is given; returns the `state` after it, or throws the gateway's words. */
export async function change(method, path, token, claim, state) {
  const said = { ...headers(token || undefined), "Content-Type": "application/json" };
  const response = await fetch(path, { method, body: claim && JSON.stringify(claim), headers: said }).catch(() => {
    throw new Error("The gateway did not answer. Check whether anything changed before you try again.");
  });
  if (!response.ok) throw new Error((await response.json()).detail);
  return load(state);
}
