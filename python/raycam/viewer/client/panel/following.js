// Following: followers show the leader's view, and can switch to a view of their own.

import { byId } from "../dom.js";

/** @typedef {import("../client.js").Client} Client */
/** @typedef {import("../client.js").Message} Message */

const ROLE_TEXTS = {
  attached: "You follow the leader.",
  free: "You look around independently of the leader.",
  blocked: "You follow the leader: press Look around to move freely.",
  world: "Only the leader can do this.",
};
const QUIET = ["select", "display", "forget", "overlay", "planes", "pick", "scan"]; // messages that the page sends without an action of the user
const REMINDER_PAUSE = 3000; // minimum milliseconds between two reminders

export class FollowingControls {
  /** @param {Client} client @param {(camera: Message) => void} showCamera */
  constructor(client, showCamera) {
    this.client = client;
    this.showCamera = showCamera;
    /** @type {Message | null} null if this view has no leader */
    this.role = null;
    /** The leader's channel, display, time and held pixel. @type {Message | null} */
    this.display = null;
    /** @type {Message | null} the server's newest camera */
    this.camera = null;
    /** Called with the leader's time. @type {(time: number) => void} */
    this.onTime = () => {};
    this.isShowing = false;
    /** True from a connection until the leader's display is received; in this time, the page sends its own settings. */
    this.isStarting = true;
    this.reminded = -Infinity;
    this.bar = byId("following", HTMLElement);
    this.text = byId("following-text", HTMLElement);
    this.button = byId("following-button", HTMLButtonElement);
    this.lead = byId("following-lead", HTMLButtonElement);
    const send = client.transport.send.bind(client.transport);
    client.transport.send = (message) => {
      if (this.allows(message)) send(message);
    };
    this.button.addEventListener("click", () => {
      if (this.role?.leads) this.copyAddress();
      else send({ type: "follow", mode: this.role?.attached ? "detach" : "attach" });
    });
    this.lead.addEventListener("click", () => send({ type: "follow", mode: "lead" }));
    client.onHold = (pixel) => {
      if (this.role?.leads) send({ type: "hold", pixel: pixel ? [pixel.column, pixel.row] : [] });
    };
  }

  /** @param {Message} message */
  receive(message) {
    if (message.type === "following") this.showRole(message);
    if (message.type === "status" && message.text !== "connected") this.isStarting = true;
    if (message.type === "welcome") this.camera = message.camera;
    if (message.type === "camera") this.camera = message;
    if (message.type === "display") this.showDisplay((this.display = message));
  }

  /** @param {Message} role */
  showRole(role) {
    this.role = role;
    this.bar.hidden = false;
    const count = `${role.followers} ${role.followers === 1 ? "follower" : "followers"}`;
    this.text.textContent = role.leads ? `You lead ${count}.` : ROLE_TEXTS[role.attached ? "attached" : "free"];
    this.button.textContent = role.leads ? "Copy address" : role.attached ? "Look around" : "Follow";
    this.button.title = role.leads ? "Copy the address for followers" : role.attached ? "Move the camera yourself" : "Show the leader's view again";
    this.lead.hidden = role.leads || !role.may_lead;
  }

  /** Shows the leader's channel, display, time and held pixel. @param {Message} display */
  showDisplay({ channel, exposure, view, time, held }) {
    const { client } = this;
    this.isShowing = true;
    if (client.channels.includes(channel)) {
      client.channel = channel;
      byId("channel", HTMLSelectElement).value = channel;
    }
    client.controls.setExposure(exposure);
    client.controls.setView(view);
    this.onTime(time);
    this.isStarting = false;
    const pixel = held ? { column: held[0], row: held[1] } : null;
    if (String(held) !== String(client.held && [client.held.column, client.held.row])) client.hold(pixel);
    this.isShowing = false;
  }

  /** @param {import("../messages").ClientMessage} message @returns {boolean} true if this client may send it */
  allows({ type }) {
    if (!this.role?.blocked.includes(type)) return true;
    if (this.isShowing || this.isStarting || QUIET.includes(type)) return false;
    setTimeout(() => this.restore());
    if (performance.now() - this.reminded > REMINDER_PAUSE) {
      this.reminded = performance.now();
      this.client.say(this.role.attached ? ROLE_TEXTS.blocked : ROLE_TEXTS.world, "notice");
    }
    return false;
  }

  /** Shows the leader's view again, after a gesture that had no effect. */
  restore() {
    if (!this.role?.attached) return;
    if (this.camera) this.showCamera(this.camera);
    if (this.display) this.showDisplay(this.display);
  }

  async copyAddress() {
    const address = `${location.origin}${location.pathname}#t=${this.role?.token}`;
    try {
      await navigator.clipboard.writeText(address);
      this.client.say("Copied the address for followers.", "notice");
    } catch {
      this.client.say(address, "notice");
    }
  }
}
