// The page: loads the room, shows it, and follows the visitor.

import { KEYS, look, walk } from "./camera.js";
import { openDevice } from "./device.js";
import { Frame } from "./frame.js";
import { Data, readManifest, SiteError } from "./loading.js";

/** @typedef {import("./camera.js").Camera} Camera */

const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById("picture"));
const message = /** @type {HTMLElement} */ (document.getElementById("message"));
const share = /** @type {HTMLButtonElement} */ (document.getElementById("share"));
const MB = 1e6,
  FAST = 3,
  DRAG_PX_S = 400, // of two fingers, for a second of walking
  DIGITS = 4;

/** The camera in the address of the page, or else the first. @param {Camera[]} cameras @returns {Camera} */
function cameraOf(cameras) {
  const numbers = location.hash.slice(1).split(",").map(Number);
  if (numbers.length !== 7 || !numbers.every(Number.isFinite)) return cameras[0];
  const [x, y, z, tx, ty, tz, fovYDeg] = numbers;
  if (fovYDeg < 1 || fovYDeg > 170) return cameras[0];
  return { name: "free", position: [x, y, z], target: [tx, ty, tz], up: [0, 1, 0], fovYDeg };
}

/** The visitor: where they stand, what they hold, and the frame that shows it. */
class Visit {
  /** @param {any} manifest @param {Frame} frame */
  constructor(manifest, frame) {
    this.manifest = manifest;
    this.frame = frame;
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
    const ratio = window.devicePixelRatio || 1;
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

  follow() {
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
    event.preventDefault();
    if (!this.held.size) this.lastMs = performance.now();
    this.held.add(key);
    this.touch();
  }
}

/** @param {KeyboardEvent} event */
const keyOf = (event) => (event.key.length === 1 ? event.key.toLowerCase() : event.key);

/** Buttons of the room's states. @param {Visit} visit @param {Data} data */
function offerStates(visit, data) {
  const names = visit.manifest.states.map((/** @type {{name: string}} */ state) => state.name);
  const states = /** @type {HTMLElement} */ (document.getElementById("states"));
  states.hidden = names.length < 2;
  const buttons = names.map((/** @type {string} */ name, /** @type {number} */ number) => {
    const button = document.createElement("button");
    button.textContent = name;
    button.setAttribute("aria-pressed", String(number === visit.state));
    button.addEventListener("click", async () => {
      visit.state = number;
      buttons.forEach((/** @type {HTMLElement} */ one) => one.setAttribute("aria-pressed", String(one === button)));
      await visit.frame.show(number, data).catch(failed);
      message.textContent = fault ? message.textContent : "";
      document.body.dataset.state = name;
      visit.touch();
    });
    return button;
  });
  states.replaceChildren(...buttons);
}

/** Buttons of the scene's views, and the one that shares. @param {Visit} visit */
function offer(visit) {
  const views = /** @type {HTMLElement} */ (document.getElementById("views"));
  views.replaceChildren(
    ...visit.manifest.cameras.map((/** @type {Camera} */ camera) => {
      const button = document.createElement("button");
      button.textContent = camera.name;
      button.addEventListener("click", () => visit.go(camera));
      return button;
    }),
  );
  share.hidden = false;
  share.onclick = async () => {
    history.replaceState(null, "", `#${visit.address()}`);
    await navigator.clipboard?.writeText(location.href).catch(() => undefined);
  };
}

/** Load the room and show it; again after the graphics device was lost, where the visitor stands. @param {Camera} [at] */
async function open(at) {
  const manifest = await readManifest();
  document.title = manifest.name;
  const device = await openDevice(manifest);
  const { counts } = manifest.states[0];
  const pieces = ["buffer", "texture"].flatMap((kind) =>
    manifest.tables[kind].slice(0, counts[kind]).flatMap((/** @type {any} */ one) => one.data ?? []),
  );
  const all = [...new Map(pieces.map((piece) => [piece.file, piece.packed])).values()].reduce((a, b) => a + b, 0);
  const data = new Data((done) => {
    if (fault) return; // other files arrive after it
    const of = done > all ? "" : ` of ${(all / MB).toFixed(1)}`;
    message.textContent = `Loading ${(done / MB).toFixed(1)}${of} MB…`;
  });
  const frame = await Frame.open(manifest, device, canvas, data);
  if (visit) visit.frame = frame;
  else {
    visit = new Visit(manifest, frame);
    offer(visit);
    visit.follow();
  }
  if (at) visit.camera = at;
  offerStates(visit, data);
  if (visit.state) await frame.show(visit.state, data);
  device.lost.then((info) => {
    if (info.reason === "destroyed") return;
    message.textContent = "The graphics device was lost; loading the room again…";
    open(visit?.camera).catch(failed);
  });
  message.textContent = "";
  visit.touch();
}

/** @param {any} error */
function failed(error) {
  fault = error;
  message.textContent =
    error instanceof SiteError ? error.message : `The room cannot be shown: ${error.message ?? error}`;
  if (!(error instanceof SiteError)) throw error;
}

/** @type {Visit | undefined} */
let visit;
/** @type {any} */
let fault = null;
open().catch(failed);
