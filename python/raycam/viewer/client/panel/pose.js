// The pose of the live view's camera: location, roll, pitch and yaw as numbers that can be edited.

import { byId, numbersOf } from "../dom.js";

/** @typedef {import("../client.js").Client} Client */
/** @typedef {{ location: number[], roll: number, pitch: number, yaw: number }} Pose metres and degrees */

const POSE_FIELDS = ["pose-x", "pose-y", "pose-z", "pose-roll", "pose-pitch", "pose-yaw"];
const POSE_DIGITS = 9;
const FARTHEST = 1e9, MOST_DEGREES = 1e4; // largest coordinate in metres and largest angle that the server accepts

export class PoseControls {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.inputs = POSE_FIELDS.map((id) => byId(id, HTMLInputElement));
    /** The values of the fields, with all digits and as shown: a field that the user did not change keeps all digits. */
    this.shown = POSE_FIELDS.map(() => ({ value: 0, text: "" }));
    this.inputs.forEach((input, i) => {
      const most = i < 3 ? FARTHEST : MOST_DEGREES;
      [input.min, input.max] = [String(-most), String(most)];
      input.addEventListener("change", () => this.tell());
    });
  }

  /** @param {Pose} pose */
  show({ location, roll, pitch, yaw }) {
    [...location, roll, pitch, yaw].forEach((value, i) => {
      const [input, text] = [this.inputs[i], String(Number(value.toPrecision(POSE_DIGITS)))];
      if (document.activeElement === input) return;
      input.value = text;
      this.shown[i] = { value, text };
    });
  }

  tell() {
    const typed = numbersOf(this.inputs, (text) => this.client.say(text, "error"));
    if (!typed) return;
    const exact = typed.map((value, i) => (this.inputs[i].value === this.shown[i].text ? this.shown[i].value : value));
    const [x, y, z, roll, pitch, yaw] = exact;
    this.client.transport.send({ type: "pose", location: [x, y, z], roll, pitch, yaw });
  }
}
