// Reads the manifest of a site, and its files of data.

/** A fault that a person can do something about. */
export class SiteError extends Error {}

/** @param {string} file relative to the page @returns {Promise<Response>} */
async function fetched(file) {
  let answer;
  try {
    answer = await fetch(new URL(file, import.meta.url));
  } catch {
    throw new SiteError(`${file} cannot be fetched; is the server still there?`);
  }
  if (!answer.ok) throw new SiteError(`${file} cannot be fetched (${answer.status} ${answer.statusText})`);
  return answer;
}

/** @returns {Promise<any>} the manifest, of a version that this page reads */
export async function readManifest() {
  const found = await (await fetched("manifest.json")).json();
  if (found.version === 0) throw new SiteError("This site is unfinished; export it again");
  if (found.format !== "lambent-site" || found.version !== 1) {
    throw new SiteError(`manifest.json is ${found.format} ${found.version}; this page reads lambent-site 1`);
  }
  return found;
}

/** @param {string} file @returns {Promise<string>} */
export async function readText(file) {
  return (await fetched(file)).text();
}

/** @typedef {{word: 1|2|4, channels: number, runs: [number, number][]}} Packing */
/** @typedef {{file: string, bytes: number, packed: number, sha256: string, packing?: Packing, picture?: boolean}} Piece */

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

/** Reads files of data, each once, and reports the bytes that have arrived. */
export class Data {
  /** @param {(done: number) => void} report */
  constructor(report) {
    this.report = report;
    this.done = 0;
    /** @type {Map<string, Promise<ArrayBuffer | ImageBitmap>>} */
    this.files = new Map();
  }

  /** @param {Piece} piece @returns {Promise<ArrayBuffer | ImageBitmap>} */
  read(piece) {
    let found = this.files.get(piece.file);
    if (!found) this.files.set(piece.file, (found = this.unpacked(piece)));
    return found;
  }

  /** @param {Piece} piece @param {Response} answer @returns {Promise<ImageBitmap>} */
  async picture(piece, answer) {
    let found;
    try {
      found = await createImageBitmap(await answer.blob(), { premultiplyAlpha: "none", colorSpaceConversion: "none" });
    } catch {
      throw new SiteError(`${piece.file} is damaged; export the site again`);
    }
    this.report((this.done += piece.packed));
    return found;
  }

  /** @param {Piece} piece @returns {Promise<ArrayBuffer | ImageBitmap>} */
  async unpacked(piece) {
    const answer = await fetched(piece.file);
    if (piece.picture) return this.picture(piece, answer);
    const body = answer.body;
    if (!body) throw new SiteError(`${piece.file} is empty`);
    let data;
    try {
      data = await new Response(body.pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
    } catch {
      throw new SiteError(`${piece.file} is damaged; export the site again`);
    }
    if (piece.packing) data = unpack(new Uint8Array(data), piece.packing);
    const digest = globalThis.crypto?.subtle && new Uint8Array(await crypto.subtle.digest("SHA-256", data));
    const hex = digest && Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
    if (data.byteLength !== piece.bytes || (hex && hex !== piece.sha256)) {
      throw new SiteError(`${piece.file} is damaged; export the site again`);
    }
    this.report((this.done += piece.packed));
    return data;
  }
}
