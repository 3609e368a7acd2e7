// The navigator: converts gestures to the next camera pose, and sends this pose. The navigator's camera is newer than the server's.

import { dolly, fit, lookAround, move, orbit, pan, roll, walk } from "./navigation.js";
import { lengthOf, minus, plusTimes, rowOf } from "./core/vectors.js";

/** @typedef {import("./navigation.js").CameraState} CameraState */
/** @typedef {import("./messages").ClientMessage} ClientMessage */
/** @typedef {{ origin: number[] | null, direction: number[] | null, point: number[] | null, bounds: number[][] | null }} Located */

const ORBIT_PER_PIXEL = (0.35 * Math.PI) / 180;
export const DOLLY_STEP = 1.15; // the zoom factor of one notch of the wheel
const MAX_NOTCHES = 20;

export class Navigator {
  /**
   * @param {(message: ClientMessage) => void} send
   * @param {() => number} imageNumber returns the number of the image that is shown
   */
  constructor(send, imageNumber) {
    this.send = send;
    this.imageNumber = imageNumber;
    /** @type {CameraState | null} */
    this.camera = null;
    this.seq = 0;
    this.questions = 0;
    /** @type {Map<number, (answer: any) => void>} */
    this.waiting = new Map();
    /** The point that the wheel zooms to, while the pointer does not move. @type {{ u: number, v: number, notches: number, point: number[] | null } | null} */
    this.target = null;
    /** Walking steps that wait for the server's answer about the ground. @type {number[] | null} */
    this.steps = null;
    /** Called when the camera moved. */
    this.onMove = () => {};
    /** Called with each new camera. @type {(camera: CameraState) => void} */
    this.onCamera = () => {};
  }

  /**
   * Starts with the camera of a session, and stops waiting for answers of an older connection.
   * @param {CameraState & { seq: number }} state
   */
  welcome(state) {
    this.waiting.clear();
    this.target = this.steps = null;
    this.seq = state.seq;
    this.receive(state);
  }

  /**
   * Takes over the server's camera, unless a newer move was already sent.
   * @param {CameraState & { seq: number }} state
   */
  receive(state) {
    if (state.seq < this.seq) return;
    this.camera = state;
    this.onCamera(state);
  }

  /** @param {{ id: number }} answer */
  answer(answer) {
    this.waiting.get(answer.id)?.(answer);
    this.waiting.delete(answer.id);
  }

  /** @param {import("./messages").Locate | import("./messages").Ground} question @returns {Promise<any>} */
  ask(question) {
    return new Promise((resolve) => {
      this.waiting.set(question.id, resolve);
      this.send(question);
    });
  }

  /**
   * Moves to a camera, and sends it.
   * @param {CameraState | null} camera
   */
  go(camera) {
    if (!camera || ![...camera.R, ...camera.C, ...camera.K].every(Number.isFinite)) return;
    this.camera = camera;
    this.onCamera(camera);
    const { R, C, K, pivot } = camera;
    this.send({ type: "move", seq: ++this.seq, R, C, fx: K[0], pivot });
    this.onMove();
  }

  /**
   * Moves by a gesture that depends on the camera only.
   * @param {(camera: CameraState) => CameraState} gesture
   */
  change(gesture) {
    if (!this.camera) return;
    this.target = null;
    this.go(gesture(this.camera));
  }

  /** Length of a step, metres: a share of the world's size. */
  get step() {
    return this.camera ? lengthOf(minus(this.camera.bounds[1], this.camera.bounds[0])) / 100 : 0;
  }

  /** @param {number} dx pixels @param {number} dy */
  orbit(dx, dy) {
    this.change((camera) => orbit(camera, -dx * ORBIT_PER_PIXEL, -dy * ORBIT_PER_PIXEL));
  }

  /** @param {number} dx pixels @param {number} dy */
  look(dx, dy) {
    this.change((camera) => lookAround(camera, -dx * ORBIT_PER_PIXEL, -dy * ORBIT_PER_PIXEL));
  }

