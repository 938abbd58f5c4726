// Keeps the page's state in step with the gateway: fetches it at the start and now and then, follows the stream in
// between.

import { follow } from "./event-stream.js";
import { alarmsOf } from "./alarm-view.js";
import { LEARNING, Refused, load } from "./gateway.js";
import { known, learn } from "./known.js";
import { element } from "./page.js";
import { explained } from "./phrases.js";

const ALARMS = "api/v1/alarms?order=newest_first&limit=50";
const ASK_EVERY_MS = 5000; // chosen: as the cab page
const GATHER_MS = 50; // chosen: shorter than a person notices
const MOST_BATCHES = 1000; // the limit of a page of the API
const BATCHES_BY_HOURS = { 3: 300, 24: 300, 168: MOST_BATCHES };

async function askNow() {
  try {
    const [status, latest] = await Promise.all([load("api/v1/status"), load("api/v1/estimates/latest")]);
    learn({ status, latest, latestAtMs: performance.now(), isReachable: true, isRefused: false });
    const [weights, learning] = await Promise.all([load("api/v1/weights/latest"), load(LEARNING)]);
    learn({ weights, learning }); // the verdict changes with alarms, and learning with statements, at any time
  } catch (error) {
    learn({ isReachable: error instanceof Refused, isRefused: error instanceof Refused });
  }
}

async function askBatches() {
  const page = await load(`api/v1/estimates?order=newest_first&spectra=false&limit=${BATCHES_BY_HOURS[known.hours]}`);
  learn({ batches: page.items });
  return page.last_cursor;
}

const ENTRIES = "order=newest_first&limit=200";

async function askDay() {
  if (element("day") === null) return; // an engineer's page
  const [events, trips] = await Promise.all([load(`api/v1/events?${ENTRIES}`), load(`api/v1/trips?${ENTRIES}`)]);
  learn({ events: events.items, trips: trips.items });
}

const askAlarms = async () => learn({ alarms: alarmsOf(await load(ALARMS)) });

/** With the newest revision of one entry; an older one that arrives late changes nothing. */
function revised(entries, entry) {
  const before = (entries ?? []).find((one) => one.id === entry.id);
  if (before && before.revision >= entry.revision) return entries;
  return [entry, ...(entries ?? []).filter((one) => one.id !== entry.id)];
}

async function askOnce() {
  const [vehicle, reasons] = await Promise.all([load("api/v1/vehicle"), load("api/v1/reasons")]);
  learn({ vehicle, ...explained(reasons) });
}

async function askTruth() {
  const path = document.body.dataset.knownLoads;
  if (path) learn({ truth: (await load(path)).items });
}

const remembered = (record) => [record, ...(known.batches ?? []).filter((batch) => batch.id !== record.id)].slice(0, MOST_BATCHES);

let asking = null;

/** Once for all events that arrive together, as they do after a pause. */
function askSoon() {
  asking ??= setTimeout(() => {
    asking = null;
    Promise.all([askNow(), askTruth()]).catch(giveUpUntilNext);
  }, GATHER_MS);
}

function onEvent(kind, record) {
  if (kind === "provisional") {
    learn({ early: record });
    askNow();
  } else if (kind === "estimate" || kind === "rejection") {
    learn({ early: null, batches: remembered(record) });
    askSoon();
  } else if (kind === "event") {
    learn({ events: revised(known.events, record) });
  } else if (kind === "trip") {
    learn({ trips: revised(known.trips, record) });
  } else if (kind === "alarm") {
    learn({ alarms: revised(known.alarms, record) });
    askSoon();
  }
}

const giveUpUntilNext = (error) => console.info(error.message);

/** What the page needs to be complete; fetched again whenever the stream comes back. */
async function catchUp() {
  await askNow();
  await Promise.all([askOnce(), askTruth()]);
  await Promise.all([askAlarms(), askDay()]);
}

/** Begins; never ends. */
export async function feed() {
  let cursor = null;
  await askNow();
  try {
    [cursor] = await Promise.all([askBatches(), catchUp()]);
  } catch (error) {
    giveUpUntilNext(error);
  }
  setInterval(askNow, ASK_EVERY_MS);
  let hasBeenLive = false;
  await follow("api/v1/stream", cursor, onEvent, (isLive) => {
    learn({ isLive });
    if (isLive && hasBeenLive) catchUp().catch(giveUpUntilNext);
    hasBeenLive ||= isLive;
  });
}

/** Shows a longer or shorter past. */
export function lookBack(hours) {
  learn({ hours });
  askBatches().catch(giveUpUntilNext);
}
