// Makes the objects of a manifest on a device, and draws its frame.

import { readText, SiteError } from "./loading.js";
import { frameOf } from "./camera.js";

const CANVAS = "canvas";
const WORDS = ["rgb10a2unorm", "rgb9e5ufloat", "depth32float"]; // of 4 bytes a texel

/** Bytes of a block, and its texels a side. @param {string} format @returns {[number, number]} */
function blockOf(format) {
  if (format === "bc6h-rgb-ufloat") return [16, 4];
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

/** What a browser lacks, in a line; null if nothing. @param {any} manifest @param {GPUAdapter} adapter */
function lacking(manifest, adapter) {
  const blocks = manifest.tables.texture.some((/** @type {any} */ one) => one.format.startsWith("bc"));
  return blocks && !adapter.features.has("texture-compression-bc") ? "compressed textures (BC)" : null;
}

/** @param {any} manifest @returns {Promise<GPUDevice>} */
export async function openDevice(manifest) {
  const adapter = await navigator.gpu?.requestAdapter({ powerPreference: "high-performance" });
  if (!adapter)
    throw new SiteError("This browser has no WebGPU: Chrome, Edge or Safari of 2025 or later show the room.");
  const lack = lacking(manifest, adapter);
  if (lack) throw new SiteError(`This graphics adapter has no ${lack}.`);
  /** @type {GPUFeatureName[]} */
  const wanted = ["texture-compression-bc", "float32-filterable"];
  const most = Math.max(...manifest.tables.buffer.map((/** @type {any} */ one) => one.size), 1 << 27);
  return adapter.requestDevice({
    requiredFeatures: wanted.filter((one) => adapter.features.has(one)),
    requiredLimits: {
      maxBufferSize: Math.min(Math.max(most, 256 << 20), adapter.limits.maxBufferSize),
      maxStorageBufferBindingSize: Math.min(most, adapter.limits.maxStorageBufferBindingSize),
      maxTextureDimension2D: adapter.limits.maxTextureDimension2D,
    },
  });
}

/** The frame of a manifest. `open` makes one. */
export class Frame {
  /** @param {any} manifest @param {GPUDevice} device @param {HTMLCanvasElement} canvas */
  constructor(manifest, device, canvas) {
    this.manifest = manifest;
    this.device = device;
    this.canvas = canvas;
    const context = canvas.getContext("webgpu");
    if (!context) throw new SiteError("This browser shows no WebGPU in a page.");
    this.context = context;
    const usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC;
    context.configure({ device, format: "rgba8unorm", alphaMode: "opaque", usage });
    this.bytes = new Uint8Array(manifest.frame.bytes);
    /** @type {Record<string, any[]>} objects by kind and place */
    this.made = {};
    this.width = this.height = this.asked = 0;
    /** @type {Record<string, number>} objects that are made, by kind */
    this.counts = {};
    /** @type {Record<string, Record<string, any>>} contents other than the tables say, by kind and place */
    this.changed = {};
    /** @type {any[]} */
    this.passes = [];
  }

  /** @param {any} manifest @param {GPUDevice} device @param {HTMLCanvasElement} canvas @param {import("./loading.js").Data} data */
  static async open(manifest, device, canvas, data) {
    const frame = new Frame(manifest, device, canvas);
    await frame.show(0, data);
    return frame;
  }

  /** Show a state of the room, once what it needs has arrived. @param {number} number @param {import("./loading.js").Data} data */
  async show(number, data) {
    const { counts, changes, passes } = this.manifest.states[number];
    const wanted = ++this.asked;
    await this.load(counts, data);
    /** @type {[string, number, any][]} kind, place and data of what differs from what is shown */
    const differ = [];
    for (const [kind, places] of Object.entries(this.changed)) {
      for (const at of Object.keys(places)) differ.push([kind, Number(at), this.manifest.tables[kind][at].data]);
    }
    for (const [kind, places] of Object.entries(changes)) {
      for (const [at, piece] of Object.entries(places)) differ.push([kind, Number(at), piece]);
    }
    const contents = await Promise.all(differ.map(([, , piece]) => data.read(piece)));
    if (wanted !== this.asked) return; // another state was asked for meanwhile
    differ.forEach(([kind, at], i) => this.write(kind, at, contents[i]));
    [this.changed, this.passes] = [changes, passes];
    if (this.width) this.fit(this.width, this.height);
  }

  /** Make the objects of the tables up to these counts. @param {Record<string, number>} counts @param {import("./loading.js").Data} data */
  async load(counts, data) {
    const { device, made } = this;
    /** @param {string} kind @returns {any[]} */
    const lacking = (kind) => (this.manifest.tables[kind] ?? []).slice(made[kind]?.length ?? 0, counts[kind] ?? 0);
    /** @param {string} kind @param {any[]} found */
    const add = (kind, found) => (made[kind] = [...(made[kind] ?? []), ...found]);
    const [modules, buffers, textures] = await Promise.all([
      Promise.all(lacking("shader_module").map((one) => readText(one.file))),
      Promise.all(lacking("buffer").map((one) => data.read(one.data))),
      Promise.all(lacking("texture").map((one) => (one.data ? data.read(one.data) : null))),
    ]);
    add(
      "shader_module",
      modules.map((code) => device.createShaderModule({ code })),
    );
    for (const [kind, contents] of /** @type {[string, (ArrayBuffer | ImageBitmap | null)[]][]} */ ([
      ["buffer", buffers],
      ["texture", textures],
    ])) {
      const ones = lacking(kind),
        first = made[kind]?.length ?? 0;
      add(
        kind,
        ones.map((one) => (one.data ? this.create(kind, one) : null)),
      );
      contents.forEach((content, i) => content && this.write(kind, first + i, content));
    }
    add(
      "sampler",
      lacking("sampler").map((one) => device.createSampler(one)),
    );
    add(
      "bind_group_layout",
      lacking("bind_group_layout").map((one) => device.createBindGroupLayout(one)),
    );
    add(
      "pipeline_layout",
      lacking("pipeline_layout").map((one) =>
        device.createPipelineLayout({
          bindGroupLayouts: one.bindGroupLayouts.map((/** @type {number} */ at) => made.bind_group_layout[at]),
        }),
      ),
    );
    add(
      "render_pipeline",
      await Promise.all(
        lacking("render_pipeline").map((one) =>
          device.createRenderPipelineAsync({
            ...one,
            layout: made.pipeline_layout[one.layout],
            vertex: { ...one.vertex, module: made.shader_module[one.vertex.module] },
            ...(one.fragment ? { fragment: { ...one.fragment, module: made.shader_module[one.fragment.module] } } : {}),
          }),
        ),
      ),
    );
    this.counts = counts;
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
      module = device.createShaderModule({ code: FILL_DEPTH });
    const layout = device.createBindGroupLayout({
      entries: [
        {
          binding: 0,
          visibility: GPUShaderStage.FRAGMENT,
          texture: { sampleType: "unfilterable-float", viewDimension: "2d-array" },
        },
      ],
    });
    const group = device.createBindGroup({
      layout,
      entries: [{ binding: 0, resource: from.createView({ dimension: "2d-array" }) }],
    });
    const encoder = device.createCommandEncoder();
    for (let layer = 0; layer < layers; layer++) {
      const pipeline = device.createRenderPipeline({
        layout: device.createPipelineLayout({ bindGroupLayouts: [layout] }),
        vertex: { module, entryPoint: "corner" },
        fragment: { module, entryPoint: "fill", targets: [], constants: { LAYER: layer } },
        depthStencil: { format: "depth32float", depthWriteEnabled: true, depthCompare: "always" },
      });
      const pass = encoder.beginRenderPass({
        colorAttachments: [],
        depthStencilAttachment: {
          view: to.createView({ dimension: "2d", baseArrayLayer: layer, arrayLayerCount: 1 }),
          depthClearValue: 0,
          depthLoadOp: "clear",
          depthStoreOp: "store",
        },
      });
      pass.setPipeline(pipeline);
      pass.setBindGroup(0, group);
      pass.draw(3);
      pass.end();
    }
    device.queue.submit([encoder.finish()]);
  }

  /** Follow the size of the canvas. @param {number} width @param {number} height */
  resize(width, height) {
    if (width === this.width && height === this.height) return;
    [this.canvas.width, this.canvas.height] = [width, height];
    this.fit(width, height);
  }

  /** Make the textures of a size, all views and all groups. @param {number} width @param {number} height */
  fit(width, height) {
    const { made, device, counts } = this,
      tables = this.manifest.tables;
    const isOther = width !== this.width || height !== this.height;
    [this.width, this.height] = [width, height];
    tables.texture.slice(0, counts.texture).forEach((/** @type {any} */ one, /** @type {number} */ at) => {
      if (one.data || (made.texture[at] && !isOther)) return;
      made.texture[at]?.destroy();
      const size = one.size.map((/** @type {any} */ n, /** @type {number} */ i) =>
        n === CANVAS ? [width, height][i] : n,
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
          resource:
            buffer !== undefined
              ? { buffer: made.buffer[buffer] }
              : view !== undefined
                ? made.view[view]
                : made.sampler[sampler],
        })),
      }),
    );
  }

  /**
   * Draw into the canvas, or into a texture of its size and format.
   * @param {import("./camera.js").Camera} camera @param {number} exposureEv @param {GPUTexture} target
   */
  draw(camera, exposureEv, target = this.context.getCurrentTexture()) {
    const { manifest, device, made } = this,
      { offsets, buffer, nearM } = manifest.frame;
    const fields = { ...frameOf(camera, this.width, this.height, nearM), exposure: [2 ** exposureEv * manifest.unit] };
    const record = new DataView(this.bytes.buffer);
    for (const [name, values] of Object.entries(fields)) {
      values.forEach((value, i) => record.setFloat32(offsets[name] + 4 * i, value, true));
    }
    device.queue.writeBuffer(made.buffer[buffer], 0, this.bytes);
    const encoder = device.createCommandEncoder(),
      canvas = target.createView();
    for (const one of this.passes) {
      const depth = one.depthStencilAttachment;
      const pass = encoder.beginRenderPass({
        colorAttachments: one.colorAttachments.map((/** @type {any} */ a) => ({
          ...a,
          view: a.view === CANVAS ? canvas : made.view[a.view],
        })),
        ...(depth ? { depthStencilAttachment: { ...depth, view: made.view[depth.view] } } : {}),
      });
      for (const [name, first, second, third] of one.commands) {
        if (name === "setPipeline") pass.setPipeline(made.render_pipeline[first]);
        else if (name === "setBindGroup") pass.setBindGroup(first, made.bind_group[second]);
        else if (name === "setVertexBuffer") pass.setVertexBuffer(first, made.buffer[second]);
        else if (name === "setIndexBuffer") pass.setIndexBuffer(made.buffer[first], second);
        else if (name === "drawIndexed") pass.drawIndexed(first, second, third);
        else pass.draw(first);
      }
      pass.end();
    }
    device.queue.submit([encoder.finish()]);
  }

  /** The picture of a camera, (height, width, 4) bytes. @param {import("./camera.js").Camera} camera @param {number} exposureEv */
  async pixels(camera, exposureEv) {
    const { device, width, height } = this,
      row = Math.ceil((4 * width) / 256) * 256;
    const usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC;
    const target = device.createTexture({ size: [width, height], format: "rgba8unorm", usage });
    const buffer = device.createBuffer({
      size: row * height,
      usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ,
    });
    this.draw(camera, exposureEv, target);
    const encoder = device.createCommandEncoder();
    encoder.copyTextureToBuffer({ texture: target }, { buffer, bytesPerRow: row }, [width, height]);
    device.queue.submit([encoder.finish()]);
    await buffer.mapAsync(GPUMapMode.READ);
    const padded = new Uint8Array(buffer.getMappedRange()),
      packed = new Uint8ClampedArray(4 * width * height);
    for (let y = 0; y < height; y++) packed.set(padded.subarray(y * row, y * row + 4 * width), 4 * width * y);
    buffer.destroy();
    target.destroy();
    return packed;
  }
}
