// The dashboard: creates the views, then the feed that fills them.

import "/assets/dashboard/phrases.js"; // first: the others find its words in the page
import "/assets/dashboard/theme-button.js";
import "/assets/dashboard/fold.js";
import "/assets/dashboard/state-view.js";
import "/assets/dashboard/alarm-view.js";
import "/assets/dashboard/load-view.js";
import "/assets/dashboard/van-view.js";
import "/assets/dashboard/health-view.js";
import "/assets/dashboard/history-view.js";
import "/assets/dashboard/day-view.js";
import "/assets/dashboard/spectra-view.js";
import "/assets/dashboard/known-weights-view.js";
import "/assets/dashboard/commissioning-view.js";
import "/assets/dashboard/verification-view.js";

import { feed, lookBack } from "/assets/dashboard/feed.js";
import { download, setToken } from "/assets/dashboard/gateway.js";
import { element } from "/assets/dashboard/page.js";

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
