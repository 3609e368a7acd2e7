// The WebSocket of the live view. The socket is opened before the client's script is loaded, so received events are
// stored until the client listens.

const PROTOCOL = "raycam.view.1";

/** @typedef {{ width: number, height: number, ratio: number }} Space */
/** @typedef {{ token: string | null, link: string | null, connection: Connection | null }} LiveStart */

/**
 * Removes the token from the address, where others could read it, and keeps the token for reloads of this tab.
 * @returns {{ token: string | null, link: string | null }} the token, and the text of a link (link.js)
 */
export function takeFragment() {
  const fragment = new URLSearchParams(location.hash.slice(1));
  const given = fragment.get("t");
  if (given) {
    history.replaceState(null, "", location.pathname);
    sessionStorage.setItem("raycam-token", given);
  }
  return { token: given || sessionStorage.getItem("raycam-token"), link: fragment.get("v") };
}

/**
 * Splits a binary message into its header, which is JSON, and its buffers.
 * @param {ArrayBuffer} data
 * @returns {{ message: Record<string, any> & { type: string }, buffers: Uint8Array<ArrayBuffer>[] }}
 */
export function splitMessage(data) {
  const length = new DataView(data).getUint32(0, true);
  const message = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  let at = 4 + length + ((4 - (length % 4)) % 4);
  const buffers = message.buffers.map((/** @type {number} */ size) => new Uint8Array(data, (at += size) - size, size));
  return { message, buffers };
}

export class Connection {
  /**
   * Opens the socket. The caller must then call `greet`.
   * @param {string} token
   */
  constructor(token) {
    const address = new URL("socket", location.href);
    address.protocol = address.protocol.replace("http", "ws");
    this.socket = new WebSocket(address, [PROTOCOL, `token.${token}`]);
    this.socket.binaryType = "arraybuffer";
    /** @type {Event[]} */
    this.kept = [];
    /** @type {(event: Event) => void} */
    this.listener = (event) => {
      this.kept.push(event);
    };
    /** Resolved when the server has opened or refused the socket. @type {Promise<void>} */
    this.answered = new Promise((resolve) => {
      for (const type of ["open", "close"]) this.socket.addEventListener(type, () => resolve());
    });
    for (const type of ["open", "message", "close"]) this.socket.addEventListener(type, (event) => this.listener(event));
  }

  /**
   * Sends the message `hello` as soon as the socket is open.
   * @param {Space} space for the image
   * @param {string} session the session to continue, or ""
   */
  async greet(space, session) {
    await this.answered;
    if (this.isOpen) this.send({ type: "hello", ...space, session });
  }

  /** Passes the events `open`, `message` and `close` to a listener, beginning with those that have arrived. @param {(event: Event) => void} listener */
  listen(listener) {
    this.listener = listener;
    for (const event of this.kept.splice(0)) listener(event);
  }

  get isOpen() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  /** @param {import("../messages").ClientMessage} message */
  send(message) {
    this.socket.send(JSON.stringify(message));
  }
}
