// The objects of WebGPU that a manifest describes, and their contents.

import { BLOCKS, enlarged, inBlocks, levelsOf, listed, readText } from "./loading.js";
import { wholeWindow } from "./mirrors.js";

/** @import { Changes, Data } from "./loading.js" */

export const CANVAS = "canvas";
const HALVES = 8; // bytes of a texel of four half floats
const AT_ONCE = 4; // files on their way: enough to fill a line, so few that the first is there first
const MIRROR = "mirror"; // size of the buffers of mirrored views
const WORDS = ["rgb10a2unorm", "rgb9e5ufloat", "depth32float"]; // of 4 bytes a texel

/** Bytes of a block, and its texels a side. @param {string} format @returns {[number, number]} */
function blockOf(format) {
  if (format === BLOCKS) return [16, 4];
  const parts = WORDS.includes(format) ? null : /^([rgba]+)(8|16|32)/.exec(format);
  return [parts ? (parts[1].length * Number(parts[2])) / 8 : 4, 1];
}

/** Write the levels of a texture, one after the other. @param {GPUDevice} device @param {GPUTexture} texture @param {any} described @param {ArrayBuffer} content */
export function writeLevels(device, texture, described, content) {
  const [bytes, side] = blockOf(described.format);
  let offset = 0;
  levelsOf(described).forEach(([width, height, layers], mipLevel) => {
    const [columns, rows] = [width, height].map((texels) => Math.ceil(texels / side));
    const layout = { offset, bytesPerRow: columns * bytes, rowsPerImage: rows };
    device.queue.writeTexture({ texture, mipLevel }, content, layout, [columns * side, rows * side, layers]);
    offset += columns * rows * bytes * layers;
  });
}

const FILL_DEPTH = `
@group(0) @binding(0) var depths: texture_2d_array<f32>;
override LAYER: i32;
@vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i / 2u) * 4.0 - 1.0, f32(i % 2u) * 4.0 - 1.0, 0.0, 1.0);
}
@fragment fn fill(@builtin(position) at: vec4f) -> @builtin(frag_depth) f32 {
    return textureLoad(depths, vec2i(at.xy), LAYER, 0).x;
}`;

/** Objects by kind and place, as in the tables of a manifest. */
export class Objects {
  /** @type {Record<string, any[]>} */ made = {};
  /** @type {Record<string, number>} how many are made, by kind */ counts = {};
  width = 0;
  height = 0;
  /** @type {Changes} contents other than the tables say */ changed = {};
  /** @type {Set<number>} places of textures that stand-ins fill */ coarse = new Set();
  /** @type {Promise<any>} none of them is left */ refined = Promise.resolve();
  /** @type {Promise<void>} one state's objects are made after another's */ loaded = Promise.resolve();
  leave = () => {}; // called before contents become another state's, to undo what else wrote into them

  /** @param {any} manifest @param {GPUDevice} device */
  constructor(manifest, device) {
    this.manifest = manifest;
    this.device = device;
  }

  /**
   * Make the objects that a state counts, and write the contents in which it differs; false if another is wanted meanwhile.
   * @param {Record<string, number>} counts @param {Changes} changes @param {Data} data @param {() => boolean} isWanted
   */
  async show(counts, changes, data, isWanted) {
    const load = () => this.load(counts, data);
    await (this.loaded = this.loaded.then(load, load));
    const back = listed(this.changed).map((one) => ({ ...one, piece: this.manifest.tables[one.kind][one.at].data })),
      differ = [...back, ...listed(changes)];
    const contents = await Promise.all(differ.map(({ piece }) => data.read(piece)));
    if (!isWanted()) return false;
    this.leave();
    differ.forEach(({ kind, at }, i) => this.write(kind, at, contents[i]));
    this.changed = changes;
    return true;
  }

