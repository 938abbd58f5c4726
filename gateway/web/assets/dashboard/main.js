// The dashboard: creates the views, then the feed that fills them.

import "./phrases.js"; // first: the others find its words in the page
import "./theme-button.js";
import "./fold.js";
import "./state-view.js";
import "./alarm-view.js";
import "./load-view.js";
import "./van-view.js";
import "./health-view.js";
import "./history-view.js";
import "./day-view.js";
import "./spectra-view.js";
import "./teach-view.js";

import { feed, lookBack } from "./feed.js";
import { download, setToken } from "./gateway.js";
import { element } from "./page.js";

element("token").addEventListener("submit", (event) => {
  event.preventDefault();
  setToken(element("token-text").value);
  location.reload();
});

element("export").addEventListener("click", (event) => {
  event.preventDefault();
  download(element("export").href, "springscale.csv");
});

element("span").addEventListener("change", (event) => lookBack(Number(event.target.value)));

feed();
