// Links to this view: a button copies a link, and a page that is opened with a link shows its view.

import { lensFor, linkText, seenOf } from "../link.js";

/** @typedef {import("../live.js").LiveView} LiveView */

export class ViewLink {
  /** @param {LiveView} live */
  constructor(live) {
    this.live = live;
    /** The lens of the camera, as the server describes it. @type {import("./lens.js").Lens | null} */
    this.lens = null;
    /** The pixel of a link, until the image has arrived. @type {number[] | null} */
    this.pixel = null;
  }

  /** Copies an address that shows the same view in another browser. */
  copy() {
    const { client, timeline, navigator: { camera }, looked, integrator } = this.live;
    const { transport, controls: { display }, held, picture } = client;
    const { lens } = this;
    if (!("addressOf" in transport) || !camera || !lens) return client.say("A link requires a view that is connected to a server.", "notice");
    const { fx, fy, cx, cy, distortion, size } = lens;
    const text = linkText({
      camera: looked, free: !this.live.camera.value, R: [...camera.R], C: [...camera.C], focal: camera.K[0], pivot: [...camera.pivot],
      lens: [fx, fy, cx, cy, ...distortion], size, channel: client.channel, exposure: display.exposure, view: display.view,
      time: Number(timeline.slider.value), animation: timeline.animation.value, variant: timeline.variant.value,
      integrator: integrator.value,
      pixel: held && [(held.column + 0.5) / picture.width, (held.row + 0.5) / picture.height],
    });
    this.live.copied(/** @type {any} */ (transport).addressOf(text));
  }

  /** Shows the view of the link in the page's address, once. */
  follow() {
    const { live, live: { client, timeline, cameras } } = this;
    const { transport, controls } = client;
    const given = "link" in transport ? transport.link : null;
    if (!given) return;
    /** @type {any} */ (transport).link = null;
    const seen = seenOf(/** @type {string} */ (given));
    if (!seen) return client.say("The link is damaged; the page shows its initial view.", "error");
    if (seen.variant !== timeline.variant.value) transport.send({ type: "variant", name: seen.variant });
    if (timeline.seconds) transport.send({ type: "time", t: seen.time, animation: seen.animation });
    if (cameras.includes(seen.camera)) live.lookThrough(seen.camera);
    if (seen.free) {
      const [fx, fy, cx, cy, ...distortion] = cameras.includes(seen.camera) ? seen.lens : lensFor(seen, this.lens?.size || seen.size, this.lens?.corner || 0);
      const { R, C, focal, pivot } = seen;
      transport.send({ type: "lens", fx, fy, cx, cy, distortion });
      transport.send({ type: "move", seq: ++live.navigator.seq, R, C, fx: focal, pivot });
    }
    if (seen.integrator !== live.integrator.value) live.setIntegrator(seen.integrator);
    controls.setExposure(seen.exposure);
    controls.setView(seen.view);
    client.setChannel(seen.channel);
    this.pixel = seen.pixel;
  }

  /** Holds the pixel of the link as soon as the image has arrived. */
  holdPixel() {
    if (!this.pixel) return;
    const { client, client: { picture } } = this.live;
    const [column, row] = [Math.floor(this.pixel[0] * picture.width), Math.floor(this.pixel[1] * picture.height)];
    this.pixel = null;
    if (column >= 0 && row >= 0 && column < picture.width && row < picture.height) client.hold({ column, row });
  }
}
