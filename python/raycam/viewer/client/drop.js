// Files that are dropped on the live view: sent in pieces, then the world among them is opened.

/** @typedef {import("./client.js").Client} Client */

const PIECE = 45000; // bytes, 60000 letters of base64
const LONGEST_NAME = 100, LARGEST_FILE = 2 ** 28; // as the server takes them
const WORLD_ENDINGS = /\.(toml|gltf|glb|obj|ply|stl|off)$/i;

/**
 * Listens to files that are dropped anywhere on the page.
 * @param {Client} client
 * @param {() => boolean} allowed
 */
export function listenToDrops(client, allowed) {
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    const files = [...(event.dataTransfer?.files || [])];
    if (!files.length) return;
    if (!allowed()) return client.say("This view opens no files: start it with --allow-open.", "notice");
    sendFiles(client, files).catch((error) => client.say(`The files could not be read: ${error}`, "error"));
  });
}

/**
 * @param {Client} client
 * @param {File[]} files
 */
async function sendFiles(client, files) {
  const world = files.find(({ name }) => WORLD_ENDINGS.test(name));
  if (!world) return client.say("None of these files is a world: .toml, .gltf, .glb, .obj, .ply, .stl or .off.", "error");
  const refused = files.find(({ name, size }) => name.length > LONGEST_NAME || size === 0 || size > LARGEST_FILE);
  if (refused) return client.say(whyNot(refused), "error");
  for (const file of files) {
    const bytes = new Uint8Array(await file.arrayBuffer());
    for (let offset = 0; offset < bytes.length; offset += PIECE) {
      const data = base64Of(bytes.subarray(offset, offset + PIECE));
      client.transport.send({ type: "upload", name: file.name, bytes: bytes.length, offset, data });
    }
  }
  client.transport.send({ type: "open", name: world.name });
}

/**
 * @param {File} file that is not sent
 * @returns {string} the reason
 */
function whyNot({ name, size }) {
  if (size === 0) return `${name} is empty, or a folder: drop the files in it.`;
  if (size > LARGEST_FILE) return `${name} has ${Math.ceil(size / 2 ** 20)} MiB, more than 256: open it with raycam view FILE.`;
  return `${name}: its name has more than ${LONGEST_NAME} characters: rename it.`;
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
