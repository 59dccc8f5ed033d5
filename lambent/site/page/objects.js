// The objects of WebGPU that a manifest describes, and their contents.

import { BLOCKS, blocksLike, enlarged, readText } from "./loading.js";
import { wholeWindow } from "./mirrors.js";

/** @typedef {import("./loading.js").Data} Data */

export const CANVAS = "canvas";
const AT_ONCE = 4; // files on their way: enough to fill a line, so few that the first is there first
const MIRROR = "mirror"; // size of the buffers of mirrored views
const WORDS = ["rgb10a2unorm", "rgb9e5ufloat", "depth32float"]; // of 4 bytes a texel

/** Bytes of a block, and its texels a side. @param {string} format @returns {[number, number]} */
function blockOf(format) {
  if (format === BLOCKS) return [16, 4];
  const parts = WORDS.includes(format) ? null : /^([rgba]+)(8|16|32)/.exec(format);
  return [parts ? (parts[1].length * Number(parts[2])) / 8 : 4, 1];
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
  /** @param {any} manifest @param {GPUDevice} device */
  constructor(manifest, device) {
    this.manifest = manifest;
    this.device = device;
    /** @type {Record<string, any[]>} */
    this.made = {};
    /** @type {Record<string, number>} how many are made, by kind */
    this.counts = {};
    this.width = this.height = 0;
    /** @type {Record<string, Record<string, any>>} contents other than the tables say, by kind and place */
    this.changed = {};
    /** @type {Set<number>} places of textures that stand-ins fill */
    this.coarse = new Set();
    /** @type {Promise<any>} none of them is left */
    this.refined = Promise.resolve();
    /** @type {Promise<void>} one state's objects are made after another's */
    this.loaded = Promise.resolve();
    this.leave = () => {}; // called before contents become another state's, to undo what else wrote into them
  }

  /**
   * Make the objects that a state counts, and write the contents in which it differs; false if another is wanted meanwhile.
   * @param {Record<string, number>} counts @param {Record<string, Record<string, any>>} changes @param {Data} data
   * @param {() => boolean} isWanted
   */
  async show(counts, changes, data, isWanted) {
    const load = () => this.load(counts, data);
    await (this.loaded = this.loaded.then(load, load));
    /** @type {[string, number, any][]} kind, place and data of what differs from what is shown */
    const differ = [];
    for (const [kind, places] of Object.entries(this.changed)) {
      for (const at of Object.keys(places)) differ.push([kind, Number(at), this.manifest.tables[kind][at].data]);
    }
    for (const [kind, places] of Object.entries(changes)) {
      for (const [at, piece] of Object.entries(places)) differ.push([kind, Number(at), piece]);
    }
    const contents = await Promise.all(differ.map(([, , piece]) => data.read(piece)));
    if (!isWanted()) return false;
    this.leave();
    differ.forEach(([kind, at], i) => this.write(kind, at, contents[i]));
    this.changed = changes;
    return true;
  }

  /** Make the objects of the tables up to these counts. @param {Record<string, number>} counts @param {Data} data */
  async load(counts, data) {
    const { device, made } = this;
    /** @param {string} kind @returns {any[]} */
    const lacking = (kind) => (this.manifest.tables[kind] ?? []).slice(made[kind]?.length ?? 0, counts[kind] ?? 0);
    /** @param {string} kind @param {any[]} found */
    const add = (kind, found) => (made[kind] = [...(made[kind] ?? []), ...found]);
    const [modules, buffers, textures] = await Promise.all([
      Promise.all(lacking("shader_module").map((one) => readText(one.file))),
      Promise.all(lacking("buffer").map((one) => (one.data ? data.read(one.data) : null))),
      Promise.all(lacking("texture").map((one) => (one.data ? data.read(one.data.standin ?? one.data) : null))),
    ]);
    const shaders = modules.map((code) => device.createShaderModule({ code }));
    add("shader_module", shaders);
    for (const [kind, contents] of Object.entries({ buffer: buffers, texture: textures })) {
      const first = made[kind]?.length ?? 0,
        ones = lacking(kind).map((one) => (one.data || kind === "buffer" ? this.create(kind, one) : null));
      add(kind, ones);
      contents.forEach((content, i) => content && this.begin(kind, first + i, content));
    }
    const inPlaces = (/** @type {any} */ one) => ({ ...one, module: made.shader_module[one.module] });
    /** @type {[string, (one: any) => any][]} */
    const makers = [
      ["sampler", (one) => device.createSampler(one)],
      ["bind_group_layout", (one) => device.createBindGroupLayout(one)],
      [
        "pipeline_layout",
        ({ bindGroupLayouts: places }) =>
          device.createPipelineLayout({
            bindGroupLayouts: places.map((/** @type {number} */ at) => made.bind_group_layout[at]),
          }),
      ],
      [
        "render_pipeline",
        ({ layout, vertex, fragment, ...one }) =>
          device.createRenderPipelineAsync({
            ...one,
            layout: made.pipeline_layout[layout],
            vertex: inPlaces(vertex),
            ...(fragment ? { fragment: inPlaces(fragment) } : {}),
          }),
      ],
    ];
    for (const [kind, make] of makers) add(kind, await Promise.all(lacking(kind).map(make)));
    this.counts = counts;
  }

  /** Write the first content, of a texture that of its stand-in. @param {string} kind @param {number} at @param {any} content */
  begin(kind, at, content) {
    const { data, size, format, mipLevelCount = 1 } = this.manifest.tables[kind][at];
    if (!data.standin) return this.write(kind, at, content);
    const { finest } = data.standin;
    const isInBlocks = format === BLOCKS;
    const whole = isInBlocks
      ? blocksLike(content, size, mipLevelCount, finest)
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
    const isDepth = one.format === "depth32float";
    const target = isDepth
      ? this.device.createTexture({
          size: one.size,
          format: "r32float",
          usage: GPUTextureUsage.COPY_DST | GPUTextureUsage.TEXTURE_BINDING,
        })
      : made;
    const [bytes, side] = blockOf(one.format);
    const [width, height, layers = 1] = one.size;
    for (let level = 0, offset = 0; level < (one.mipLevelCount ?? 1); level++) {
      const columns = Math.ceil(Math.max(1, width >> level) / side),
        rows = Math.ceil(Math.max(1, height >> level) / side);
      this.device.queue.writeTexture(
        { texture: target, mipLevel: level },
        content,
        { offset, bytesPerRow: columns * bytes, rowsPerImage: rows },
        [columns * side, rows * side, layers],
      );
      offset += columns * rows * bytes * layers;
    }
    if (isDepth) this.fillDepth(target, made, layers);
  }

  /** The levels of a picture, one below the other. @param {any} one @param {GPUTexture} to @param {ImageBitmap} source */
  copy(one, to, source) {
    const [width, height] = one.size;
    for (let level = 0, y = 0; level < (one.mipLevelCount ?? 1); level++) {
      const size = [Math.max(1, width >> level), Math.max(1, height >> level)];
      const target = { texture: to, mipLevel: level };
      this.device.queue.copyExternalImageToTexture({ source, origin: [0, y] }, target, size);
      y += size[1];
    }
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
    const { made, device, counts } = this,
      tables = this.manifest.tables;
    const isOther = width !== this.width || height !== this.height;
    [this.width, this.height] = [width, height];
    const { wide } = wholeWindow([width, height]);
    tables.texture.slice(0, counts.texture).forEach((/** @type {any} */ one, /** @type {number} */ at) => {
      if (one.data || (made.texture[at] && !isOther)) return;
      made.texture[at]?.destroy();
      const size = one.size.map((/** @type {any} */ n, /** @type {number} */ i) =>
        n === CANVAS ? [width, height][i] : n === MIRROR ? wide[i] : n,
      );
      made.texture[at] = device.createTexture({ ...one, size });
    });
    made.view = tables.view
      .slice(0, counts.view)
      .map((/** @type {any} */ { texture, ...one }) => made.texture[texture].createView(one));
    made.bind_group = tables.bind_group.slice(0, counts.bind_group).map((/** @type {any} */ one) =>
      device.createBindGroup({
        layout: made.bind_group_layout[one.layout],
        entries: one.entries.map((/** @type {any} */ { binding, buffer, view, sampler }) => ({
          binding,
          resource: made.view[view] ?? made.sampler[sampler] ?? { buffer: made.buffer[buffer] },
        })),
      }),
    );
  }
}
