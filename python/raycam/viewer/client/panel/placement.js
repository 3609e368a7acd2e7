// The numbers of the selected object's placement: location, angles and scales.

import { byId, numbersOf } from "../dom.js";

const PLACE_FIELDS = ["place-x", "place-y", "place-z", "place-roll", "place-pitch", "place-yaw", "scale-x", "scale-y", "scale-z"];

/**
 * Returns the text of a value: angles with up to 4 decimals, lengths and scales with up to 6 digits and 9 decimals.
 * @param {number} value
 * @param {number} field the index in `PLACE_FIELDS`
 */
function shortNumber(value, field) {
  const isAngle = /roll|pitch|yaw/.test(PLACE_FIELDS[field]);
  return String(isAngle ? Number(value.toFixed(4)) : Number(Number(value.toFixed(9)).toPrecision(6)));
}

export class PlacementFields {
  /** @param {(place: number, value: number) => void} changed @param {(text: string) => void} wrong */
  constructor(changed, wrong) {
    this.inputs = PLACE_FIELDS.map((id) => byId(id, HTMLInputElement));
    this.inputs.forEach((input, i) => {
      input.addEventListener("change", () => {
        const [value] = numbersOf([input], wrong) || [];
        if (value !== undefined) changed(i, value);
      });
    });
  }

  /** @param {number[] | null | undefined} values null for an object that is sheared @param {boolean} isFixed by an animation */
  show(values, isFixed) {
    byId("placement", HTMLElement).hidden = !values;
    this.inputs.forEach((input, i) => {
      input.disabled = isFixed;
      if (values && document.activeElement !== input) input.value = shortNumber(values[i], i);
    });
  }
}
