// The transport in a notebook: the page is a frame in a cell. The notebook's page forwards messages to the kernel.

import { completed } from "./message.js";

/** @typedef {Record<string, any> & { type: string }} Message */

export class FrameTransport {
  /** @param {() => { width: number, height: number, ratio: number }} size of the space for the image */
  constructor(size) {
    this.live = true;
    this.size = size;
    /** Messages are decoded one after the other, so that images keep their order. */
    this.decoding = Promise.resolve();
  }

  /** True if the page was created for a notebook cell. */
  static get isThere() {
    return document.getElementById("in-a-cell") !== null;
  }

  /** @param {(message: Message) => void} say */
  open(say) {
    addEventListener("message", ({ source, data }) => {
      if (source !== parent) return;
      this.decoding = this.decoding.then(() => this.receive(data, say)).catch((error) => {
        say({ type: "error", text: `A message of the kernel is damaged: ${error}` });
      });
    });
    this.send({ type: "hello", ...this.size(), session: "" });
  }

  /** @param {import("../messages").ClientMessage} message */
  send(message) {
    parent.postMessage(JSON.stringify(message), "*");
  }

  /**
   * @param {{ message: Message, buffers: Uint8Array<ArrayBuffer>[] }} data
   * @param {(message: Message) => void} say
   */
  async receive({ message, buffers }, say) {
    say(await completed(message, buffers));
    if (message.type === "picture" || message.type === "pane") this.send({ type: "ack", picture: message.picture });
  }
}
