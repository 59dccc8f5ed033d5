// The visitor: where they stand, what they hold, and the frame that shows it.

import { KEYS, look, walk } from "./camera.js";

/** @typedef {import("./camera.js").Camera} Camera */
/** @typedef {import("./frame.js").Frame} Frame */
/** @typedef {import("./loading.js").Data} Data */

const FAST = 3,
  DRAG_PX_S = 400, // of two fingers, for a second of walking
  DIGITS = 4;

/** The camera in the address of the page, or else the first. @param {Camera[]} cameras @returns {Camera} */
export function cameraOf(cameras) {
  const numbers = location.hash.slice(1).split(",").map(Number);
  if (numbers.length !== 7 || !numbers.every(Number.isFinite)) return cameras[0];
  const [x, y, z, tx, ty, tz, fovYDeg] = numbers;
  if (fovYDeg < 1 || fovYDeg > 170) return cameras[0];
  return { name: "free", position: [x, y, z], target: [tx, ty, tz], up: [0, 1, 0], fovYDeg };
}

export class Visit {
  /** @param {any} manifest @param {HTMLCanvasElement} canvas @param {Frame} frame @param {Data} data */
  constructor(manifest, canvas, frame, data) {
    this.manifest = manifest;
    this.canvas = canvas;
    this.frame = frame;
    this.data = data;
    this.camera = cameraOf(manifest.cameras);
    this.state = 0;
    /** @type {Set<string>} */
    this.held = new Set();
    /** @type {Map<number, {x: number, y: number}>} */
    this.pointers = new Map();
    this.fast = 1;
    this.lastMs = 0;
    this.requested = false;
    this.frames = 0;
  }

  /** Ask for a frame. */
  touch() {
    if (!this.requested) requestAnimationFrame((ms) => this.show(ms));
    this.requested = true;
  }

  /** @param {number} ms */
  show(ms) {
    this.requested = false;
    const ratio = window.devicePixelRatio || 1,
      { canvas } = this;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.max(1, Math.round(n * ratio)));
    this.frame.resize(width, height);
    if (this.held.size) {
      this.camera = walk(this.camera, this.held, (ms - this.lastMs) / 1e3, this.manifest.bounds, this.fast);
      this.touch();
    }
    this.lastMs = ms;
    this.frame.draw(this.camera);
    document.body.dataset.frames = String(++this.frames);
    document.body.dataset.camera = this.address();
  }

  /** The camera as the page's address has it. */
  address() {
    const { position, target, fovYDeg } = this.camera;
    return [...position, ...target, fovYDeg].map((x) => +x.toFixed(DIGITS)).join(",");
  }

  /** @param {Camera} camera */
  go(camera) {
    this.camera = camera;
    this.touch();
  }

  /** Show a state of the room, once what it needs has arrived. @param {number} number */
  async choose(number) {
    this.state = number;
    await this.frame.show(number, this.data);
    document.body.dataset.state = this.manifest.states[number].name;
    this.touch();
  }

  follow() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    for (const end of /** @type {const} */ (["pointerup", "pointercancel"])) {
      canvas.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
    }
    window.addEventListener("keydown", (event) => this.press(event));
    window.addEventListener("keyup", (event) => this.held.delete(keyOf(event)));
    window.addEventListener("blur", () => this.held.clear());
    window.addEventListener("hashchange", () => this.go(cameraOf(this.manifest.cameras)));
    new ResizeObserver(() => this.touch()).observe(canvas);
  }

  /** One finger or the mouse looks, two fingers walk. @param {PointerEvent} event */
  drag(event) {
    const last = this.pointers.get(event.pointerId);
    if (!last) return;
    const [dx, dy] = [event.clientX - last.x, event.clientY - last.y];
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (this.pointers.size === 1) return this.go(look(this.camera, dx, dy));
    const far = Math.hypot(dx, dy);
    if (far) this.go(walk(this.camera, [], far / DRAG_PX_S, this.manifest.bounds, FAST, [-dx / far, dy / far]));
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    this.fast = event.shiftKey ? FAST : 1;
    const key = keyOf(event);
    if (!(key in KEYS) || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target instanceof Element && event.target.closest("input, select")) return; // they use the arrows
    event.preventDefault();
    if (!this.held.size) this.lastMs = performance.now();
    this.held.add(key);
    this.touch();
  }
}

/** @param {KeyboardEvent} event */
const keyOf = (event) => (event.key.length === 1 ? event.key.toLowerCase() : event.key);
