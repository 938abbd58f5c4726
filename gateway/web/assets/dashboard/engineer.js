// The engineer's page: why batches were refused, sensors, bus and calibration.

import "./phrases.js"; // first: the others find its words in the page
import "./fold.js";
import "./state-view.js";
import "./alarm-view.js";
import "./health-view.js";

import { feed } from "./feed.js";

feed();
