// The playground: a world file on the left, and on the right the file's image, which the page renders.

import { element, fillSelect } from "../dom.js";
import { isKnown, isWorld } from "../files.js";
import { LONGEST_LINK, linkOfText, textOfLink } from "./world_link.js";

const PATH = "world.toml";
const PAUSE = 350; // milliseconds after the last key press until the world is read
const MOST_BYTES = 256 * 2 ** 20; // maximum bytes of all opened files: a page has 512 MiB of memory, and a model in memory is larger than its file

/** @typedef {{ name: string, text: string }} Example */
/** @typedef {import("../files.js").FileTypes} FileTypes */

export class Playground {
  /**
   * @param {import("../transport/worker.js").WorkerTransport} transport
   * @param {Example[]} examples
   * @param {FileTypes} types
   */
  constructor(transport, examples, types) {
    this.transport = transport;
    this.types = types;
    /** @type {Map<string, ArrayBuffer>} files that were dropped, by their names */
    this.files = new Map();
    this.timer = 0;
    this.lines = 1;
    /** The line with an error, counted from 1; 0 without an error. */
    this.wrong = 0;
    this.text = /** @type {HTMLTextAreaElement} */ (element("textarea", "", { id: "world-text", spellcheck: "false", "aria-label": "World file", wrap: "off" }));
    this.gutter = element("pre", "", { id: "world-lines", "aria-hidden": "true" });
    this.problem = element("p", "", { id: "world-problem", role: "status" });
    this.choice = /** @type {HTMLSelectElement} */ (element("select", "", { id: "example", "aria-label": "Example" }));
    fillSelect(this.choice, [["", "examples"], ...examples.map(({ name }) => /** @type {[string, string]} */ ([name, name]))]);
    this.build();
    this.choice.addEventListener("change", () => {
      const chosen = examples.find(({ name }) => name === this.choice.value);
      if (chosen) this.replaceText(chosen.text);
    });
    this.text.addEventListener("input", () => this.edited());
    this.text.addEventListener("scroll", () => this.drawNumbers());
    new ResizeObserver(() => this.drawNumbers()).observe(this.text);
    document.addEventListener("dragover", (event) => event.preventDefault());
    document.addEventListener("drop", (event) => {
      event.preventDefault();
      this.take([...(event.dataTransfer?.files || [])]);
    });
    transport.onFailure = (failure) => this.fail(failure);
    this.begin(examples);
  }

  build() {
    const buttons = element("div", "", { class: "buttons" });
    const choose = /** @type {HTMLInputElement} */ (element("input", "", { type: "file", multiple: "", "aria-label": "Open your own files" }));
    choose.addEventListener("change", () => this.take([...(choose.files || [])]));
    buttons.append(this.choice);
    const actions = /** @type {[string, string, () => void][]} */ ([
      ["copy-command", "Copy command", () => this.copy(this.command())],
      ["copy-python", "Copy Python", () => this.copy(this.python())],
      ["share", "Share as link", () => this.share()],
    ]);
    for (const [id, text, act] of actions) {
      const button = element("button", text, { type: "button", id });
      button.addEventListener("click", act);
      buttons.append(button);
    }
    const lines = element("div", "", { id: "world-editor" });
    lines.append(this.gutter, this.text);
    const note = element("p", "Drop a .glb, .obj or .ply here, or open one: the file stays on your computer and is not uploaded.");
    const pane = element("section", "", { id: "playground", "aria-label": "World" });
    pane.append(buttons, lines, this.problem, note, choose);
    document.querySelector("main")?.prepend(pane);
    document.body.classList.add("playground", "no-panel"); // the panel is closed, so that the image has more space; a button opens it
    document.getElementById("panel-button")?.setAttribute("aria-expanded", "false");
  }

  /** @param {Example[]} examples */
  async begin(examples) {
    const shared = new URLSearchParams(location.hash.slice(1)).get("w");
    const linked = shared ? await textOfLink(shared).catch(() => null) : null;
    if (linked !== null) return this.setText(linked);
    if (examples.length) this.setText(examples[0].text);
    if (shared) this.fail({ text: "The link is damaged: its world cannot be read." });
  }

  /** @param {string} text */
  setText(text) {
    this.text.value = text;
    this.number(0);
    this.show();
  }

  /** Replaces the text as if it were typed, so that the browser's undo restores the old text. @param {string} text */
  replaceText(text) {
    this.text.focus();
    this.text.select();
    if (document.execCommand("insertText", false, text)) this.show();
    else this.setText(text);
  }

