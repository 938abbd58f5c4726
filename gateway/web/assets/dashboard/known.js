// The page's state, and the views of its parts.

/** Everything received from the gateway; null: not received yet. */
export const known = {
  latest: null, // GET /estimates/latest
  latestAtMs: 0, // performance.now() of that answer: the age goes on even where the gateway is gone
  status: null,
  vehicle: null,
  weights: null,
  learning: null, // GET /learning
  alarms: null, // newest first, those that stand among them
  events: null, // load events, newest first
  trips: null, // likewise
  reasons: new Map(), // reason -> {happened, advice}
  sources: new Map(), // source of error -> words
  remedies: new Map(), // remedy -> what to do
  batches: null, // newest first, rejections included
  early: null, // the provisional estimate of the batch under way
  truth: [], // known loads, where somebody knows them
  hours: 24, // how far back the history looks
  isLive: false, // the stream is open
  isReachable: null, // the last question was answered
  isRefused: false, // it wants a token
  palette: 0, // counts changes of colour
};

const views = [];

/** Calls `draw(known)` whenever one of the `parts` changes. */
export function show(draw, ...parts) {
  views.push({ draw, parts });
}

/** Stores what was received and redraws its views. */
export function learn(news) {
  Object.assign(known, news);
  for (const { draw, parts } of views) if (parts.some((part) => part in news)) draw(known);
}

/** Seconds since the latest estimate was received; null before the first. */
export function ageNow() {
  return known.latest?.age_s == null ? null : known.latest.age_s + (performance.now() - known.latestAtMs) / 1000;
}
