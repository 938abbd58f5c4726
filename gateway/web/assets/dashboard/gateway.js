// How the pages ask the gateway: with the token of this session, if one was entered.

const TOKEN = "springscale-token";

export class Refused extends Error {}

export const setToken = (text) => sessionStorage.setItem(TOKEN, text.trim());

export function headers() {
  const token = sessionStorage.getItem(TOKEN);
  return token ? { Authorization: `Bearer ${token}` } : {};
}

/** The response, whatever its body; throws Refused where a token is missing or wrong, Error for anything else. */
export async function ask(path, more = {}) {
  const response = await fetch(path, { headers: { ...headers(), ...more }, cache: "no-store" });
  if (response.status === 401 || response.status === 403) throw new Refused(path);
  if (!response.ok) throw new Error(`${path}: status ${response.status}`);
  return response;
}

export const load = async (path) => (await ask(path)).json();
