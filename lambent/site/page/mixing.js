// Mixes the light groups of a room. Light adds up: what a mix changes are sums of each group's part times its factor.

import { levelsOf } from "./loading.js";
import { writeLevels } from "./objects.js";
import { clamp } from "./vectors.js";

/** @import { Data, Piece } from "./loading.js" */
/** @import { Objects } from "./objects.js" */
/** @typedef {[number, number, number]} Factor by channel */
/** @typedef {{intensity: number, kelvin: number | null, colour: Factor}} Mix of a group: `GroupMix` of Python */
/** @typedef {{rangeK: [number, number], sliderK: [number, number], colours: Factor[]}} BlackBodies in equal ratios */
/** @typedef {{at: number, described: GPUTextureDescriptor, pieces: (Piece | null)[], parts: GPUTexture[], own: GPUTexture | null, last: string}} Target */

const SIDE = 8, // of a workgroup
  LARGEST = 65504, // half float
  LUMINANCE = [0.2126, 0.7152, 0.0722];

/** Colour of luminance 1 of a black body. @param {BlackBodies} bodies @param {number} kelvin */
function blackBody({ rangeK: [low, high], colours }, kelvin) {
  const at = (Math.log(kelvin / low) / Math.log(high / low)) * (colours.length - 1);
  const i = clamp(Math.floor(at), 0, colours.length - 2);
  return colours[i].map((value, c) => value + (at - i) * (colours[i + 1][c] - value));
}

/** By what a group's light is multiplied: `GroupMix.factor` of Python. @param {Mix} mix @param {BlackBodies} bodies */
export function factorOf({ intensity, kelvin, colour }, bodies) {
  const body = kelvin === null ? [1, 1, 1] : blackBody(bodies, kelvin);
  const tint = colour.map((value, c) => value * body[c]);
  const level = tint.reduce((sum, value, c) => sum + value * LUMINANCE[c], 0);
  return /** @type {Factor} */ (tint.map((value) => (level > 0 ? (value * intensity) / level : 0)));
}

/** WGSL that sums `count` textures. @param {number} count */
function shader(count) {
  const parts = [...Array(count).keys()],
    declared = parts.map((i) => `@group(0) @binding(${2 + i}) var part_${i}: texture_2d_array<f32>;`),
    sum = parts.map((i) => `weights[${i}] * textureLoad(part_${i}, at.xy, at.z, 0)`);
  return `
@group(0) @binding(0) var mixed: texture_storage_2d_array<rgba16float, write>;
@group(0) @binding(1) var<uniform> weights: array<vec4f, ${count}>;
${declared.join("\n")}
@compute @workgroup_size(${SIDE}, ${SIDE}) fn mix_parts(@builtin(global_invocation_id) at: vec3u) {
    textureStore(mixed, at.xy, at.z, clamp(${sum.join(" + ")}, vec4f(), vec4f(${LARGEST})));
}`;
}

/** @param {Factor[]} a @param {Factor[]} b */
const areEqual = (a, b) => a.every((factor, i) => factor.every((value, c) => value === b[i][c]));

/**
 * Numbers under a mix, from a table of them as exported and what each group's factor multiplies, by channel.
 * @param {Float32Array<ArrayBuffer>} table @param {Factor[]} factors @returns {Float32Array<ArrayBuffer>}
 */
export function mixedNumbers(table, factors) {
  const count = table.length / (1 + 3 * factors.length),
    found = new Float64Array(count);
  factors.flat().forEach((factor, row) => {
    const at = (1 + row) * count;
    if (factor) for (let i = 0; i < count; i++) found[i] += factor * table[at + i];
  });
  return Float32Array.from(found);
}

/** Shows mixes of the light of a state of the room. */
export class Mixing {
  /** @type {Map<number, GPUComputePipeline>} by how many parts they sum */ pipelines = new Map();
  /** @type {Target[]} */ targets = [];
  /** @type {Factor[]} of the state as exported */ own = [];
  /** @type {Set<number>} groups whose parts are here */ loaded = new Set();
  /** @type {Float32Array<ArrayBuffer> | null} numbers that a mix changes */ table = null;

  /** @param {any} manifest @param {Objects} objects @param {Data} data */
  constructor(manifest, objects, data) {
    this.manifest = manifest;
    this.objects = objects;
    this.device = objects.device;
    this.data = data;
  }

  /** Mix this state's light from now on. @param {number} number @param {Factor[]} own factors of its light as exported */
  take(number, own) {
    const { spans, numbers, textures } = this.manifest.states[number].mixing,
      { texture } = this.manifest.tables,
      usage = GPUTextureUsage.COPY_DST | GPUTextureUsage.COPY_SRC | GPUTextureUsage.TEXTURE_BINDING;
    this.own = own;
    this.spans = spans;
    this.numbers = /** @type {Piece} */ (numbers);
    this.table = null;
    this.loaded = new Set();
    this.targets = textures.map((/** @type {any} */ { texture: at, layers, pieces }) => {
      const { size, mipLevelCount, format } = texture[at],
        described = { size: [size[0], size[1], layers], mipLevelCount, format, usage };
      return { at, described, pieces, parts: [], own: null, last: "" };
    });
  }

