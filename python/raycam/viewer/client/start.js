// The start of a served page: connects before it loads the client's script, so that the server already renders the
// first image.

import { byId, element } from "./dom.js";
import { foldPanels, spaceOf } from "./layout.js";
import { Connection, takeFragment } from "./transport/connection.js";

document.body.classList.add("live"); // shows the panels before the image's size is sent
foldPanels(true);
const { token, link } = takeFragment();
const session = sessionStorage.getItem("raycam-session") || "";
const connection = token ? new Connection(token, spaceOf(byId("picture", HTMLCanvasElement)), session) : null;
/** @type {any} */ (globalThis).raycamStart = { token, link, connection };
Promise.resolve(connection?.answered).then(() => document.body.append(element("script", "", { src: "client.js" })));