  /** Make the objects of the tables up to these counts. @param {Record<string, number>} counts @param {Data} data */
  async load(counts, data) {
    const { device, made } = this;
    const lacking = (/** @type {string} */ kind) =>
      /** @type {any[]} */ (this.manifest.tables[kind] ?? []).slice(made[kind]?.length ?? 0, counts[kind] ?? 0);
    const add = (/** @type {string} */ kind, /** @type {any[]} */ found) =>
      (made[kind] = [...(made[kind] ?? []), ...found]);
    const [modules, buffers, textures] = await Promise.all([
      Promise.all(lacking("shader_module").map((one) => readText(one.file))),
      Promise.all(lacking("buffer").map(({ data: piece }) => piece && data.read(piece))),
      Promise.all(lacking("texture").map(({ data: piece }) => piece && data.read(piece.standin ?? piece))),
    ]);
    const shaders = modules.map((code) => device.createShaderModule({ code }));
    add("shader_module", shaders);
    for (const [kind, contents] of Object.entries({ buffer: buffers, texture: textures })) {
      const first = made[kind]?.length ?? 0,
        ones = lacking(kind).map((one) => (one.data || kind === "buffer" ? this.create(kind, one) : null));
      add(kind, ones);
      contents.forEach((content, i) => content && this.begin(kind, first + i, content));
    }
    const inPlaces = (/** @type {any} */ one) => one && { ...one, module: made.shader_module[one.module] };
    /** @type {Record<string, (one: any) => any>} in the order in which they need each other */
    const makers = {
      sampler: (one) => device.createSampler(one),
      bind_group_layout: (one) => device.createBindGroupLayout(one),
      pipeline_layout: ({ bindGroupLayouts: places }) => {
        const bindGroupLayouts = places.map((/** @type {number} */ at) => made.bind_group_layout[at]);
        return device.createPipelineLayout({ bindGroupLayouts });
      },
      render_pipeline: ({ layout, vertex, fragment, ...one }) => {
        const stages = { vertex: inPlaces(vertex), fragment: inPlaces(fragment) };
        return device.createRenderPipelineAsync({ ...one, ...stages, layout: made.pipeline_layout[layout] });
      },
    };
    for (const [kind, make] of Object.entries(makers)) add(kind, await Promise.all(lacking(kind).map(make)));
    this.counts = counts;
  }

  /** Write the first content, of a texture that of its stand-in. @param {string} kind @param {number} at @param {any} content */
  begin(kind, at, content) {
    const { data, size, format, mipLevelCount = 1 } = this.manifest.tables[kind][at];
    if (!data.standin) return this.write(kind, at, content);
    const { finest } = data.standin;
    const whole =
      format === BLOCKS
        ? inBlocks(enlarged(content, size, mipLevelCount, finest, HALVES, 4))
        : enlarged(content, size, mipLevelCount, finest, blockOf(format)[0]);
    this.write(kind, at, whole);
    this.coarse.add(at);
  }

  /** Replace stand-ins by what they stand for, in this order. @param {number[]} order @param {Data} data @param {() => void} finer called after each */
  async refine(order, data, finer) {
    const places = order.filter((at) => this.coarse.has(at));
    const one = async () => {
      for (let at = places.shift(); at !== undefined; at = places.shift()) {
        const content = await data.read(this.manifest.tables.texture[at].data);
        if (!this.coarse.has(at)) continue; // a state has changed it meanwhile
        this.write("texture", at, content);
        finer();
      }
    };
    await (this.refined = Promise.all(Array.from({ length: AT_ONCE }, one)));
  }

  /** A buffer or texture that content is written to. @param {string} kind @param {any} one */
  create(kind, one) {
    if (kind === "buffer") {
      const size = Math.ceil(one.size / 4) * 4;
      return this.device.createBuffer({ size, usage: one.usage | GPUBufferUsage.COPY_DST });
    }
    const isDrawn = one.format === "depth32float" || one.data.picture;
    const extra = GPUTextureUsage.COPY_DST | (isDrawn ? GPUTextureUsage.RENDER_ATTACHMENT : 0);
    return this.device.createTexture({ ...one, usage: one.usage | extra });
  }

