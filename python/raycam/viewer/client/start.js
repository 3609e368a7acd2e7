// The start of a served page: connects and draws the first image before it loads the client's script, so that neither
// the server nor the image waits for the script.

import { byId, element } from "./dom.js";
import { drawFirstImage } from "./first.js";
import { foldPanels, spaceOf } from "./layout.js";
import { Connection, takeFragment } from "./transport/connection.js";

const LONGEST_WAIT = 300; // ms after which the client is loaded without an image

document.body.classList.add("live"); // shows the panels before the image's size is sent
foldPanels(true);
const { token, link } = takeFragment();
const session = sessionStorage.getItem("raycam-session") || "";
const canvas = byId("picture", HTMLCanvasElement);
const connection = token ? new Connection(token, spaceOf(canvas), session) : null;
/** @type {any} */ (globalThis).raycamStart = { token, link, connection };
const drawn = connection && drawFirstImage(connection.socket, canvas);
Promise.resolve(connection?.answered)
  .then(() => connection?.isOpen && Promise.race([drawn, new Promise((resolve) => setTimeout(resolve, LONGEST_WAIT))]))
  .then(() => document.body.append(element("script", "", { src: "client.js" })));
