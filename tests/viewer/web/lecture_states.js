// Sets a figure of the lecture to given states and returns the texts that it shows: its modules run as in the page, with
// elements and canvases that only store the values passed to them.

class Box {
  constructor(tag) {
    Object.assign(this, { tag, children: [], attributes: {}, dataset: {}, listeners: {}, own: "", value: "", clientWidth: 640, clientHeight: 400 });
    this.style = { setProperty() {} };
    this.classList = { add() {}, remove() {}, toggle() {} };
  }
  adopt(parts) { for (const part of parts) if (part instanceof Box) part.parentElement = this; return parts; }
  append(...parts) { this.children.push(...this.adopt(parts)); }
  prepend(...parts) { this.children.unshift(...this.adopt(parts)); }
  replaceChildren(...parts) { this.children = this.adopt(parts); }
  insertBefore(part) { this.children.push(...this.adopt([part])); }
  setAttribute(name, value) { this.attributes[name] = value; }
  addEventListener(kind, act) { (this.listeners[kind] ||= []).push(act); }
  say(kind, event = {}) { for (const act of this.listeners[kind] || []) act(event); }
  getContext() { return CTX; }
  set textContent(text) { [this.own, this.children] = [text, []]; }
  get textContent() { return this.children.length ? this.children.map((part) => (part instanceof Box ? part.textContent : part)).join("") : this.own; }
  get valueAsNumber() { return Number(this.value); }
  all(tag) { return this.children.flatMap((part) => (part instanceof Box ? [...(part.tag === tag ? [part] : []), ...part.all(tag)] : [])); }
}

const ANSWERS = { measureText: (text) => ({ width: 7.5 * text.length }), createRadialGradient: () => ({ addColorStop() {} }) };
const CTX = new Proxy({}, { get: (_, name) => ANSWERS[name] || (() => {}), set: () => true });
globalThis.document = { createElement: (tag) => new Box(tag), documentElement: { dataset: {} } };
globalThis.getComputedStyle = () => ({ getPropertyValue: () => "black", fontFamily: "" });
globalThis.matchMedia = () => ({ matches: true });
globalThis.requestAnimationFrame = (act) => act();
globalThis.devicePixelRatio = 1;
globalThis.IntersectionObserver = globalThis.ResizeObserver = class { observe() {} };

/** A replacement for `Pictures` without the core: `answers[key]` calls the receivers of the images that a figure requests with this key. */
function picturesOf(answers) {
  const asked = {};
  return {
    request(key, wanted, receivers) {
      const text = JSON.stringify(wanted);
      if (asked[key] === text) return;
      asked[key] = text;
      answers[key]?.(receivers, wanted);
    },
  };
}

/** The texts of a figure in each state: { numbers, sliders: shares of their ranges, choices, clicks }. */
function textsOf(name, states, answers = {}) {
  const shared = new Shared();
  shared.point = () => {};
  const host = new Box("figure");
  host.dataset.figure = name;
  const fig = new Figure(host, shared, picturesOf(answers));
  FIGURES[name](fig);
  const inputs = host.all("input");
  const groups = host.all("div").filter(({ attributes }) => attributes.role === "group").map((group) => group.children.filter(({ tag }) => tag === "button"));
  const buttons = host.all("button");
  return states.map(({ numbers, sliders, choices = [], clicks = {} }) => {
    fig.isVisible = false;
    Object.assign(shared.numbers, structuredClone(numbers));
    shared.changed();
    const values = inputs.map((input, i) => {
      const { min, max, step } = Object.fromEntries(Object.entries(input.attributes).map(([key, value]) => [key, Number(value)]));
      const steps = Math.round((sliders[i] * (max - min)) / step);
      input.value = String(Number((min + step * steps).toFixed(6)));
      input.say("input");
      return input.valueAsNumber;
    });
    choices.forEach((choice, i) => groups[i][choice].say("click"));
    for (const [text, count] of Object.entries(clicks)) for (let i = 0; i < count; i++) buttons.find((button) => button.textContent === text).say("click");
    fig.isVisible = true;
    fig.update();
    return {
      numbers: structuredClone(shared.numbers), values,
      outputs: host.all("output").map(({ textContent }) => textContent),
      lines: host.all("div").filter(({ attributes }) => attributes.class === "readout").flatMap(({ children }) => children.map(({ textContent }) => textContent)),
      tables: host.all("table").map((table) => table.all("td").map(({ textContent }) => textContent)),
      labels: host.all("canvas").map(({ dataset }) => JSON.parse(dataset.labels)),
    };
  });
}