  /** @param {string} kind @param {number} at @param {ArrayBuffer | ImageBitmap} content */
  write(kind, at, content) {
    const one = this.manifest.tables[kind][at],
      made = this.made[kind][at];
    if (kind === "texture") this.coarse.delete(at);
    if (content instanceof ImageBitmap) return this.copy(one, made, content);
    if (kind === "buffer") return this.device.queue.writeBuffer(made, 0, content);
    const { size, format } = one,
      isDepth = format === "depth32float",
      usage = GPUTextureUsage.COPY_DST | GPUTextureUsage.TEXTURE_BINDING;
    const target = isDepth ? this.device.createTexture({ size, format: "r32float", usage }) : made;
    writeLevels(this.device, target, one, content);
    if (isDepth) this.fillDepth(target, made, size[2] ?? 1);
  }

  /** The levels of a picture, one below the other. @param {any} one @param {GPUTexture} to @param {ImageBitmap} source */
  copy(one, to, source) {
    let y = 0;
    levelsOf(one).forEach(([width, height], mipLevel) => {
      const target = { texture: to, mipLevel };
      this.device.queue.copyExternalImageToTexture({ source, origin: [0, y] }, target, [width, height]);
      y += height;
    });
  }

  /** Depth cannot be written, only drawn. @param {GPUTexture} from @param {GPUTexture} to @param {number} layers */
  fillDepth(from, to, layers) {
    const device = this.device,
      module = device.createShaderModule({ code: FILL_DEPTH }),
      encoder = device.createCommandEncoder();
    const resource = from.createView({ dimension: "2d-array" });
    for (let layer = 0; layer < layers; layer++) {
      const pipeline = device.createRenderPipeline({
        layout: "auto",
        vertex: { module },
        fragment: { module, targets: [], constants: { LAYER: layer } },
        depthStencil: { format: "depth32float", depthWriteEnabled: true, depthCompare: "always" },
      });
      const view = to.createView({ dimension: "2d", baseArrayLayer: layer, arrayLayerCount: 1 });
      const pass = encoder.beginRenderPass({
        colorAttachments: [],
        depthStencilAttachment: { view, depthClearValue: 0, depthLoadOp: "clear", depthStoreOp: "store" },
      });
      const layout = pipeline.getBindGroupLayout(0);
      pass.setPipeline(pipeline);
      pass.setBindGroup(0, device.createBindGroup({ layout, entries: [{ binding: 0, resource }] }));
      pass.draw(3);
      pass.end();
    }
    device.queue.submit([encoder.finish()]);
  }

  /** Make the textures of a size, all views and all groups. @param {number} width @param {number} height */
  fit(width, height) {
    const { made, device } = this,
      isOther = width !== this.width || height !== this.height,
      wide = wholeWindow([width, height]);
    const counted = (/** @type {string} */ kind) =>
      /** @type {any[]} */ (this.manifest.tables[kind]).slice(0, this.counts[kind]);
    [this.width, this.height] = [width, height];
    counted("texture").forEach((one, at) => {
      if (one.data || (made.texture[at] && !isOther)) return;
      made.texture[at]?.destroy();
      /** @type {(number | string)[]} */
      const sides = one.size,
        size = sides.map((n, i) => (n === CANVAS ? [width, height][i] : n === MIRROR ? wide[i] : n));
      made.texture[at] = device.createTexture({ ...one, size });
    });
    made.view = counted("view").map(({ texture, ...one }) => made.texture[texture].createView(one));
    const resourceOf = (/** @type {any} */ { buffer, view, sampler }) =>
      made.view[view] ?? made.sampler[sampler] ?? { buffer: made.buffer[buffer] };
    made.bind_group = counted("bind_group").map((one) => {
      const entries = one.entries.map((/** @type {any} */ entry) => ({ ...entry, resource: resourceOf(entry) }));
      return device.createBindGroup({ layout: made.bind_group_layout[one.layout], entries });
    });
  }
}
