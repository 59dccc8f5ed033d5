// Draws the frame of a manifest.

import { frameOf } from "./camera.js";
import { Clusters, within } from "./culling.js";
import { SiteError } from "./loading.js";
import { mirroredViews } from "./mirrors.js";
import { CANVAS, Objects } from "./objects.js";

/** @import { Camera } from "./camera.js" */
/** @import { Runs } from "./culling.js" */
/** @import { Data } from "./loading.js" */
/** @import { View } from "./mirrors.js" */
/** @import { Vector } from "./vectors.js" */
/** @typedef {"moving" | "plain" | number} Kind with or without averaged edges, or the number of a frame at rest */

const TURNS = 64, // of interleaved samples
  REST = 64, // frames, after which a picture at rest is done: as many turns have interleaved samples
  SMOOTH_MS = 50, // a frame that takes longer has no averaged edges
  REFINED_MS = 250; // and one that takes longer is not refined at rest

const DRAWN = 0x11; // GPUTextureUsage.RENDER_ATTACHMENT | COPY_SRC, not there without WebGPU

/** The inverse of a number's digits. @param {number} n @param {number} base */
function radicalInverse(n, base) {
  let found = 0;
  for (let digit = 1 / base; n > 0; n = Math.floor(n / base), digit /= base) found += (n % base) * digit;
  return found;
}

/** Commands in order: panes from the farthest to the nearest. @param {any[]} commands @param {number[]} eye @returns {any[]} */
function sorted(commands, eye) {
  const first = commands.findIndex(([name]) => name === "pane");
  if (first < 0) return commands;
  const panes = /** @type {{awayM: number, commands: any[]}[]} */ ([]);
  for (const one of commands.slice(first)) {
    if (one[0] === "pane") {
      panes.push({ awayM: Math.hypot(one[1] - eye[0], one[2] - eye[1], one[3] - eye[2]), commands: [] });
    } else panes[panes.length - 1].commands.push(one);
  }
  panes.sort((a, b) => b.awayM - a.awayM);
  return [...commands.slice(0, first), ...panes.flatMap((pane) => pane.commands)];
}

/** The frame of a manifest. `open` makes one. */
export class Frame {
  width = 0;
  height = 0;
  asked = 0;
  state = 0;
  clusters = new Clusters(new Uint32Array(0), new Float32Array(0));
  /** @type {Float32Array[]} of reflectors' triangles */ corners = [];
  fastestMs = Infinity;
  rest = 0; // frames that the picture at rest is the mean of
  shown = ""; // what it shows
  /** @type {(state: number) => void} called when another state is shown */ entered = () => {};
  finer = () => {}; // called when a state can be drawn, and when finer content has arrived

  /** @param {any} manifest @param {GPUDevice} device @param {HTMLCanvasElement} canvas */
  constructor(manifest, device, canvas) {
    this.manifest = manifest;
    this.device = device;
    this.canvas = canvas;
    const context = canvas.getContext("webgpu");
    if (!context) throw new SiteError("This browser shows no WebGPU in a page.");
    this.context = context;
    context.configure({ device, format: "rgba8unorm", alphaMode: "opaque", usage: DRAWN });
    this.objects = new Objects(manifest, device);
    this.exposureEv = manifest.exposureEv;
    this.viewTransform = manifest.viewTransform;
  }

  /** @param {any} manifest @param {GPUDevice} device @param {HTMLCanvasElement} canvas @param {Data} data @param {number} number of the state @param {(frame: Frame) => void} finer */
  static async open(manifest, device, canvas, data, number = 0, finer = () => {}) {
    const frame = new Frame(manifest, device, canvas);
    const { clusters, mirrors } = manifest,
      pieces = [clusters.places, clusters.sizes, ...mirrors.corners];
    const [places, sizes, ...corners] = /** @type {ArrayBuffer[]} */ (
      await Promise.all(pieces.map((piece) => data.read(piece)))
    );
    frame.clusters = new Clusters(new Uint32Array(places), new Float32Array(sizes));
    frame.corners = corners.map((one) => new Float32Array(one));
    frame.finer = () => {
      frame.shown = "";
      finer(frame);
    };
    await frame.show(number, data);
    return frame;
  }

