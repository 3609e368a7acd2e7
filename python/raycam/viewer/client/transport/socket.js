// The transport of the live view: a WebSocket to the server from which the page was loaded. It reconnects automatically.

import { Connection, splitMessage } from "./connection.js";
import { completed } from "./message.js";

/** @typedef {Record<string, any> & { type: string }} Message */

const FIRST_RETRY = 250; // milliseconds until the first attempt to reconnect
const LAST_RETRY = 4000;
const TOO_MANY = 1013;
const MISBEHAVED = 1008;
/** Types of messages that may be dropped while the socket is closed: they are sent again after a welcome or when needed. */
const DROPPABLE = ["hello", "ack", "probe", "size", "visible", "display", "channel", "panes"];
const NOT_SAID = "No connection to the server, so the command was not executed. The page reconnects automatically.";
const OTHER_TOKEN =
  "The live view at this address was restarted and no longer accepts this page; open the address that it printed. The last " +
  "image and its values are still shown.";
const NEW_SESSION = "The server was restarted: this new session begins with the initial world, camera and exposure. Saved files are kept.";

export class SocketTransport {
  /** @param {() => { width: number, height: number, ratio: number }} size of the space for the image */
  constructor(size) {
    this.live = true;
    this.size = size;
    /** @type {import("./connection.js").LiveStart} the connection that the page has opened (start.js) */
    const { token, link, connection } = /** @type {any} */ (globalThis).raycamStart;
    this.token = token;
    /** @type {Connection | null} */
    this.connection = connection;
    /** The text of the link that this page was opened with, until the link's view is shown. */
    this.link = link;
    // If another address with the same port is opened in this tab, only the fragment changes.
    addEventListener("hashchange", () => location.hash && location.reload());
    this.session = "";
    this.version = "";
    this.retry = FIRST_RETRY;
    this.closing = false;
    /** True from the first failed attempt until the next welcome. */
    this.told = false;
    /** Messages are decoded one after the other, so that images keep their order. */
    this.decoding = Promise.resolve();
  }

  /** @param {(message: Message) => void} say */
  open(say) {
    this.say = say;
    if (this.connection) this.listen(this.connection);
    else say({ type: "error", text: "The token is missing in this address: open the complete address that raycam printed." });
  }

  /** @param {string} text of a link @returns {string} the address that shows the same view in another browser */
  addressOf(text) {
    return `${location.origin}${location.pathname}#t=${this.token}&v=${text}`;
  }

  connect() {
    this.connection = new Connection(String(this.token));
    this.connection.greet(this.size(), this.session || sessionStorage.getItem("raycam-session") || "");
    this.listen(this.connection);
  }

  /** @param {Connection} connection */
  listen(connection) {
    let opened = false;
    connection.listen((/** @type {any} */ { type, data, code, reason }) => {
      if (type === "open") opened = true;
      else if (type === "message") {
        this.decoding = this.decoding.then(() => this.receive(data)).catch((error) => {
          this.say?.({ type: "error", text: `Damaged message from the server: ${error}` });
        });
      } else {
        this.closed(code, reason);
        if (!opened) this.askWhy();
      }
    });
  }

  /** Reports, once, that a server answers but refuses this page. */
  async askWhy() {
    if (this.told) return;
    const answers = await fetch("client.js", { method: "GET", cache: "no-store" }).then(({ ok }) => ok, () => false);
    if (!answers || this.told || this.connection?.isOpen) return;
    this.told = true;
    this.say?.({ type: "error", text: OTHER_TOKEN });
  }

  /**
   * @param {number} code
   * @param {string} reason
   */
  closed(code, reason) {
    this.connection = null;
    if (code === TOO_MANY || code === MISBEHAVED || this.closing) {
      this.say?.({ type: "status", text: "disconnected" });
      this.say?.({ type: "error", text: reason || "The server has stopped. The last image and its values are still shown." });
      return;
    }
    this.say?.({ type: "status", text: "disconnected, trying again" });
    setTimeout(() => this.connect(), this.retry);
    this.retry = Math.min(2 * this.retry, LAST_RETRY);
  }

  /** @param {import("../messages").ClientMessage} message */
  send(message) {
    if (this.connection?.isOpen) this.connection.send(message);
    else if (!DROPPABLE.includes(message.type)) this.say?.({ type: "notice", text: NOT_SAID });
  }

  /** @param {ArrayBuffer} data */
  async receive(data) {
    const { message, buffers } = splitMessage(data);
    if (message.type === "welcome") this.welcomed(message);
    if (message.type === "closing") this.closing = true;
    if (message.type === "token") return sessionStorage.setItem("raycam-token", (this.token = message.token));
    await completed(message, buffers);
    this.say?.(message);
    if (message.type === "picture" || message.type === "pane") this.send({ type: "ack", picture: message.picture });
  }

  /** @param {Message} message */
  welcomed(message) {
    if (this.version && this.version !== message.version) location.reload();
    message.resumed = this.session === message.session;
    if (this.session && !message.resumed) this.say?.({ type: "notice", text: NEW_SESSION });
    this.version = message.version;
    this.session = message.session;
    sessionStorage.setItem("raycam-session", message.session); // stored so that a reload of this tab continues the session
    this.retry = FIRST_RETRY;
    this.told = false;
    this.say?.({ type: "status", text: "connected" });
  }
}