  /** Show the state's light as exported, and drop the parts. */
  leave() {
    this.mix(this.own, true);
    for (const { parts, own } of this.targets) for (const one of [...parts, own]) one?.destroy();
    this.targets = [];
  }

  /** Fetch the parts of groups. @param {number[]} groups */
  async load(groups) {
    const { targets, loaded, device } = this,
      wanted = groups.filter((group) => !loaded.has(group));
    if (!wanted.length) return;
    const table = this.data.read(/** @type {Piece} */ (this.numbers));
    const found = await Promise.all(
      targets.flatMap(({ pieces }) => wanted.map((group) => pieces[group] && this.data.read(pieces[group]))),
    );
    const numbers = new Float32Array(/** @type {ArrayBuffer} */ (await table));
    await this.objects.refined; // what a mix adds to is exact
    if (targets !== this.targets) return;
    this.table = numbers;
    targets.forEach(({ described, parts }, i) =>
      wanted.forEach((group, k) => {
        const content = /** @type {ArrayBuffer} */ (found[i * wanted.length + k]);
        if (!content || loaded.has(group)) return;
        parts[group] = device.createTexture(described);
        writeLevels(device, parts[group], described, content);
      }),
    );
    wanted.forEach((group) => loaded.add(group));
  }

  /** Show a mix whose groups are loaded; probes and skies only when it `rests`. @param {Factor[]} factors @param {boolean} rests */
  mix(factors, rests) {
    const encoder = this.device.createCommandEncoder();
    for (const target of rests ? this.targets : this.targets.slice(0, 1)) this.sum(encoder, target, factors);
    this.device.queue.submit([encoder.finish()]);
    if (!this.table) return;
    const isOwn = areEqual(factors, this.own),
      numbers = isOwn ? this.table : mixedNumbers(this.table, factors);
    let first = 0;
    for (const [buffer, offset, count] of this.spans) {
      this.device.queue.writeBuffer(this.objects.made.buffer[buffer], offset, numbers, first, count);
      first += count;
    }
  }

  /**
   * Write a mix into a texture: its own content and what changed groups add, or all groups' parts where all are here.
   * @param {GPUCommandEncoder} encoder @param {Target} target @param {Factor[]} factors
   */
  sum(encoder, target, factors) {
    const { own, pieces, parts } = target,
      isAll = pieces.every((piece, group) => !piece || parts[group]);
    const keeps = areEqual(factors, this.own) || !isAll ? 1 : 0;
    /** @type {number[][]} */
    const weights = factors.map((factor, group) => [...factor.map((f, c) => f - keeps * this.own[group][c]), 0]);
    const used = Object.keys(parts)
      .map(Number)
      .filter((group) => weights[group].some((weight) => weight));
    const key = JSON.stringify([keeps, used, used.map((group) => weights[group])]);
    if (key === target.last || (!own && !used.length && keeps)) return;
    target.last = key;
    target.own ??= this.copied(encoder, target);
    const sources = [target.own, ...used.map((group) => parts[group])];
    const values = Float32Array.from([keeps, keeps, keeps, 1, ...used.flatMap((group) => weights[group])]);
    const usage = GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST;
    const buffer = this.device.createBuffer({ size: values.byteLength, usage });
    this.device.queue.writeBuffer(buffer, 0, values);
    const pipeline = this.pipeline(sources.length),
      pass = encoder.beginComputePass();
    pass.setPipeline(pipeline);
    levelsOf(target.described).forEach(([width, height, arrayLayerCount], baseMipLevel) => {
      const view = (/** @type {GPUTexture} */ texture) =>
        texture.createView({ dimension: "2d-array", baseMipLevel, mipLevelCount: 1, arrayLayerCount });
      const resources = [view(this.objects.made.texture[target.at]), { buffer }, ...sources.map(view)];
      const entries = resources.map((resource, binding) => ({ binding, resource }));
      pass.setBindGroup(0, this.device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries }));
      pass.dispatchWorkgroups(Math.ceil(width / SIDE), Math.ceil(height / SIDE), arrayLayerCount);
    });
    pass.end();
  }

  /** A copy of a texture's own content. @param {GPUCommandEncoder} encoder @param {Target} target */
  copied(encoder, { at, described }) {
    const texture = this.device.createTexture(described),
      source = this.objects.made.texture[at];
    levelsOf(described).forEach((size, mipLevel) =>
      encoder.copyTextureToTexture({ texture: source, mipLevel }, { texture, mipLevel }, size),
    );
    return texture;
  }

  /** @param {number} count */
  pipeline(count) {
    let found = this.pipelines.get(count);
    if (!found) {
      const module = this.device.createShaderModule({ code: shader(count) });
      found = this.device.createComputePipeline({ layout: "auto", compute: { module } });
      this.pipelines.set(count, found);
    }
    return found;
  }
}
