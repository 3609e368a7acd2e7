// The table of keys, which the handler, the help and docs/view.md use.

/**
 * A row: the keys, their command, its description, and whether it exists only in live views. Ctrl, Alt and Shift are
 * written in front of the key, in this order; "Shift" is omitted for characters that require Shift.
 * @type {{ keys: string[], command: string, does: string, live?: boolean }[]}
 */
export const KEYS = [
  { keys: ["1"], command: "channel color", does: "color" },
  { keys: ["2"], command: "channel albedo", does: "albedo" },
  { keys: ["3"], command: "channel depth", does: "depth" },
  { keys: ["4"], command: "channel normal", does: "normal" },
  { keys: ["5"], command: "channel shading_normal", does: "shading_normal" },
  { keys: ["6"], command: "channel instance", does: "instance" },
  { keys: ["7"], command: "channel triangle", does: "triangle" },
  { keys: ["8"], command: "channel uv", does: "uv" },
  { keys: ["9", "M"], command: "channel error", does: "error" },
  { keys: ["["], command: "channel-step -1", does: "previous channel" },
  { keys: ["]"], command: "channel-step 1", does: "next channel" },
  { keys: ["-"], command: "exposure -1", does: "darker by 1/3 stop" },
  { keys: ["=", "+"], command: "exposure 1", does: "brighter by 1/3 stop" },
  { keys: ["T"], command: "view-transform", does: "next view transform" },
  { keys: ["F"], command: "fit", does: "show the whole image; in the live view, the object of the held pixel, or the whole world" },
  { keys: ["Home"], command: "home", does: "show the whole image; in the live view, return to the first camera" },
  { keys: ["Num1"], command: "side front", does: "view from the front", live: true },
  { keys: ["Num3"], command: "side right", does: "view from the right", live: true },
  { keys: ["Num7"], command: "side top", does: "view from the top", live: true },
  { keys: ["Num0"], command: "side iso", does: "view from the corner", live: true },
  { keys: ["Ctrl+K"], command: "palette", does: "search all commands" },
  { keys: ["J"], command: "tree", does: "show or hide the scene", live: true },
  { keys: ["Z"], command: "one-to-one", does: "one image pixel per screen pixel, or the whole image again" },
  { keys: ["ArrowLeft"], command: "step -1 0", does: "with a held pixel: hold the pixel on the left; otherwise pan or orbit" },
  { keys: ["ArrowRight"], command: "step 1 0", does: "with a held pixel: hold the pixel on the right; otherwise pan or orbit" },
  { keys: ["ArrowUp"], command: "step 0 -1", does: "with a held pixel: hold the pixel above; otherwise pan or orbit" },
  { keys: ["ArrowDown"], command: "step 0 1", does: "with a held pixel: hold the pixel below; otherwise pan or orbit" },
  { keys: ["Ctrl+ArrowLeft"], command: "pan -1 0", does: "pan to the left" },
  { keys: ["Ctrl+ArrowRight"], command: "pan 1 0", does: "pan to the right" },
  { keys: ["Ctrl+ArrowUp"], command: "pan 0 -1", does: "pan upwards" },
  { keys: ["Ctrl+ArrowDown"], command: "pan 0 1", does: "pan downwards" },
  { keys: ["Shift+ArrowUp"], command: "nearer 1", does: "move closer", live: true },
  { keys: ["Shift+ArrowDown"], command: "nearer -1", does: "move back", live: true },
  { keys: ["Alt+ArrowUp"], command: "magnify 1", does: "magnify the image" },
  { keys: ["Alt+ArrowDown"], command: "magnify -1", does: "reduce the magnification" },
  { keys: ["P"], command: "hold", does: "hold the pixel under the pointer, or the pixel in the middle" },
  { keys: ["Ctrl+C"], command: "copy", does: "copy the values of the held pixel" },
  { keys: ["Enter"], command: "explain", does: "explain the held pixel" },
  { keys: ["B"], command: "take-b", does: "keep this image as B" },
  { keys: ["X"], command: "compare", does: "next comparison of A and B: wipe, flip, blink, differences, off" },
  { keys: ["Space"], command: "flip", does: "show the other image" },
  { keys: ["C"], command: "camera-step 1", does: "next camera", live: true },
  { keys: ["Shift+C"], command: "camera-step -1", does: "previous camera", live: true },
  { keys: ["O"], command: "next-scan", does: "show the points of the next lidar, or hide them", live: true },
  { keys: ["U"], command: "panes", does: "show up to four cameras at once, or one", live: true },
  { keys: ["V"], command: "look-through", does: "look through the camera, or continue with a free camera", live: true },
  { keys: ["N"], command: "drive", does: "next navigation mode: orbit, fly or walk (W A S D Q E, Shift: fast, wheel: speed)", live: true },
  { keys: ["K"], command: "play", does: "play or pause", live: true },
  { keys: [","], command: "frame -1", does: "1/30 s back", live: true },
  { keys: ["."], command: "frame 1", does: "1/30 s forward", live: true },
  { keys: ["Ctrl+Z"], command: "undo", does: "undo the last change: edit, camera, lens, light, variant", live: true },
  { keys: ["Ctrl+Shift+Z", "Ctrl+Y"], command: "redo", does: "repeat the change that was undone", live: true },
  { keys: ["G"], command: "tool move", does: "show or hide handles that move the selected object", live: true },
  { keys: ["R"], command: "tool turn", does: "show or hide handles that turn the selected object", live: true },
  { keys: ["S"], command: "tool scale", does: "show or hide handles that scale the selected object", live: true },
  { keys: ["D"], command: "measure", does: "measure the distance between two pixels", live: true },
  { keys: ["L"], command: "integrator", does: "switch between direct light and path tracing", live: true },
  { keys: ["I"], command: "copy-link", does: "copy a link to this view: camera, channel, time and held pixel", live: true },
  { keys: ["H"], command: "panel", does: "show or hide the properties" },
  { keys: ["?"], command: "help", does: "show the keys" },
  { keys: ["Escape"], command: "leave", does: "release the held pixel, close a message or a dialog" },
];

