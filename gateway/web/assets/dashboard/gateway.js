// Requests to the gateway: with the token of this session, if one was entered.

const TOKEN = `springscale-token ${new URL(".", document.baseURI).pathname}`; // one proxy may serve several vehicles
export const LEARNING = "api/v1/learning";
export const ALARMS = "api/v1/alarms?order=newest_first&limit=50";

export class Refused extends Error {}

export const setToken = (text) => sessionStorage.setItem(TOKEN, text.trim());

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

export const load = async (path) => (await ask(path)).json();
