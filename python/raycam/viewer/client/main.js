// The start: a page that carries a frame shows it; one in a cell asks the kernel, another one the server it came from.

import { Client } from "./client.js";
import { bindCommands } from "./commands.js";
import { LIVE_MOUSE, LiveView } from "./live.js";
import { FrameTransport } from "./transport_frame.js";
import { PageTransport } from "./transport_page.js";
import { SocketTransport } from "./transport_socket.js";

const PAGE_MOUSE =
  "Drag pans, the wheel zooms to the cursor; far enough in, every pixel shows its numbers. A click holds a pixel, " +
  "Alt and click or a long press explains it. On a touch screen two fingers zoom and pan.";

const page = new PageTransport();
if (page.isThere) {
  const client = new Client(page);
  bindCommands(client, { commands: {}, pointers: {}, mouse: PAGE_MOUSE });
  client.open();
} else {
  const transport = new (FrameTransport.isThere ? FrameTransport : SocketTransport)(() => live.size());
  const client = new Client(transport);
  const live = new LiveView(client);
  client.onMessage = (message) => live.receive(message);
  client.controls.onDisplay = ({ exposure, view }) => transport.send({ type: "display", exposure, view });
  bindCommands(client, { commands: live.commands(), pointers: live.pointers(), mouse: LIVE_MOUSE });
  client.open();
}