  /** Show a state of the room: with stand-ins, once what it needs has arrived; then exactly. @param {number} number @param {Data} data */
  async show(number, data) {
    const { counts, changes, finer } = this.manifest.states[number],
      wanted = ++this.asked;
    if (!(await this.objects.show(counts, changes, data, () => wanted === this.asked))) return;
    [this.state, this.shown] = [number, ""];
    if (this.width) this.objects.fit(this.width, this.height);
    this.entered(number);
    this.finer();
    await this.objects.refine(finer, data, this.finer);
  }

  /** Follow the size of the canvas. @param {number} width @param {number} height */
  resize(width, height) {
    if (width === this.width && height === this.height) return;
    [this.canvas.width, this.canvas.height] = [width, height];
    [this.width, this.height, this.shown] = [width, height, ""];
    this.objects.fit(width, height);
  }

  /** Show a camera on the canvas, better with each frame in which nothing changes; whether another one is better still. @param {Camera} camera */
  async present(camera) {
    const shows = JSON.stringify([camera, this.exposureEv, this.viewTransform]),
      startedMs = performance.now();
    const rests = shows === this.shown && this.fastestMs < REFINED_MS;
    if (rests && this.rest === REST) return false;
    this.rest = rests ? this.rest + 1 : 0;
    this.draw(camera, this.context.getCurrentTexture(), rests ? this.rest - 1 : undefined);
    this.shown = shows;
    await this.device.queue.onSubmittedWorkDone().catch(() => undefined); // of a lost device, which comes back
    this.fastestMs = Math.min(this.fastestMs, performance.now() - startedMs);
    return this.fastestMs < REFINED_MS && this.rest < REST;
  }

  /** Draw into a texture of the canvas' size and format. @param {Camera} camera @param {GPUTexture} target @param {Kind} kind */
  draw(camera, target, kind = this.fastestMs < SMOOTH_MS ? "moving" : "plain") {
    const { manifest, device } = this,
      views = this.views(camera, kind),
      encoder = device.createCommandEncoder(),
      canvas = target.createView();
    const frame = manifest.states[this.state].frames[typeof kind === "string" ? kind : kind % 2 ? "odd" : "even"],
      passes = frame.map((/** @type {number} */ at) => manifest.passes[at]);
    let mirrors = true; // in the place of their first pass, all passes of the first mirrored view, of the second...
    for (const one of passes) {
      if (one.view === undefined) this.encode(encoder, one, canvas, views);
      else if (mirrors) {
        mirrors = false;
        for (const view of views.mirrored) {
          for (const each of passes) if (each.view === view.number) this.encode(encoder, each, canvas, views, view);
        }
      }
    }
    device.queue.submit([encoder.finish()]);
  }

  /**
   * Write the records of all cameras of a frame; returns what each sees, by the place of its record.
   * @param {Camera} camera @param {Kind} kind
   */
  views(camera, kind) {
    const { manifest, width, height } = this,
      { buffer, bytes, offsets, nearM, places, weight } = manifest.frame,
      { mirrors } = manifest;
    const index = typeof kind === "number" ? kind : -1,
      turn = index < 0 ? 0.5 : radicalInverse(index + 1, 2),
      jitter = index < 0 ? [0, 0] : [turn - 0.5, radicalInverse(index + 1, 3) - 0.5];
    const main = frameOf(camera, width, height, nearM, jitter);
    const base = new Uint8Array(bytes);
    const eye = [...main.eye, Math.floor(turn * TURNS) % TURNS],
      exposure = [2 ** this.exposureEv * manifest.unit];
    new Uint32Array(base.buffer)[offsets.view_transform / 4] = this.viewTransform;
    this.record(buffer, base, offsets, { ...main, eye, exposure });
    if (index >= 0)
      this.device.queue.writeBuffer(this.objects.made.buffer[weight], 0, new Float32Array([1 / (index + 1)]));
    /** @type {Map<number, {clip: number[][], eye: Vector, visible: Uint8Array, seen: Runs, thin: Runs | null}>} */
    const seen = new Map();
    const look = (/** @type {number} */ at, /** @type {number[][]} */ clip, /** @type {Vector} */ eye) => {
      const visible = this.clusters.visible(clip);
      seen.set(at, { clip, eye, visible, seen: this.clusters.runs(visible), thin: null });
    };
    look(buffer, main.rows, main.eye);
    for (const place of kind === "moving" ? places : []) {
      const { rows, clip_from_world, forward } = frameOf(camera, width, height, nearM, place.jitter);
      this.record(place.buffer, base, offsets, { clip_from_world, forward });
      look(place.buffer, rows, main.eye);
    }
    const { m } = manifest.states[this.state];
    const mirrored = mirroredViews(mirrors.reflectors, this.corners, m, main, [width, height], mirrors.most);
    for (const view of mirrored) {
      const at = mirrors.buffers[view.number];
      this.record(at.frame, base, offsets, view.frame);
      this.record(at.view, new Uint8Array(mirrors.bytes), mirrors.offsets, view.view);
      if (view.plan) this.record(at.plan, new Uint8Array(mirrors.planBytes), mirrors.planOffsets, view.plan);
      look(at.frame, view.clip, view.frame.eye);
    }
    return { seen, mirrored };
  }

