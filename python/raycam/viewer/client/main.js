// The start: a page that carries a frame shows it; another one asks the server it came from.

import { Client } from "./client.js";
import { bindCommands } from "./commands.js";
import { PageTransport } from "./transport_page.js";

const PAGE_MOUSE =
  "Drag pans, the wheel zooms to the cursor; far enough in, every pixel shows its numbers. A click holds a pixel, " +
  "Alt and click or a long press explains it. On a touch screen two fingers zoom and pan.";

const page = new PageTransport();
if (page.isThere) {
  const client = new Client(page);
  bindCommands(client, { commands: {}, pointers: {}, mouse: PAGE_MOUSE });
  client.open();
}
