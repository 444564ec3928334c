// Files that are dropped or picked, with the folders that they came in.

const MODELS = [".glb", ".gltf", ".obj", ".pbrt", ".ply", ".stl", ".toml"];
const LIGHTS = [".hdr", ".exr"];

const ends = (name, endings) => endings.some((ending) => name.toLowerCase().endsWith(ending));

/** All files of a drop, as { name, bytes }: folders with what is in them. */
export async function dropped(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (entries.length === 0) return picked(transfer.files);
  const files = [];
  for (const entry of entries) await collect(entry, files);
  return read(files);
}

/** All files that were picked. */
export const picked = (list) => read([...list].map((file) => ({ name: file.webkitRelativePath || file.name, file })));

const read = (files) => Promise.all(files.map(async ({ name, file }) => ({ name, bytes: await file.arrayBuffer() })));

async function collect(entry, files) {
  const name = entry.fullPath.replace(/^\//, "");
  if (entry.isFile) {
    files.push({ name, file: await new Promise((resolve, reject) => entry.file(resolve, reject)) });
    return;
  }
  const reader = entry.createReader();
  // A call gives some of the entries; none are left when it gives none.
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return;
    for (const inner of some) await collect(inner, files);
  }
}

/** What of some files is to be opened: { model } or { light }, whichever there is, the least deep one. */
export function main(files) {
  const depth = ({ name }) => name.split("/").length;
  const first = (endings) => files.filter(({ name }) => ends(name, endings)).sort((a, b) => depth(a) - depth(b))[0];
  return { model: first(MODELS), light: first(LIGHTS) };
}

/** Lets the reader save some bytes. */
export function save(bytes, name, type) {
  const address = URL.createObjectURL(new Blob([bytes], { type }));
  const link = Object.assign(document.createElement("a"), { href: address, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
