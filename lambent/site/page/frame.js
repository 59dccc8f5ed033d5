// Draws the frame of a manifest.

import { frameOf } from "./camera.js";
import { SiteError } from "./loading.js";
import { CANVAS, Objects } from "./objects.js";

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
    this.objects = new Objects(manifest, device);
    this.width = this.height = this.asked = 0;
    this.exposureEv = manifest.exposureEv;
    this.viewTransform = manifest.viewTransform;
    /** @type {any[]} */
    this.passes = [];
    this.finer = () => {}; // called when a state can be drawn, and when finer content has arrived
  }

  /** @param {any} manifest @param {GPUDevice} device @param {HTMLCanvasElement} canvas @param {import("./loading.js").Data} data @param {number} number of the state @param {(frame: Frame) => void} finer */
  static async open(manifest, device, canvas, data, number = 0, finer = () => {}) {
    const frame = new Frame(manifest, device, canvas);
    frame.finer = () => finer(frame);
    await frame.show(number, data);
    return frame;
  }

  /** Show a state of the room: with stand-ins, once what it needs has arrived; then exactly. @param {number} number @param {import("./loading.js").Data} data */
  async show(number, data) {
    const { counts, changes, passes, finer } = this.manifest.states[number],
      wanted = ++this.asked;
    if (!(await this.objects.show(counts, changes, data, () => wanted === this.asked))) return;
    this.passes = passes;
    if (this.width) this.objects.fit(this.width, this.height);
    this.finer();
    await this.objects.refine(finer, data, this.finer);
  }

  /** Follow the size of the canvas. @param {number} width @param {number} height */
  resize(width, height) {
    if (width === this.width && height === this.height) return;
    [this.canvas.width, this.canvas.height] = [width, height];
    [this.width, this.height] = [width, height];
    this.objects.fit(width, height);
  }

  /**
   * Draw into the canvas, or into a texture of its size and format.
   * @param {import("./camera.js").Camera} camera @param {GPUTexture} target
   */
  draw(camera, target = this.context.getCurrentTexture()) {
    const { manifest, device, exposureEv } = this,
      { made } = this.objects,
      { offsets, buffer, nearM } = manifest.frame;
    const fields = { ...frameOf(camera, this.width, this.height, nearM), exposure: [2 ** exposureEv * manifest.unit] };
    const record = new DataView(this.bytes.buffer);
    for (const [name, values] of Object.entries(fields)) {
      values.forEach((value, i) => record.setFloat32(offsets[name] + 4 * i, value, true));
    }
    record.setUint32(offsets.view_transform, this.viewTransform, true);
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

  /** The picture of a camera, (height, width, 4) bytes. @param {import("./camera.js").Camera} camera */
  async pixels(camera) {
    const { device, width, height } = this,
      row = Math.ceil((4 * width) / 256) * 256;
    const usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC;
    const target = device.createTexture({ size: [width, height], format: "rgba8unorm", usage });
    const buffer = device.createBuffer({
      size: row * height,
      usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ,
    });
    this.draw(camera, target);
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
