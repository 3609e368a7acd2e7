// The commands that keys, buttons and pointers trigger, and that a client executes.

import { byId, element } from "./dom.js";
import { KEYS, commandOf, keyLabel } from "./keys.js";
import { foldPanels } from "./layout.js";
import { Palette } from "./palette.js";
import { listenToPointers } from "./pointer.js";

/** @typedef {import("./client.js").Client} Client */

const WHEEL_ZOOM = 1.25;
const PAN_STEP = 48; // CSS pixels by which an arrow key pans

/**
 * The commands by name; arguments are the words after the name.
 * @param {Client} client
 * @returns {Record<string, (...words: string[]) => void>}
 */
function commandsOf(client) {
  const { picture, controls } = client;
  return {
    channel: (name) => client.setChannel(name),
    "channel-step": (step) => client.stepChannel(Number(step)),
    exposure: (thirds) => controls.setExposure(controls.display.exposure + Number(thirds) / 3),
    "view-transform": () => controls.nextView(),
    fit: () => picture.fit(),
    home: () => picture.fit(),
    "one-to-one": () => {
      const isOne = !picture.fitted && Math.abs(picture.zoom * picture.ratio - 1) < 1e-3;
      if (isOne) picture.fit();
      else picture.oneToOne();
    },
    step: (dx, dy) => {
      const { held } = client;
      if (!held) return picture.pan(-PAN_STEP * Number(dx), -PAN_STEP * Number(dy));
      const column = Math.min(Math.max(held.column + Number(dx), 0), picture.width - 1);
      const row = Math.min(Math.max(held.row + Number(dy), 0), picture.height - 1);
      client.hold({ column, row });
    },
    magnify: (steps) => {
      const { width, height } = picture.canvas.getBoundingClientRect();
      picture.zoomAt(WHEEL_ZOOM ** Number(steps), width / 2, height / 2);
    },
    hold: () => {
      const { width, height } = picture.canvas.getBoundingClientRect();
      client.pick(client.hovered || picture.pixelAt(width / 2, height / 2));
    },
    copy: () => client.copy(),
    explain: () => client.explain(),
    "take-b": () => client.takeB(),
    "start-compare": () => {
      if (client.taken && client.mode !== "off") return client.setMode("off");
      client.takeB();
      if (client.mode === "off") client.setMode("slider");
      openGroup(byId("compare", HTMLDetailsElement)).scrollIntoView({ block: "nearest" });
    },
    compare: () => client.nextMode(),
    flip: () => client.flip(),
    panel: () => {
      const hidden = document.body.classList.toggle("no-panel");
      byId("panel-button", HTMLButtonElement).setAttribute("aria-expanded", String(!hidden));
    },
    tree: () => {
      const hidden = document.body.classList.toggle("no-tree");
      byId("tree-button", HTMLButtonElement).setAttribute("aria-expanded", String(!hidden));
    },
    save: () => {
      const group = openGroup(byId("save", HTMLDetailsElement));
      group.scrollIntoView({ block: "start" });
      group.querySelector("button")?.focus();
    },
    help: () => byId("help", HTMLDialogElement).showModal(),
    leave: () => {
      client.unsay();
      client.hold(null);
      if (client.transport.live) client.transport.send({ type: "forget" });
    },
    pan: (dx, dy) => picture.pan(-PAN_STEP * Number(dx), -PAN_STEP * Number(dy)),
  };
}

/**
 * Binds keys, buttons and pointers to a client. `live` adds or replaces commands and mouse actions of the live view.
 * @param {Client} client
 * @param {{ commands: Record<string, (...words: string[]) => void>, pointers: Partial<import("./pointer.js").PointerListener>, mouse: string }} live
 */
export function bindCommands(client, live) {
  const { picture } = client;
  /** The labels of this keyboard. @type {Map<string, string> | null} */
  let layout = null;
  const palette = new Palette(() => entriesOf(client, layout, perform));
  const commands = {
    ...commandsOf(client),
    ...live.commands,
    palette: () => palette.open(),
  };
  const perform = (/** @type {string} */ command) => {
    const [name, ...words] = command.split(" ");
    /** @type {Record<string, (...words: string[]) => void>} */ (commands)[name](...words);
  };
  document.addEventListener("keydown", (event) => {
    if (document.querySelector("dialog[open]")) return;
    const command = commandOf(event, client.transport.live);
    if (!command) return;
    event.preventDefault();
    perform(command);
  });
  for (const [id, command] of [
    ["fit", "fit"], ["one-to-one", "one-to-one"], ["panel-button", "panel"], ["tree-button", "tree"], ["palette-button", "palette"], ["help-button", "help"], ["save-button", "save"],
    ["copy", "copy"], ["explain", "explain"], ["leave", "leave"], ["take-b", "take-b"], ["compare-button", "start-compare"],
  ]) {
    byId(id, HTMLButtonElement).addEventListener("click", () => perform(command));
  }
  const channel = byId("channel", HTMLSelectElement);
  channel.addEventListener("change", () => client.setChannel(channel.value));
  const mode = byId("compare-mode", HTMLSelectElement);
  mode.addEventListener("change", () => client.setMode(mode.value));
  const divider = byId("divider", HTMLInputElement);
  divider.addEventListener("input", () => client.setDivider(Number(divider.value)));

  listenToPointers(picture.canvas, {
    hover: ({ x, y }) => client.hover(picture.pixelAt(x, y)),
    away: () => {},
    click: ({ x, y }, explain) => {
      const pixel = picture.pixelAt(x, y);
      client.pick(pixel);
      if (explain && pixel) client.explain(pixel);
    },
    doubleClick: () => {},
    drag: (_, dx, dy) => picture.pan(dx, dy),
    wheel: ({ x, y }, steps) => picture.zoomAt(WHEEL_ZOOM ** steps, x, y),
    pinch: ({ x, y }, factor, dx, dy) => {
      picture.zoomAt(factor, x, y);
      picture.pan(dx, dy);
    },
    grabs: (at) => client.grabsDivider(at),
    dragGrabbed: (at) => client.divideAt(at),
    ...live.pointers,
  }, self !== top);
  foldPanels(client.transport.live);
  byId("mouse-help", HTMLElement).textContent = live.mouse;
  fillKeys(client.transport.live, null, perform);
  readLayout().then((found) => fillKeys(client.transport.live, (layout = found), perform));
}

