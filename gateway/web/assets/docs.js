"use strict";

const base = new URL(".", document.baseURI).pathname.slice(0, -1); // not empty below the path of a proxy

fetch("openapi.json").then((answer) => answer.json()).then((spec) => SwaggerUIBundle({
  spec: { ...spec, servers: [{ url: base || "/" }] },
  dom_id: "#swagger-ui",
  deepLinking: true,
  validatorUrl: null, // nothing leaves the vehicle
}));
