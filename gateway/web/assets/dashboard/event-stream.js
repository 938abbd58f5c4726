// Server-sent events over fetch: unlike EventSource it can send a token, and it says why a connection failed.

import { ask } from "./gateway.js";

const FIRST_PAUSE_MS = 1000; // chosen: doubles up to the last
const LAST_PAUSE_MS = 30000; // chosen: how late a gateway that came back is noticed

/** Calls `onEvent(kind, record)` for each event and `onLink(isLive)` when the connection comes or goes; never ends. */
export async function follow(url, lastEventId, onEvent, onLink) {
  let cursor = lastEventId;
  let pauseMs = FIRST_PAUSE_MS;
  for (;;) {
    try {
      const response = await ask(url, cursor ? { "Last-Event-ID": cursor } : {});
      onLink(true);
      pauseMs = FIRST_PAUSE_MS;
      for await (const event of parsed(response.body)) {
        cursor = event.id ?? cursor;
        if (event.data) onEvent(event.kind, JSON.parse(event.data));
      }
    } catch (error) {
      console.info(`stream: ${error.message}`);
    }
    onLink(false);
    await new Promise((resolve) => setTimeout(resolve, pauseMs));
    pauseMs = Math.min(2 * pauseMs, LAST_PAUSE_MS);
  }
}

async function* parsed(body) {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let pending = "";
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    const blocks = (pending + value).split("\n\n");
    pending = blocks.pop();
    for (const block of blocks) yield fields(block);
  }
}

function fields(block) {
  const event = { kind: "message", data: "", id: undefined };
  for (const line of block.split("\n")) {
    const [, name, text] = /^([a-z]*): ?(.*)$/.exec(line) ?? [];
    if (name === "event") event.kind = text;
    if (name === "data") event.data += text;
    if (name === "id") event.id = text;
  }
  return event;
}
