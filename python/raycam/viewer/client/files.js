// Tests of file names against the types that the server or the page lists, and the files of dropped folders.

/** @typedef {{ worlds: string[], companions: string[] }} FileTypes extensions without the dot */
/** @typedef {{ name: string, file: File }} NamedFile a file, and its path relative to the dropped item */

/** @param {string} name */
const extensionOf = (name) => (/\.([^./]+)$/.exec(name) || ["", ""])[1].toLowerCase();

/** @param {string} name @param {FileTypes} types @returns {boolean} true for a world or a model */
export const isWorld = (name, types) => types.worlds.includes(extensionOf(name));

/** @param {string} name @param {FileTypes} types @returns {boolean} true for a world, a model, or a file that worlds or models refer to */
export const isKnown = (name, types) => isWorld(name, types) || types.companions.includes(extensionOf(name));

/**
 * All dropped files, including the files in folders. Call this function during the event, because the browser
 * discards the entries afterwards.
 * @param {DataTransfer} transfer
 * @returns {Promise<NamedFile[]>}
 */
export async function filesOf(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter((entry) => entry !== null && entry !== undefined);
  const plain = [...transfer.files].map((file) => ({ name: file.name, file }));
  if (!entries.some(({ isDirectory }) => isDirectory)) return plain;
  /** @type {NamedFile[]} */
  const found = [];
  for (const entry of entries) await collect(entry, "", found);
  const tops = new Set(found.map(({ name }) => name.split("/")[0]));
  const isOneFolder = entries.length === 1 && tops.size === 1;
  return isOneFolder ? found.map(({ name, file }) => ({ name: name.slice(name.indexOf("/") + 1), file })) : found;
}

/**
 * @param {any} entry of a file or a folder
 * @param {string} folder
 * @param {NamedFile[]} found
 */
async function collect(entry, folder, found) {
  const name = `${folder}${entry.name}`;
  if (entry.isFile) return found.push({ name, file: await new Promise((resolve, reject) => entry.file(resolve, reject)) });
  const reader = entry.createReader();
  for (;;) {
    /** @type {any[]} */
    const inside = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!inside.length) return;
    for (const each of inside) await collect(each, `${name}/`, found);
  }
}