/** The labels of keys by their positions on this keyboard, if the browser provides them. @returns {Promise<Map<string, string> | null>} */
async function readLayout() {
  const { keyboard } = /** @type {any} */ (navigator);
  return Promise.resolve(keyboard?.getLayoutMap?.()).then((found) => found || null, () => null);
}

/**
 * The entries of the command palette: the commands with keys, the channels, and the controls of the panel.
 * @param {Client} client
 * @param {Map<string, string> | null} layout the labels of this keyboard
 * @param {(command: string) => void} perform
 * @returns {import("./palette.js").PaletteEntry[]}
 */
function entriesOf(client, layout, perform) {
  const { live } = client.transport;
  const rows = KEYS.filter((row) => (live || !row.live) && row.command !== "palette" && !row.command.startsWith("channel "));
  const commands = rows.map(({ keys, command, does }) => ({ text: does, key: keyLabel(keys[0], layout), act: () => perform(command) }));
  const channels = client.channels.map((name) => {
    const key = KEYS.find(({ command }) => command === `channel ${name}`)?.keys[0];
    return { text: `channel ${name}`, key: key ? keyLabel(key, layout) : "", act: () => client.setChannel(name) };
  });
  const cameras = [...byId("camera", HTMLSelectElement).options].filter(({ value }) => value).map(({ value }) => ({
    text: `look through camera ${value}`, key: "", act: () => perform(`look-through-camera ${value}`),
  }));
  return [...commands, ...channels, ...(live ? cameras : []), ...panelEntries()];
}

/** The entries of the panel: a button or a check box is clicked, and any other field gets the focus. @returns {import("./palette.js").PaletteEntry[]} */
function panelEntries() {
  return [...document.querySelectorAll("#panel .group button, #panel .group label")].flatMap((each) => {
    const control = each instanceof HTMLLabelElement ? each.control : each;
    const group = each.closest("details");
    if (!(control instanceof HTMLElement) || control.matches(":disabled") || !group || !isShownIn(group, each)) return [];
    const name = control.getAttribute("aria-label") || each.firstChild?.textContent?.trim() || each.textContent?.trim();
    const act = () => {
      if (control.matches("button, [type=checkbox]")) return control.click();
      openGroup(group);
      control.scrollIntoView({ block: "center" });
      control.focus();
    };
    return [{ text: `${group.querySelector("h2")?.textContent}: ${name}`, more: each.getAttribute("title") || "", key: "", act }];
  });
}

/** False if an element is hidden even while its group is open. @param {Element} group @param {Element} inner @returns {boolean} */
function isShownIn(group, inner) {
  if (getComputedStyle(inner).display === "none") return false;
  return inner === group || isShownIn(group, /** @type {Element} */ (inner.parentElement));
}

/** Opens the panel and a group in it. @param {HTMLDetailsElement} group */
function openGroup(group) {
  document.body.classList.remove("no-panel");
  byId("panel-button", HTMLButtonElement).setAttribute("aria-expanded", "true");
  group.open = true;
  return group;
}

/**
 * Fills the help: a row for each command, with its keys as this keyboard labels them, and a button.
 * @param {boolean} live
 * @param {Map<string, string> | null} layout the labels of this keyboard
 * @param {(command: string) => void} perform
 */
function fillKeys(live, layout, perform) {
  const rows = KEYS.filter((row) => live || !row.live).map(({ keys, command, does }) => {
    const row = element("tr");
    const cell = element("th", "", { scope: "row" });
    keys.forEach((key, i) => cell.append(i ? " " : "", element("kbd", keyLabel(key, layout))));
    const button = element("button", does, { type: "button" });
    button.addEventListener("click", () => {
      byId("help", HTMLDialogElement).close();
      perform(command);
    });
    const action = element("td");
    action.append(button);
    row.append(cell, action);
    return row;
  });
  byId("key-rows", HTMLElement).replaceChildren(...rows);
}
