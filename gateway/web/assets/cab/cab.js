// The cab page: asks one small question every few seconds and shows the answer, its age, and what is unknown.

import { stayAwake } from "./wake-lock.js";
import { aboard, about, alarm, alarmText, eventText, lightText, notSeen, ownReading, phrase, question, spareText, stood } from "./sentences.js";
import { LEARNING, Refused, acceptToken, ask, load, stateLoad } from "../dashboard/gateway.js";
import { acceptNumbers, element, made, numberText, pair, say, typedNumber, write } from "../dashboard/page.js";
import { number } from "../dashboard/words.js";
import { fill } from "../language.js";

const ASK_EVERY_MS = 5000; // chosen: as long as a glance may wait
const ANSWER_WITHIN_MS = 4000; // chosen: less than until the next question
const GONE_AFTER_S = 15; // chosen: three questions without an answer
const UNIT = 1.5; // characters that the small unit is as wide as

const opened = now();
let cab = null;
let heard = null; // when `cab` came
let isRefused = false;

function now() {
  return { wall: Date.now(), page: performance.now() };
}

/** Uses two clocks: one may be set, the other may stand still while the phone sleeps. */
const secondsSince = (then) => Math.max(Date.now() - then.wall, performance.now() - then.page) / 1000;

async function askNow() {
  const patience = new AbortController();
  const timer = setTimeout(() => patience.abort(), ANSWER_WITHIN_MS);
  try {
    cab = await (await ask("api/v1/cab", {}, patience.signal)).json();
    heard = now();
    isRefused = false;
  } catch (error) {
    isRefused = error instanceof Refused;
  } finally {
    clearTimeout(timer);
  }
  draw();
}

/** Shows two texts in an element, or hides it if both are empty. */
function sayBoth(id, [first, one], [second, other]) {
  write(first, one);
  write(second, other);
  element(id).hidden = one + other === "";
}

function validity(silentS) {
  if (isRefused || cab === null) return "asking";
  if (silentS > GONE_AFTER_S || cab.is_stale) return "old";
  return cab.load === "weighed" && !cab.is_doubted ? "current" : "earlier";
}

function writeNumber(kg) {
  const text = kg === null ? "?" : number(kg, 0);
  element("number").replaceChildren(text, kg === null ? "" : made("small", `\u00a0${phrase("kg")}`));
  element("number").style.setProperty("--n-chars", text.length + UNIT);
}

function draw() {
  const silentS = secondsSince(heard ?? opened);
  const [alarmed, howLong] = alarm(cab, { isRefused, isGone: silentS > GONE_AFTER_S, silentS });
  sayBoth("bar", ["bar-what", alarmed], ["bar-how-long", howLong]);
  element("token").hidden = !isRefused;
  element("main").hidden = isRefused;
  element("main").dataset.is = validity(silentS);
  if (cab === null || isRefused) return;
  element("main").dataset.light = cab.light;
  const isCurrent = validity(silentS) === "current";
  const [asked, kg, where, likely] = question(cab, isCurrent);
  write("vehicle", cab.vehicle_id ?? "");
  sayBoth("not-seen", ["stood", stood(cab, silentS)], ["not-seen-what", notSeen(cab)]);
  write("light", lightText(cab, isCurrent));
  write("about", about(cab));
  write("question", asked);
  writeNumber(kg);
  say("where", where);
  const isAnswered = cab.room !== null;
  say("why", isAnswered ? "" : likely); // why there is no answer is no detail
  write("likely", isAnswered ? likely : "");
  element("rooms").replaceChildren(...cab.spare.map((spare) => pair(...spareText(spare))));
  say("alarms", alarmText(cab));
  element("tell").hidden = cab.load !== "standing";
  if (element("tell").hidden) say("told", "");
  write("aboard", aboard(cab, cab.age_s === null ? null : cab.age_s + silentS));
  write("last-event", eventText(cab.last_event));
  element("own").hidden = cab.own_readings.length === 0;
  element("own-readings").replaceChildren(...cab.own_readings.map((reading) => pair(...ownReading(reading, silentS))));
}

/** States what is aboard from the vehicle's present time on. Whoever knows nothing just drives. */
async function tell(source, kg) {
  try {
    await stateLoad((await load(LEARNING)).vehicle_time, source, kg);
    element("tell").reset();
    say("told", phrase("told"));
  } catch (error) {
    say("told", phrase("not_told", { why: error.message }));
  }
}

element("tell").addEventListener("submit", (event) => {
  event.preventDefault();
  tell(element("tell-source").value, typedNumber(element("tell-kg").value));
});
element("tell-empty").addEventListener("click", () => tell("empty"));

acceptToken(askNow);

element("panel").addEventListener("click", () => {
  element("details").open = !element("details").open; // the whole panel is easier to hit than one word
});

document.addEventListener("visibilitychange", () => {
  if (document.visibilityState !== "visible") return;
  draw(); // how old it is shows before the answer comes
  askNow();
});

fill(phrase);
acceptNumbers(phrase("number_hint", { example: numberText(310) }));
document.title = phrase("title");
askNow();
setInterval(askNow, ASK_EVERY_MS);
setInterval(draw, 1000);
stayAwake((how) => write("awake", phrase(how)));