/** The lines of the crossings' figure after each list of keys, pressed with Shift; `button` is clicked at the end. */
function crossingTexts(moves, button = "") {
  const shared = new Shared();
  const host = new Box("figure");
  const fig = new Figure(host, shared, picturesOf({}));
  FIGURES.crossings(fig);
  fig.isVisible = true;
  const [canvas] = host.all("canvas");
  return moves.map((keys) => {
    for (const key of keys) canvas.say("keydown", { key, shiftKey: true, preventDefault() {} });
    if (button) host.all("button").find(({ textContent }) => textContent === button).say("click");
    fig.update();
    return host.all("div").find(({ attributes }) => attributes.class === "readout").children.map(({ textContent }) => textContent);
  });
}

/** The points that Enter selects in each canvas of a figure, and whether an arrow key moves them; `button` is clicked first. */
function handlesOf(name, button = "") {
  const shared = new Shared();
  const host = new Box("figure");
  const fig = new Figure(host, shared, picturesOf({}));
  FIGURES[name](fig);
  fig.isVisible = true;
  if (button) host.all("button").find(({ textContent }) => textContent === button).say("click");
  fig.update();
  return host.all("canvas").map((canvas) => {
    const found = [];
    for (let i = 0; i < 9; i++) {
      canvas.say("keydown", { key: "Enter", preventDefault() {} });
      const text = canvas.attributes["aria-label"].match(/Arrow keys move (.*)\.$/)?.[1];
      if (!text) break;
      const before = JSON.stringify(shared.numbers);
      canvas.say("keydown", { key: "ArrowRight", shiftKey: true, preventDefault() {} });
      found.push([text, JSON.stringify(shared.numbers) !== before]);
    }
    return found;
  });
}

/** Drags in a figure's image, in a mode, to each of `places` in turn (CSS pixels). Returns the world's numbers after each place; `start` contains the initial numbers. */
function draggedNumbers(name, start, mode, places, button = "") {
  const shared = new Shared();
  Object.assign(shared.numbers, structuredClone(start));
  shared.changed();
  const host = new Box("figure");
  const fig = new Figure(host, shared, picturesOf({}));
  FIGURES[name](fig);
  fig.isVisible = true;
  for (const text of [button, mode]) if (text) host.all("button").find(({ textContent }) => textContent === text).say("click");
  fig.update();
  const canvas = host.all("canvas").at(-1);
  Object.assign(canvas, { clientHeight: 480, setPointerCapture() {}, getBoundingClientRect: () => ({ left: 0, top: 0 }) });
  fig.update();
  return places.map(([x, y], i) => {
    canvas.say(i ? "pointermove" : "pointerdown", { clientX: x, clientY: y, pointerId: 1 });
    return structuredClone(shared.numbers);
  });
}

/** The world's numbers after each key press in a figure's image. */
function numbersAfterKeys(name, start, keys) {
  const shared = new Shared();
  Object.assign(shared.numbers, structuredClone(start));
  const host = new Box("figure");
  const fig = new Figure(host, shared, picturesOf({}));
  FIGURES[name](fig);
  fig.isVisible = true;
  fig.update();
  const canvas = host.all("canvas").at(-1);
  return keys.map((key) => {
    canvas.say("keydown", { key, preventDefault() {} });
    return structuredClone(shared.numbers);
  });
}
