// Reads the manifest of a site, and its files of data.

import { clamp } from "./vectors.js";

/** A fault that a person can do something about. */
export class SiteError extends Error {}

/** A fault of a file: it may come if it is asked for again. */
export class FileError extends SiteError {}

/** @param {string} file relative to the page @returns {Promise<Blob>} */
async function fetched(file) {
  const answer = await fetch(new URL(file, import.meta.url)).catch(() => null);
  if (answer && !answer.ok) throw new FileError(`${file} cannot be fetched (${answer.status} ${answer.statusText})`);
  const content = await answer?.blob().catch(() => null);
  if (content) return content;
  throw new FileError(`${file} ${answer ? "did not arrive whole" : "cannot be fetched"}; is the server still there?`);
}

/** @returns {Promise<any>} the manifest, as it was exported; browsers can tell on pages from https and localhost */
export async function readManifest() {
  const text = await readText("manifest.json"),
    [, version, sum, rest = ""] = /^{"format":"lambent-site","version":(\d+),"sha256":"(\w+)",(.*)$/s.exec(text) ?? [],
    bytes = new Uint8Array((await crypto.subtle?.digest("SHA-256", new TextEncoder().encode(rest))) ?? []);
  if (version && version !== "1")
    throw new SiteError(`manifest.json has version ${version}; this page reads version 1`);
  const found = Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
  if (!version || (found && found !== sum)) throw new SiteError("manifest.json is damaged; export the site again");
  return JSON.parse(`{${rest}`);
}

/** @param {string} file @returns {Promise<string>} */
export async function readText(file) {
  return (await fetched(file)).text();
}

/** @typedef {{word: 1|2|4, channels: number, runs: [number, number][]}} Packing */
/** @typedef {{file: string, bytes: number, packed: number, packing?: Packing, units?: number[], picture?: boolean, inline?: string, blocks?: Piece, standin?: any}} Piece */
/** @typedef {Record<string, Record<string, Piece>>} Changes of contents, by kind and place */

export const BLOCKS = "bc6h-rgb-ufloat";
const STEPS = 32767; // of an octahedron's square

/** The data of differences: see lambent/site/chunks.py. @param {Uint8Array} bytes @param {Packing} packing @returns {ArrayBuffer} */
export function unpack(bytes, { word, channels, runs }) {
  const found = new ArrayBuffer(bytes.length),
    size = bytes.length / word;
  const words = word === 1 ? new Uint8Array(found) : word === 2 ? new Uint16Array(found) : new Uint32Array(found);
  let at = 0;
  for (const [count, back] of runs) {
    const records = count / channels,
      plane = bytes.subarray(at * word);
    for (let channel = 0; channel < channels; channel++) {
      let value = 0;
      for (let i = 0; i < records; i++) {
        let difference = 0;
        for (let byte = word - 1; byte >= 0; byte--) {
          difference = (difference << 8) | plane[(byte * channels + channel) * records + i];
        }
        value = (value + difference) | 0;
        words[at + i * channels + channel] = value;
      }
    }
    if (back) for (let i = at + back; i < at + count; i++) words[i] += words[i - back];
    at += count;
  }
  if (at !== size) throw new SiteError("a file of data is not as long as the manifest says; export the site again");
  return found;
}

/**
 * Vertices: their words, in which a unit vector is a point of an octahedron; see lambent/site/vertices.py.
 * @param {ArrayBuffer} data @param {number} channels words of a vertex @param {number[]} units first floats of unit vectors
 */
export function vertices(data, channels, units) {
  const floats = new Float32Array(data),
    points = new Int32Array(data),
    count = floats.length / channels;
  const found = new Float32Array(count * (channels + units.length));
  for (let vertex = 0, from = 0, to = 0; vertex < count; vertex++) {
    const first = to;
    for (const end of [...units, channels + units.length]) {
      while (to < first + end) found[to++] = floats[from++];
      if (end > channels) break;
      let x = points[from++] / STEPS,
        y = points[from++] / STEPS;
      const z = 1 - Math.abs(x) - Math.abs(y);
      if (z < 0) [x, y] = [(1 - Math.abs(y)) * (x >= 0 ? 1 : -1), (1 - Math.abs(x)) * (y >= 0 ? 1 : -1)];
      const length = Math.sqrt(x * x + y * y + z * z);
      for (const value of [x, y, z]) found[to++] = value / length;
    }
  }
  return found.buffer;
}

/** Sizes of the levels of a texture: columns, rows, layers. @param {any} described @returns {[number, number, number][]} */
export const levelsOf = ({ size: [width, height, layers = 1], mipLevelCount = 1 }) =>
  Array.from({ length: mipLevelCount }, (_, k) => [Math.max(1, width >> k), Math.max(1, height >> k), layers]);

/**
 * All levels of a texture of its stand-in, whose first level is the `finest`: each texel by the one that covers it, or one
 * for the corner of each block of `side` texels.
 * @param {ArrayBuffer} standin @param {number[]} size @param {number} levels @param {number} finest
 * @param {number} bytes a texel @param {number} side
 */
export function enlarged(standin, size, levels, finest, bytes, side = 1) {
  const Words = bytes % 4 ? (bytes % 2 ? Uint8Array : Uint16Array) : Uint32Array,
    words = bytes / Words.BYTES_PER_ELEMENT,
    sizes = levelsOf({ size, mipLevelCount: Math.max(levels, finest + 1) }),
    blocks = sizes.slice(0, levels).map(([w, h, layers]) => [Math.ceil(w / side), Math.ceil(h / side), layers]);
  const from = new Words(standin),
    found = new Words(blocks.reduce((sum, [w, h, layers]) => sum + w * h * layers * words, 0));
  let [to, first] = [0, 0];
  blocks.forEach(([w, h, layers], level) => {
    const [sw, sh] = sizes[Math.max(level, finest)],
      shift = Math.max(finest - level, 0);
    for (let row = 0; row < h * layers; row++) {
      const line = first + (Math.floor(row / h) * sh + Math.min((side * (row % h)) >> shift, sh - 1)) * sw * words;
      for (let x = 0; x < w; x++) {
        const at = line + Math.min((side * x) >> shift, sw - 1) * words;
        for (let i = 0; i < words; i++) found[to++] = from[at + i];
      }
    }
    if (level >= finest) first += sw * sh * layers * words;
  });
  return found.buffer;
}

/** Blocks of BC6H, each of the one colour of a texel of half floats. @param {ArrayBuffer} texels */
export function inBlocks(texels) {
  const from = new Uint16Array(texels),
    found = new Uint32Array(from.length);
  for (let i = 0; i < from.length; i += 4) {
    const [r, g, b] = [0, 1, 2].map((channel) => clamp(Math.round((from[i + channel] - 15) / 31), 0, 1023));
    found[i] = 3 | (r << 5) | (g << 15) | (b << 25); // mode 11: both ends in 10 bits, all texels at the first
    found[i + 1] = b >> 7;
  }
  return found.buffer;
}

/** Take cube maps in blocks of BC6H, where the manifest has them for all states. @param {any} manifest */
export function takeBlocks({ tables, states }) {
  const taken = (/** @type {any} */ { blocks, standin }) => ({ ...blocks, ...(standin ? { standin } : {}) });
  tables.texture.forEach((/** @type {any} */ one, /** @type {number} */ at) => {
    /** @type {Record<string, Piece>[]} */
    const changed = states.flatMap((/** @type {any} */ { changes }) =>
      changes.texture?.[at] ? [changes.texture] : [],
    );
    if (![one.data, ...changed.map((places) => places[at])].every((piece) => piece?.blocks)) return;
    one.format = BLOCKS;
    one.data = taken(one.data);
    for (const places of changed) places[at] = taken(places[at]);
  });
}

/** What changes: kinds and places of objects, and pieces. @param {Changes} changes */
export const listed = (changes) =>
  Object.entries(changes).flatMap(([kind, places]) =>
    Object.entries(places).map(([at, piece]) => ({ kind, at: Number(at), piece })),
  );

/** Files whose content is needed again once it is on the GPU: what states change. @param {any} manifest @returns {Set<string>} */
export function neededAgain({ tables, states }) {
  /** @type {ReturnType<typeof listed>} */
  const ones = states.flatMap((/** @type {any} */ one) => listed(one.changes));
  return new Set(ones.flatMap(({ kind, at, piece }) => [piece.file, tables[kind][at].data.file]));
}

/** Reads files of data, and reports the bytes that have arrived. */
export class Data {
  /** @param {(done: number) => void} report @param {Set<string>} kept files of which the content is kept */
  constructor(report, kept = new Set()) {
    this.report = report;
    this.kept = kept;
    this.done = 0;
    /** @type {Map<string, Promise<ArrayBuffer | ImageBitmap>>} files on their way, and those that are kept */
    this.files = new Map();
  }

  /** @param {Piece} piece @returns {Promise<ArrayBuffer | ImageBitmap>} */
  read(piece) {
    const { file } = piece;
    let found = this.files.get(file);
    if (!found) {
      this.files.set(file, (found = this.unpacked(piece)));
      const forget = () => this.files.delete(file);
      found.then(this.kept.has(file) ? undefined : forget, forget);
    }
    return found;
  }

  /** @param {Piece} piece @returns {Promise<ArrayBuffer | ImageBitmap>} */
  async unpacked(piece) {
    const packed = piece.inline ? new Blob([bytesIn(piece.inline)]) : await fetched(piece.file);
    const content = await (piece.picture ? picture(packed) : bytesOf(piece, packed)).catch(() => null);
    if (!content) throw new FileError(`${piece.file} is damaged; export the site again`);
    this.report((this.done += piece.packed));
    return content;
  }
}

/** @param {Blob} packed @returns {Promise<ImageBitmap>} */
const picture = (packed) => createImageBitmap(packed, { premultiplyAlpha: "none", colorSpaceConversion: "none" });

/** @param {string} text in base 64 */
const bytesIn = (text) => Uint8Array.from(atob(text), (one) => one.charCodeAt(0));

/** The content of a file; null if it is not as long as the manifest says. Others that gzip's own sum betrays are errors. @param {Piece} piece @param {Blob} packed */
async function bytesOf({ bytes, packing, units }, packed) {
  const words = packed.stream().pipeThrough(new DecompressionStream("gzip")),
    data = await new Response(words).arrayBuffer();
  if (data.byteLength !== bytes) return null;
  const found = packing ? unpack(new Uint8Array(data), packing) : data;
  return packing && units ? vertices(found, packing.channels, units) : found;
}