  /** Write a record: floats by the names of its fields. @param {number} at @param {Uint8Array<ArrayBuffer>} bytes as before, kept @param {Record<string, number>} offsets @param {Record<string, any>} fields */
  record(at, bytes, offsets, fields) {
    const record = new Float32Array(bytes.buffer);
    for (const [name, values] of Object.entries(fields)) if (name in offsets) record.set(values, offsets[name] / 4);
    this.device.queue.writeBuffer(this.objects.made.buffer[at], 0, bytes);
  }

  /** @param {GPUCommandEncoder} encoder @param {any} one pass @param {GPUTextureView} canvas @param {ReturnType<Frame["views"]>} views @param {View} [view] */
  encode(encoder, one, canvas, views, view) {
    const { made } = this.objects,
      depth = one.depthStencilAttachment,
      camera = views.seen.get(one.camera);
    const attached = (/** @type {any} */ a) => ({ ...a, view: a.view === CANVAS ? canvas : made.view[a.view] });
    const pass = encoder.beginRenderPass({
      colorAttachments: one.colorAttachments.map(attached),
      ...(depth ? { depthStencilAttachment: attached(depth) } : {}),
    });
    if (view && one.camera === this.manifest.mirrors.buffers[view.number].frame) {
      pass.setViewport(0, 0, view.view.size[0], view.view.size[1], 0, 1);
    }
    /** @type {Map<string, () => void>} what is set before the next draw: most of it is for objects out of view */
    const set = new Map();
    const draw = (/** @type {() => void} */ how) => {
      for (const one of set.values()) one();
      set.clear();
      how();
    };
    for (const [name, first, second, third] of camera ? sorted(one.commands, camera.eye) : one.commands) {
      if (name === "setPipeline") set.set(name, () => pass.setPipeline(made.render_pipeline[first]));
      else if (name === "setBindGroup") set.set(name + first, () => pass.setBindGroup(first, made.bind_group[second]));
      else if (name === "setVertexBuffer") set.set(name, () => pass.setVertexBuffer(first, made.buffer[second]));
      else if (name === "setIndexBuffer") set.set(name, () => pass.setIndexBuffer(made.buffer[first], second));
      else if (name === "draw") draw(() => pass.draw(first));
      else if (name === "onlyUpright") {
        if (!view?.upright) break;
      } else if (camera) {
        if (name === "drawThin")
          camera.thin ??= this.clusters.runs(this.clusters.thin(camera.clip, this.height, camera.visible));
        const runs = name === "drawThin" ? /** @type {Runs} */ (camera.thin) : camera.seen;
        for (const [face, count] of within(runs, third / 3, first / 3))
          draw(() => pass.drawIndexed(3 * count, 1, 3 * face));
      }
    }
    pass.end();
  }

  /** The picture of a camera, (height, width, 4) bytes: at rest, if there is time. @param {Camera} camera @param {Kind[]} kinds of frames, one after the other */
  async pixels(camera, ...kinds) {
    const { device, width, height } = this,
      row = Math.ceil((4 * width) / 256) * 256;
    const target = device.createTexture({ size: [width, height], format: "rgba8unorm", usage: DRAWN });
    const readable = GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ,
      buffer = device.createBuffer({ size: row * height, usage: readable });
    if (!kinds.length) kinds = this.fastestMs < REFINED_MS ? [...Array(REST).keys()] : ["plain"];
    for (const kind of kinds) this.draw(camera, target, kind);
    this.shown = ""; // means are of this picture now
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
