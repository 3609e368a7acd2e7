// Files that are dropped on the live view: they are sent in pieces, and then the world among them is opened.

import { filesOf, isKnown, isWorld } from "./files.js";

/** @typedef {import("./client.js").Client} Client */
/** @typedef {import("./files.js").FileTypes} FileTypes */
/** @typedef {import("./files.js").NamedFile} NamedFile */

const PIECE = 45000; // bytes of a piece; encoded, these are 60000 characters of base64
const LONGEST_NAME = 1000, LARGEST_FILE = 2 ** 28; // the server's limits for names in characters, and for files in bytes
const LISTED = 3; // maximum number of ignored files that a notice lists
const ARCHIVE = /\.zip$/i;
const MODEL = /\.(glb|gltf|vrm|obj|ply|stl|off|usd[acz]?)$/i; // endings of models that can be shown together
const ENVIRONMENT = /\.(hdr|exr)$/i; // a dropped image of this type lights the world
const MAX_MODELS = 100;

/**
 * Handles files that are dropped anywhere on the page.
 * @param {Client} client
 * @param {() => FileTypes | null} types of files that the server opens; null if it opens none
 */
export function listenToDrops(client, types) {
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    const { dataTransfer } = event;
    if (!dataTransfer?.files.length) return;
    const [first] = dataTransfer.files;
    if (dataTransfer.files.length === 1 && ENVIRONMENT.test(first.name)) return sendLookImage(client, "light", first);
    const known = types();
    if (!known) return client.say("This view cannot open files: start it with --allow-open.", "notice");
    const dropped = new Set([...dataTransfer.files].map(({ name }) => name));
    filesOf(dataTransfer)
      .then((files) => sendFiles(client, files, known, dropped))
      .catch((error) => client.say(`The files could not be read: ${error}`, "error"));
  });
}

/**
 * Sends the files that a world may need, and opens the world among them; files of other types are ignored.
 * @param {Client} client
 * @param {NamedFile[]} files
 * @param {FileTypes} types
 * @param {Set<string>} dropped names of the files that were dropped themselves, instead of in a folder
 */
async function sendFiles(client, files, types, dropped) {
  const depth = (/** @type {NamedFile} */ { name }) => name.split("/").length;
  const used = files.filter(({ name, file }) => (isKnown(name, types) || ARCHIVE.test(name)) && file.size > 0);
  const worlds = used.filter(({ name }) => isWorld(name, types) || ARCHIVE.test(name)).sort((a, b) => depth(a) - depth(b));
  const world = types.worlds.map((type) => worlds.find(({ name }) => name.toLowerCase().endsWith(`.${type}`))).find(Boolean) || worlds[0];
  if (!world) return client.say(`No world found in these files; supported: ${types.worlds.join(", ")}, zip.`, "error");
  const refused = used.find(({ name, file }) => name.length > LONGEST_NAME || file.size > LARGEST_FILE);
  if (refused) return client.say(whyNot(refused), "error");
  const ignored = files.filter((each) => !used.includes(each));
  if (ignored.length) client.say(`Ignored: ${listOf(ignored)}.`, "notice");
  for (const { name, file } of used) await sendPieces(client, name, file);
  const more = othersOf(world, worlds, dropped);
  const unused = worlds.filter(({ name }) => name !== world.name && !more.includes(name) && depth(world) === name.split("/").length);
  if (unused.length && !/\.toml$/i.test(world.name)) {
    client.say(`Showing ${world.name}; to show another world, drop only one of these files: ${listOf(unused)}.`, "notice", true);
  }
  client.transport.send({ type: "open", name: world.name, others: more });
}

/**
 * Sends a file in pieces.
 * @param {Client} client
 * @param {string} name
 * @param {Blob} file
 */
export async function sendPieces(client, name, file) {
  const bytes = new Uint8Array(await file.arrayBuffer());
  for (let offset = 0; offset < bytes.length; offset += PIECE) {
    const data = base64Of(bytes.subarray(offset, offset + PIECE));
    client.transport.send({ type: "upload", name, bytes: bytes.length, offset, data });
  }
}

/**
 * Sends an image that lights the world, or that is the background.
 * @param {Client} client
 * @param {import("./messages").LookImage["use"]} use
 * @param {File} file
 */
export async function sendLookImage(client, use, file) {
  if (!file.size || file.size > LARGEST_FILE) return client.say(`${file.name}: expected an image of 1 byte to 256 MiB.`, "error");
  const name = `look-${Date.now()}/${file.name}`; // the view may still use an earlier file of the same name
  await sendPieces(client, name, file);
  client.transport.send({ type: "look_image", use, file: name });
}

/**
 * The models that are shown together with the model `first`: all other dropped models, if no world file was dropped.
 * @param {NamedFile} first
 * @param {NamedFile[]} worlds
 * @param {Set<string>} dropped
 * @returns {string[]}
 */
function othersOf(first, worlds, dropped) {
  const beside = worlds.filter(({ name }) => dropped.has(name));
  if (!beside.includes(first) || beside.some(({ name }) => !MODEL.test(name))) return [];
  return beside.filter((each) => each !== first).map(({ name }) => name).slice(0, MAX_MODELS);
}

/**
 * @param {NamedFile} file that is not sent
 * @returns {string} the reason
 */
function whyNot({ name, file: { size } }) {
  if (size > LARGEST_FILE) return `${name} is too large: ${Math.ceil(size / 2 ** 20)} MiB, the limit is 256 MiB; open it with raycam view FILE.`;
  return `${name.slice(0, 40)}...: the name is longer than ${LONGEST_NAME} characters; rename the file.`;
}

/** @param {NamedFile[]} files @returns {string} the first names, and the number of further files */
function listOf(files) {
  const more = files.length > LISTED ? ` and ${files.length - LISTED} more` : "";
  return files.slice(0, LISTED).map(({ name }) => name).join(", ") + more;
}

/**
 * @param {Uint8Array} bytes
 * @returns {string}
 */
function base64Of(bytes) {
  let text = "";
  for (let i = 0; i < bytes.length; i += 4096) text += String.fromCharCode(...bytes.subarray(i, i + 4096));
  return btoa(text);
}