  /** @param {number} dx pixels of the image @param {number} dy */
  pan(dx, dy) {
    this.change((camera) => pan(camera, dx, dy));
  }

  /** @param {number} degrees */
  roll(degrees) {
    this.change((camera) => roll(camera, (degrees * Math.PI) / 180));
  }

  /** Flies. @param {number} right steps @param {number} upwards @param {number} forward */
  fly(right, upwards, forward) {
    const { step } = this;
    this.change((camera) => move(camera, right * step, upwards * step, forward * step));
  }

  /**
   * Walks on the ground: the camera's height above the ground stays the same. Steps add up while the server looks for the ground.
   * @param {number} right steps @param {number} upwards @param {number} forward
   */
  async walk(right, upwards, forward) {
    if (this.steps) {
      this.steps = this.steps.map((value, i) => value + [right, upwards, forward][i]);
      return;
    }
    const begin = this.camera;
    if (!begin) return;
    this.target = null;
    this.steps = [0, 0, 0];
    const { step } = this;
    const level = walk(begin, right * step, forward * step);
    const answer = await this.ask({ type: "ground", id: ++this.questions, begin: begin.C, end: level.C, foot: step / 2 });
    const [before, after] = answer.below;
    const change = before === null || after === null ? 0 : before - after;
    this.go({ ...level, C: plusTimes(level.C, upwards * step + change, level.up) });
    const [x, y, z] = this.steps || [0, 0, 0];
    this.steps = null;
    if (x || y || z) this.walk(x, y, z);
  }

  /** @param {number} u @param {number} v @returns {Promise<Located>} */
  locate(u, v) {
    return this.ask({ type: "locate", id: ++this.questions, image: this.imageNumber(), u, v });
  }

  /**
   * Moves towards the point under the pointer. If there is none, moves along the pixel's ray, as if a point were there at the pivot's distance.
   * @param {number} notches @param {number} u @param {number} v
   */
  async dolly(notches, u, v) {
    const target = this.target;
    if (target && target.u === u && target.v === v) {
      if (target.point) this.approach(target.point, notches);
      else target.notches += notches;
      return;
    }
    const found = (this.target = { u, v, notches, point: /** @type {number[] | null} */ (null) });
    const { origin, direction, point } = await this.locate(u, v);
    if (!this.camera) return;
    const { C, R, pivot, parallel } = this.camera;
    found.point = point || (parallel && origin ? origin : plusTimes(origin || C, lengthOf(minus(pivot, C)), direction || rowOf(R, 2)));
    this.approach(found.point, found.notches);
  }

  /** @param {number[]} point @param {number} notches */
  approach(point, notches) {
    if (this.camera) this.go(dolly(this.camera, point, DOLLY_STEP ** Math.max(-MAX_NOTCHES, Math.min(MAX_NOTCHES, notches))));
  }

  /** Puts the pivot at the surface point under the pointer, if the pointer is over a surface. @param {number} u @param {number} v */
  async setPivot(u, v) {
    const { point } = await this.locate(u, v);
    if (point) this.change((camera) => ({ ...camera, pivot: point }));
  }

  /** Frames the whole world. */
  fit() {
    this.change((camera) => fit(camera, camera.bounds));
  }

  /** Frames the object at a point of the image, or the whole world if no object is there. @param {number} u @param {number} v */
  async frame(u, v) {
    const { bounds } = await this.locate(u, v);
    this.change((camera) => fit(camera, bounds || camera.bounds));
  }

  /** Looks through a camera of the world, or continues with a free camera if the name is empty. @param {string} name */
  lookThrough(name) {
    this.target = null;
    this.send({ type: "camera", seq: ++this.seq, name });
  }

  /** Returns to the first camera. */
  home() {
    this.target = null;
    this.send({ type: "home", seq: ++this.seq });
  }
}