/** Names of keys by their position on the keyboard, which does not depend on the layout. */
const KEY_PLACES = /** @type {Record<string, string>} */ ({
  BracketLeft: "[", BracketRight: "]", Minus: "-", Equal: "=", Comma: ",", Period: ".", Numpad0: "Num0", Numpad1: "Num1", Numpad3: "Num3", Numpad7: "Num7", NumpadAdd: "+", NumpadSubtract: "-",
});

/**
 * The name of a pressed key in the table: the name of the key's position on the keyboard, so that keys work on any layout. With
 * Ctrl, a Latin letter counts instead: Ctrl+Z is undo wherever the letter Z is.
 * @param {KeyboardEvent} event
 * @returns {string}
 */
export function keyName({ key: typed, code, ctrlKey, metaKey, altKey, shiftKey }) {
  const isControl = ctrlKey || metaKey;
  const upper = typed.length === 1 ? typed.toUpperCase() : typed;
  const byPlace = KEY_PLACES[code] || (/^(?:Key|Digit)(.)$/.exec(code) || [])[1];
  const isByType = typed === "?" || (isControl && /^[A-Z]$/.test(upper));
  const key = typed === " " ? "Space" : (!isByType && byPlace) || upper;
  const shift = shiftKey && /^[A-Z]$|^.{2,}$/.test(key);
  return `${isControl ? "Ctrl+" : ""}${altKey ? "Alt+" : ""}${shift ? "Shift+" : ""}${key}`;
}

/**
 * The label of a key of the table on this keyboard.
 * @param {string} name
 * @param {Map<string, string> | null} layout letters by places, if the browser has them
 * @returns {string}
 */
export function keyLabel(name, layout) {
  const [, modifiers, key] = /^((?:\w+\+)*)(.+)$/.exec(name) || ["", "", name];
  const place = /^[A-Z]$/.test(key) ? `Key${key}` : Object.keys(KEY_PLACES).find((code) => KEY_PLACES[code] === key) || "";
  const label = (!modifiers.includes("Ctrl") && layout?.get(place)?.toUpperCase()) || key;
  return `${modifiers}${label.replace("Arrow", "")}`;
}

/**
 * The command of a pressed key, or null. Keys that are typed into a field trigger no command.
 * @param {KeyboardEvent} event
 * @param {boolean} live
 * @returns {string | null}
 */
export function commandOf(event, live) {
  const target = /** @type {HTMLElement} */ (event.target);
  const name = keyName(event);
  const field = target.closest("input, select, textarea, button, summary, dialog, a");
  if (field && (field.matches("input:not([type=checkbox]), select, textarea") || name === "Space" || name === "Enter")) {
    return null;
  }
  if (name === "Ctrl+C" && String(getSelection())) return null;
  const row = KEYS.find(({ keys }) => keys.includes(name));
  return row && (live || !row.live) ? row.command : null;
}
