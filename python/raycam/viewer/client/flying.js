// Ways to move the camera: orbiting, and flying or walking while keys are down.

/** @typedef {import("./navigator.js").Navigator} Navigator */

const FLY_STEP = 1; // length of a step, in hundredths of the world's size
const FAST = 4, SPEED_NOTCH = 1.25, SLOWEST = 1 / 64, FASTEST = 64; // factors of the step's length
const FLY_TICK = 50; // milliseconds between two steps while a key is down
const FLY_KEYS = /** @type {Record<string, number[]>} */ ({
  KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0],
});

/** Ways to move, in the order in which the key N selects them, with the texts that explain them. */
const WAYS = /** @type {Record<string, string>} */ ({
  orbit: "Orbit: drag to turn around the pivot.",
  fly: "Fly: W, A, S and D move the camera, E and Q raise and lower it. Drag to look around, hold Shift to move fast, turn the wheel to change the speed.",
  walk: "Walk: W, A, S and D move along the ground, E and Q raise and lower the camera. Drag to look around, hold Shift to move fast, turn the wheel to change the speed.",
});

export class Flying {
  /** @param {Navigator} navigator */
  constructor(navigator) {
    this.navigator = navigator;
    this.way = "orbit";
    this.speed = 1;
    this.fast = false;
    /** @type {Set<string>} codes of the keys that are down */
    this.down = new Set();
    this.timer = 0;
    document.addEventListener("keydown", (event) => this.pressed(event), true);
    document.addEventListener("keyup", (event) => {
      this.down.delete(event.code);
      this.fast = event.shiftKey;
    });
    addEventListener("blur", () => this.down.clear());
  }

  /** Selects the next way to move. @returns {string} the text that explains it */
  nextWay() {
    const ways = Object.keys(WAYS);
    this.way = ways[(ways.indexOf(this.way) + 1) % ways.length];
    return WAYS[this.way];
  }

  /** @param {number} steps of the wheel @returns {string} the text that reports the speed */
  changeSpeed(steps) {
    this.speed = Math.min(Math.max(this.speed * SPEED_NOTCH ** steps, SLOWEST), FASTEST);
    return `Speed: ${this.speed.toPrecision(2)} times.`;
  }

  /** @param {KeyboardEvent} event */
  pressed(event) {
    this.fast = event.shiftKey;
    if (this.way === "orbit" || event.ctrlKey || event.metaKey || event.altKey || !(event.code in FLY_KEYS)) return;
    if (/** @type {HTMLElement} */ (event.target).id !== "picture") return;
    event.preventDefault();
    event.stopPropagation();
    this.down.add(event.code);
    if (this.timer) return;
    this.timer = setInterval(() => this.fly(), FLY_TICK);
    this.fly(); // the first step is immediate, so that a short press is one step
  }

  fly() {
    const steps = [0, 0, 0];
    const pace = FLY_STEP * this.speed * (this.fast ? FAST : 1);
    for (const code of this.down) FLY_KEYS[code].forEach((step, axis) => (steps[axis] += step * pace));
    const [right, upwards, forward] = steps;
    if (this.down.size && this.way === "walk") this.navigator.walk(right, upwards, forward);
    else if (this.down.size) this.navigator.fly(right, upwards, forward);
    else {
      clearInterval(this.timer);
      this.timer = 0;
    }
  }

  /** Orbits, or looks around while flying and walking. @param {number} dx pixels @param {number} dy */
  turn(dx, dy) {
    this.navigator[this.way === "orbit" ? "orbit" : "look"](dx, dy);
  }
}
