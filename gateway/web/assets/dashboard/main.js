// The dashboard: what a dispatcher asks. Creates the views, then the feed that fills them.

import "./phrases.js"; // first: the others find its words in the page
import "./fold.js";
import "./state-view.js";
import "./alarm-view.js";
import "./load-view.js";
import "./van-view.js";
import "./history-view.js";
import "./day-view.js";
import "./teach-view.js";

import { feed, lookBack } from "./feed.js";
import { ask } from "./gateway.js";
import { element } from "./page.js";

/** Saves what is at `path` as a file. A link cannot carry the token; a question can. */
async function download(path, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(await (await ask(path)).blob());
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}

element("export").addEventListener("click", (event) => {
  event.preventDefault();
  download(element("export").href, "springscale.csv");
});

element("span").addEventListener("change", (event) => lookBack(Number(event.target.value)));

feed();
