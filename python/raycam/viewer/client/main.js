// Entry point of every page. A page with a saved image shows the image. A page that contains raycam as WebAssembly
// starts this script again in a worker, which renders. A page in a notebook cell connects to the kernel, and any other
// page to its server.

import { Client } from "./client.js";
import { bindCommands } from "./commands.js";
import { listenToDrops } from "./drop.js";
import { serve } from "./core/worker.js";
import { LIVE_MOUSE, LiveView } from "./live.js";
import { FrameTransport } from "./transport/frame.js";
import { Playground, playgroundOfPage } from "./core/playground.js";
import { GroupBar } from "./panel/groups.js";
import { RelightPanel } from "./panel/relight.js";
import { PageTransport } from "./transport/page.js";
import { SocketTransport } from "./transport/socket.js";
import { WorkerTransport } from "./transport/worker.js";

const PAGE_MOUSE =
  "Drag to pan; the wheel zooms to the cursor, and large pixels show their numbers. Click to hold a pixel; Alt and " +
  "click, or a long press, explains it. On a touch screen, use two fingers to zoom and to pan.";

/** @param {SocketTransport | FrameTransport | WorkerTransport} transport */
function openLive(transport) {
  document.body.classList.add("live"); // shows the panels before the size of the first image is sent
  const client = new Client(transport);
  const live = new LiveView(client);
  transport.size = () => live.size();
  client.onMessage = (message) => live.receive(message);
  client.controls.onDisplay = ({ exposure, view }) => transport.send({ type: "display", exposure, view: /** @type {import("./messages").Display["view"]} */ (view) });
  bindCommands(client, { commands: live.commands(), pointers: live.pointers(), mouse: LIVE_MOUSE });
  new GroupBar();
  client.open();
  if (!(transport instanceof WorkerTransport)) return listenToDrops(client, () => live.opens);
  document.body.classList.add("in-page");
  const page = playgroundOfPage();
  if (page) new Playground(transport, page.playground, page.types);
}

function openPage() {
  const page = new PageTransport();
  const client = new Client(page);
  bindCommands(client, { commands: {}, pointers: {}, mouse: PAGE_MOUSE });
  new RelightPanel(page, client);
  new GroupBar();
  client.open();
}

const space = () => ({ width: 640, height: 480, ratio: 1 });
if (typeof document === "undefined") serve(globalThis);
else if (WorkerTransport.isThere) openLive(new WorkerTransport(space));
else if (document.getElementById("document")) openPage();
else if (FrameTransport.isThere) openLive(new FrameTransport(space));
else openLive(new SocketTransport(space));
