// The look: light, ground and background of the view.

import { byId, element, fillSelect } from "../dom.js";
import { sendLookImage } from "../drop.js";

/** @typedef {Omit<import("../messages").Look, "type">} LookChoice */
/** @typedef {LookChoice & { image: string, background_image: string, is_first: boolean }} Look */

const LIGHT_NAMES = /** @type {[string, string][]} */ ([
  ["own", "as in the file"], ["studio", "studio"], ["room", "studio without key light"], ["sun", "sun and sky"], ["sky", "environment image"], ["default", "default lights"],
]);
/** The names if the world has lights, to which the studio, a sun or an environment is added. */
const ADDED_LIGHT_NAMES = /** @type {[string, string][]} */ ([
  ["own", "as in the file"], ["room", "file and studio's room"], ["studio", "file and studio"], ["sun", "file, sun and sky"], ["sky", "file and environment"], ["default", "default lights"],
]);
const GROUND_NAMES = /** @type {[string, string][]} */ ([["auto", "automatic"], ["plain", "floor"], ["color", "coloured floor"], ["shadow", "shadows only"], ["none", "none"]]);
const BACKDROP_NAMES = /** @type {[string, string][]} */ ([["light", "of the light"], ["color", "colour"], ["image", "image"]]);
const ANGLES = /** @type {const} */ (["rotation", "azimuth", "elevation"]);
const LOOK_IMAGE_TYPES = ".hdr,.exr,image/png,image/jpeg,image/webp";

export class LookControls {
  /** @param {import("../client.js").Client} client */
  constructor(client) {
    this.client = client;
    this.light = byId("look-light", HTMLSelectElement);
    this.ground = byId("look-ground", HTMLSelectElement);
    this.groundColor = byId("look-ground-color", HTMLInputElement);
    this.backdrop = byId("look-backdrop", HTMLSelectElement);
    this.background = byId("look-background", HTMLInputElement);
    this.angles = ANGLES.map((name) => byId(`look-${name}`, HTMLInputElement));
    this.reset = byId("look-reset", HTMLButtonElement);
    /** The name of the background image; empty if the view has none. */
    this.backgroundImage = "";
    fillSelect(this.light, LIGHT_NAMES);
    fillSelect(this.ground, GROUND_NAMES);
    fillSelect(this.backdrop, BACKDROP_NAMES);
    for (const input of [this.light, this.ground, this.groundColor, this.background]) input.addEventListener("change", () => this.tell());
    for (const input of this.angles) input.addEventListener("input", () => this.tell());
    this.chooseBackground = this.fileButton("look-background-choose", "background");
    this.fileButton("look-image-choose", "light");
    this.backdrop.addEventListener("change", () => {
      if (this.backdrop.value !== "image" || this.backgroundImage) return this.tell();
      this.showRows();
      this.chooseBackground();
    });
    this.reset.addEventListener("click", () => client.transport.send({ type: "restore_look" }));
  }

  /**
   * Makes a button open a file dialog, whose image is sent.
   * @param {string} id
   * @param {import("../messages").LookImage["use"]} use
   * @returns {() => void} opens the dialog
   */
  fileButton(id, use) {
    const input = /** @type {HTMLInputElement} */ (element("input", "", { type: "file", accept: LOOK_IMAGE_TYPES, hidden: "", "aria-label": `Image file of the ${use}` }));
    const button = byId(id, HTMLButtonElement);
    button.after(input);
    button.addEventListener("click", () => input.click());
    input.addEventListener("change", () => {
      const file = input.files?.[0];
      input.value = "";
      if (file) sendLookImage(this.client, use, file);
    });
    return () => input.click();
  }

  tell() {
    this.showRows();
    this.client.transport.send({ type: "look", ...this.look() });
  }

  /** @returns {LookChoice} */
  look() {
    const [rotation, azimuth, elevation] = this.angles.map(({ value }) => Number(value));
    const chosen = { light: this.light.value, ground: this.ground.value, backdrop: this.backdrop.value };
    return /** @type {LookChoice} */ ({ ...chosen, rotation, azimuth, elevation, ground_color: this.groundColor.value, background: this.background.value });
  }

  /** Names the choices of light for a world with or without lights. @param {boolean} hasLights */
  nameLights(hasLights) {
    const { value } = this.light;
    fillSelect(this.light, hasLights ? ADDED_LIGHT_NAMES : LIGHT_NAMES);
    this.light.value = value;
  }

  /** @param {Look} look */
  show(look) {
    [this.light.value, this.ground.value, this.backdrop.value] = [look.light, look.ground, look.backdrop];
    if (look.background) this.background.value = look.background;
    if (look.ground_color) this.groundColor.value = look.ground_color;
    this.angles.forEach((input, i) => (input.value = String(look[ANGLES[i]])));
    this.backgroundImage = look.background_image;
    byId("look-image-name", HTMLElement).textContent = byId("look-image-name", HTMLElement).title = look.image;
    byId("look-background-name", HTMLElement).textContent = byId("look-background-name", HTMLElement).title = look.background_image || "no image";
    this.reset.hidden = look.is_first;
    this.showRows();
  }

  showRows() {
    const [light, ground, backdrop] = [this.light.value, this.ground.value, this.backdrop.value];
    for (const name of ["rotation", "image"]) byId(`look-${name}-row`, HTMLElement).hidden = light !== "sky";
    for (const name of ["azimuth", "elevation"]) byId(`look-${name}-row`, HTMLElement).hidden = light !== "sun";
    byId("look-ground-color-row", HTMLElement).hidden = ground !== "color";
    byId("look-background-row", HTMLElement).hidden = backdrop !== "color";
    byId("look-background-image-row", HTMLElement).hidden = backdrop !== "image";
    ANGLES.forEach((name, i) => (byId(`look-${name}-text`, HTMLOutputElement).textContent = `${this.angles[i].value}°`));
  }
}
