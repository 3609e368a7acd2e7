// The pose of the live view's camera: location, roll, pitch and yaw as numbers to be changed.

import { byId } from "../dom.js";

/** @typedef {import("../client.js").Client} Client */
/** @typedef {{ location: number[], roll: number, pitch: number, yaw: number }} Pose metres and degrees */

const POSE_FIELDS = ["pose-x", "pose-y", "pose-z", "pose-roll", "pose-pitch", "pose-yaw"];
const POSE_DIGITS = 9;

export class PoseControls {
  /** @param {Client} client */
  constructor(client) {
    this.client = client;
    this.inputs = POSE_FIELDS.map((id) => byId(id, HTMLInputElement));
    for (const input of this.inputs) input.addEventListener("change", () => this.tell());
  }

  /** @param {Pose} pose */
  show({ location, roll, pitch, yaw }) {
    [...location, roll, pitch, yaw].forEach((value, i) => {
      const input = this.inputs[i];
      if (document.activeElement !== input) input.value = String(Number(value.toPrecision(POSE_DIGITS)));
    });
  }

  tell() {
    const values = this.inputs.map((input) => Number(input.value));
    if (this.inputs.some((input) => !input.value) || !values.every(Number.isFinite)) {
      return this.client.say("A pose has numbers in all of its fields.", "error");
    }
    const [x, y, z, roll, pitch, yaw] = values;
    this.client.transport.send({ type: "pose", location: [x, y, z], roll, pitch, yaw });
  }
}
