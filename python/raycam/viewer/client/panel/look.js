// The look: light, ground and background of the view.

import { byId, fillSelect } from "../dom.js";

/** @typedef {{ light: string, rotation: number, azimuth: number, elevation: number, ground: string, background: string }} Look */

const LIGHT_NAMES = /** @type {[string, string][]} */ ([
  ["own", "as in the file"], ["studio", "studio"], ["room", "studio without key light"], ["sun", "sun and sky"], ["sky", "environment image"], ["default", "default lights"],
]);
/** The names if the world has lights, to which the studio, a sun or an environment is added. */
const ADDED_LIGHT_NAMES = /** @type {[string, string][]} */ ([
  ["own", "as in the file"], ["room", "file and studio's room"], ["studio", "file and studio"], ["sun", "file, sun and sky"], ["sky", "file and environment"], ["default", "default lights"],
]);
const GROUND_NAMES = /** @type {[string, string][]} */ ([["auto", "automatic"], ["plain", "floor"], ["shadow", "shadows only"], ["none", "none"]]);
const ANGLES = /** @type {const} */ (["rotation", "azimuth", "elevation"]);

export class LookControls {
  /** @param {(look: Look) => void} changed */
  constructor(changed) {
    /** @type {Look | null} */
    this.first = null;
    this.light = byId("look-light", HTMLSelectElement);
    this.ground = byId("look-ground", HTMLSelectElement);
    this.has = byId("look-has-background", HTMLInputElement);
    this.background = byId("look-background", HTMLInputElement);
    this.angles = ANGLES.map((name) => byId(`look-${name}`, HTMLInputElement));
    fillSelect(this.light, LIGHT_NAMES);
    fillSelect(this.ground, GROUND_NAMES);
    const act = () => {
      this.showRows();
      changed(this.look());
    };
    for (const input of [this.light, this.ground, this.has, this.background]) input.addEventListener("change", act);
    for (const input of this.angles) input.addEventListener("input", act);
    byId("look-reset", HTMLButtonElement).addEventListener("click", () => {
      if (!this.first) return;
      this.show(this.first);
      changed(this.first);
    });
  }

  /** @returns {Look} */
  look() {
    const [rotation, azimuth, elevation] = this.angles.map(({ value }) => Number(value));
    return { light: this.light.value, rotation, azimuth, elevation, ground: this.ground.value, background: this.has.checked ? this.background.value : "" };
  }

  /** Names the choices of light for a world with or without lights. @param {boolean} hasLights */
  nameLights(hasLights) {
    const { value } = this.light;
    fillSelect(this.light, hasLights ? ADDED_LIGHT_NAMES : LIGHT_NAMES);
    this.light.value = value;
  }

  /** @param {Look} look of the message `welcome`, which Reset restores */
  begin(look) {
    this.first = look;
    this.show(look);
  }

  /** @param {Look} look */
  show(look) {
    this.light.value = look.light;
    this.ground.value = look.ground;
    this.has.checked = look.background !== "";
    if (look.background) this.background.value = look.background;
    this.angles.forEach((input, i) => (input.value = String(look[ANGLES[i]])));
    this.showRows();
  }

  showRows() {
    const light = this.light.value;
    byId("look-rotation-row", HTMLElement).hidden = light !== "sky";
    for (const name of ["azimuth", "elevation"]) byId(`look-${name}-row`, HTMLElement).hidden = light !== "sun";
    byId("look-background-row", HTMLElement).hidden = !this.has.checked;
    ANGLES.forEach((name, i) => (byId(`look-${name}-text`, HTMLOutputElement).textContent = `${this.angles[i].value}°`));
  }
}
