// The start of a served page: connects before the page is parsed, and draws the first image before it loads the client's
// script, so that neither the server nor the image waits for the page or the script.

import { byId, element } from "./dom.js";
import { drawFirstImage } from "./first.js";
import { foldPanels, spaceOf } from "./layout.js";
import { Connection, takeFragment } from "./transport/connection.js";

const LONGEST_WAIT = 300; // ms after which the client is loaded without an image

const { token, link } = takeFragment();
const connection = token ? new Connection(token) : null;
/** @type {any} */ (globalThis).raycamStart = { token, link, connection };

document.addEventListener("DOMContentLoaded", async () => {
  document.body.classList.add("live"); // shows the panels before the image's size is sent
  foldPanels(true);
  if (connection) {
    const canvas = byId("picture", HTMLCanvasElement);
    const drawn = drawFirstImage(connection.socket, canvas);
    await connection.greet(spaceOf(canvas), sessionStorage.getItem("raycam-session") || "");
    if (connection.isOpen) await Promise.race([drawn, new Promise((resolve) => setTimeout(resolve, LONGEST_WAIT))]);
  }
  document.body.append(element("script", "", { src: "client.js" }));
});