  edited() {
    this.number(0);
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.show(), PAUSE);
  }

  show() {
    clearTimeout(this.timer);
    this.say("");
    const bytes = /** @type {ArrayBuffer} */ (new TextEncoder().encode(this.text.value).buffer);
    this.transport.show({ path: PATH, files: [...this.files, [PATH, bytes]], options: { title: "raycam playground" } });
  }

  /** Numbers the lines. @param {number} wrong the line with an error, from 1 */
  number(wrong) {
    this.wrong = wrong;
    this.lines = this.text.value.split("\n").length;
    this.drawNumbers();
  }

  /** Draws only the numbers of the visible lines, because a text may have a million lines. */
  drawNumbers() {
    const { scrollTop, clientHeight } = this.text;
    const height = parseFloat(getComputedStyle(this.text).lineHeight) || 18;
    const first = Math.floor(scrollTop / height);
    const last = Math.min(first + Math.ceil(clientHeight / height) + 1, this.lines);
    const marks = [];
    for (let line = first + 1; line <= last; line++) {
      marks.push(element("span", `${line}\n`, line === this.wrong ? { class: "wrong" } : {}));
    }
    this.gutter.style.minWidth = `${String(this.lines).length + 1}ch`;
    this.gutter.style.transform = `translateY(${first * height - scrollTop}px)`;
    this.gutter.replaceChildren(...marks);
  }

  /** @param {{ text: string, line?: number, file?: string }} failure */
  fail({ text, line, file }) {
    this.problem.textContent = text;
    this.problem.classList.add("wrong");
    if (line && file === PATH) this.number(line);
  }

  /** @param {string} text */
  say(text) {
    this.problem.textContent = text;
    this.problem.classList.remove("wrong");
  }

  /** Takes files that the user dropped or chose. @param {File[]} given */
  async take(given) {
    const known = given.filter(({ name }) => isKnown(name, this.types));
    const kept = [...this.files].filter(([name]) => !known.some((file) => file.name === name));
    const bytes = known.reduce((sum, { size }) => sum + size, 0) + kept.reduce((sum, [, { byteLength }]) => sum + byteLength, 0);
    if (bytes > MOST_BYTES) return this.fail({ text: `The files have ${bytes} bytes in total, but the limit of a page is ${MOST_BYTES}; open them with raycam view.` });
    try {
      for (const file of known) this.files.set(file.name, await file.arrayBuffer());
    } catch (error) {
      return this.fail({ text: `A file cannot be read: ${error}` });
    }
    const world = known.find(({ name }) => /\.toml$/i.test(name));
    const model = known.find(({ name }) => isWorld(name, this.types) && !/\.toml$/i.test(name));
    if (world) {
      this.setText(new TextDecoder().decode(this.files.get(world.name)));
      this.files.delete(world.name); // from now on, the text in the editor is the world file
    }
    if (!world && model) this.setText(`# ${model.name}, from this machine\n[[object]]\nmesh = ${JSON.stringify(model.name)}\n`);
    if (!world && !model) this.show();
    const left = given.length - known.length;
    if (left) this.fail({ text: `${left} of ${given.length} files are ignored, because raycam does not support their formats.` });
  }

  /** @param {string} text */
  async copy(text) {
    try {
      await navigator.clipboard.writeText(text);
      this.say("Copied.");
    } catch {
      this.say(text);
    }
  }

  command() {
    let end = "END";
    while (this.text.value.split("\n").includes(end)) end += "_";
    return `cat > ${PATH} <<'${end}'\n${this.text.value.replace(/\n$/, "")}\n${end}\nraycam render ${PATH} -o picture.png`;
  }

  python() {
    const plain = !/'''|\\|'$/.test(this.text.value);
    const text = plain ? `'''\\\n${this.text.value}'''` : JSON.stringify(this.text.value);
    return `import pathlib\nimport raycam\n\npathlib.Path("${PATH}").write_text(${text}, encoding="utf-8")\nraycam.render("${PATH}").save("picture.png")\n`;
  }

  async share() {
    const packed = await linkOfText(this.text.value);
    if (packed.length > LONGEST_LINK) {
      const limit = `the limit is ${LONGEST_LINK}`;
      return this.fail({ text: `The world is too large for a link: ${packed.length} characters, ${limit}; send it as a file.` });
    }
    history.replaceState(null, "", `#w=${packed}`);
    await this.copy(location.href);
    if (this.files.size) this.problem.textContent += ` The link contains only the text; the ${this.files.size} opened files are not part of it.`;
  }
}

/** The examples and the file types of a page with a playground; null in other pages. @returns {{ playground: Example[], types: FileTypes } | null} */
export function playgroundOfPage() {
  const options = JSON.parse(document.getElementById("core-options")?.textContent || "{}");
  return options.playground ? options : null;
}
