// The visitor: where they stand, what they see there, and the frame that shows it.

import { addressOf, cameraAddress, readAddress } from "./address.js";
import * as c from "./camera.js";
import { say, tellRest } from "./messages.js";
import { glide, isFloor, standingAt, turned } from "./moves.js";
import { along, minus } from "./vectors.js";

/** @import { Camera } from "./camera.js" */
/** @import { Frame } from "./frame.js" */
/** @import { Lights } from "./lights.js" */
/** @import { Data } from "./loading.js" */
/** @import { Motion } from "./moves.js" */
/** @import { Geometry, Hit, Thing } from "./picking.js" */
/** @import { Bounds, Vector } from "./vectors.js" */
/** @typedef {Hit & {thing: Thing, place: Vector, onFloor: boolean}} Found */

export const FAST = 3; // times the pace
const LARGE = 0.5, // radius / distance of things that orbit turns about the clicked point of, not about their middle
  PAD_PX_S = 400, // of a drag that turns as a whole deflection does
  PAD_NOTCHES_S = 6; // of a wheel

/** Fires `change` when what panel and card show has changed, `shown` after each frame, `light` when an address brings one. */
export class Visit extends EventTarget {
  /** @type {Frame | null} */ frame = null;
  /** @type {Data | null} */ data = null;
  /** @type {Geometry | null} */ geometry = null;
  /** @type {Lights | null} */ lights = null;
  /** @type {Found | null} what was clicked */ found = null;
  /** @type {Vector | null} the centre of orbit; null on foot */ pivot = null;
  /** @type {Motion | null} */ motion = null;
  /** @type {Set<string>} keys */ held = new Set();
  fast = 1;
  lastMs = 0;
  requested = false;
  frames = 0;

  /** @param {any} manifest @param {HTMLCanvasElement} canvas */
  constructor(manifest, canvas) {
    super();
    this.manifest = manifest;
    this.canvas = canvas;
    this.bounds = /** @type {Bounds} */ (manifest.bounds);
    const { camera, state, exposureEv, viewTransform, light } = readAddress(location.hash, manifest);
    this.camera = camera;
    this.state = state;
    this.exposureEv = exposureEv;
    this.viewTransform = viewTransform;
    this.light = light;
  }

  /** Show the room by a frame and its data. @param {Frame} frame @param {Data} data */
  take(frame, data) {
    Object.assign(this, { frame, data });
    this.changed();
  }

  changed() {
    this.dispatchEvent(new Event("change"));
    this.touch();
  }

  /** Ask for a frame. */
  touch() {
    if (!this.requested) requestAnimationFrame((ms) => this.show(ms));
    this.requested = true;
  }

  /** @param {number} ms */
  show(ms) {
    this.requested = false;
    const { canvas } = this,
      frame = this.exposed(),
      ratio = window.devicePixelRatio || 1;
    if (!frame) return;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.max(1, Math.round(n * ratio)));
    frame.resize(width, height);
    this.advance(Math.max(0, ms - this.lastMs) / 1e3);
    this.lastMs = ms;
    frame.present(this.camera).then((isBetter) => isBetter && this.touch());
    document.body.dataset.frames = String(++this.frames);
    document.body.dataset.camera = cameraAddress(this.camera);
    this.dispatchEvent(new Event("shown"));
  }

  /** The frame, with the visitor's exposure and view transform. */
  exposed() {
    const { frame, exposureEv, viewTransform } = this;
    return frame && Object.assign(frame, { exposureEv, viewTransform });
  }

  /** @param {number} dtS */
  advance(dtS) {
    const { motion } = this;
    if (motion) {
      motion.timeS += dtS;
      this.camera = motion.at(motion.timeS);
      if (motion.timeS < motion.seconds) this.touch();
      else this.stop();
    } else if (this.held.size) {
      this.step(c.pushOf(this.held), dtS, this.fast);
    }
  }

  /** Walk, or nearer and around in orbit. @param {[number, number]} push right, forward @param {number} dtS @param {number} fast */
  step(push, dtS, fast = 1) {
    const { camera, bounds } = this;
    if (this.pivot) {
      this.turn(-PAD_PX_S * dtS * push[0], 0);
      this.zoom(PAD_NOTCHES_S * dtS * push[1]);
    } else {
      const floorY = this.geometry?.floorBelow(camera.position, c.eyeHeightOf(bounds));
      this.go(c.walk(camera, push, dtS, bounds, fast, floorY));
    }
  }

  /** Look around, or turn about the centre of orbit. @param {number} dx px @param {number} dy px */
  turn(dx, dy) {
    const { camera, pivot, bounds, geometry } = this;
    this.go(pivot ? turned(camera, dx, dy, pivot, bounds, geometry) : c.look(camera, dx, dy));
  }

  /** @param {number} steps of the wheel */
  zoom(steps) {
    if (this.pivot) this.go(c.zoom(this.camera, steps, this.bounds, this.pivot));
  }

  /** Steer by a gamepad. @param {import("./gamepad.js").Pad} pad @param {number} dtS */
  steer({ left, right, slower, faster }, dtS) {
    const turn = PAD_PX_S * dtS * (this.pivot ? -1 : 1);
    this.stop();
    this.turn(turn * right[0], -turn * right[1]);
    this.step(this.pivot ? [0, left[1]] : left, dtS, FAST ** (faster - slower));
  }

  /** @param {Camera} camera */
  go(camera) {
    this.camera = camera;
    this.touch();
  }

  /** Go to a view, on foot. @param {Camera} camera */
  view(camera) {
    this.motion = this.pivot = null;
    this.camera = camera;
    this.changed();
  }

  /** @param {Motion} motion */
  play(motion) {
    this.motion = motion;
    this.pivot = null;
    this.lastMs = performance.now();
    this.changed();
  }

  stop() {
    if (!this.motion) return;
    this.motion = null;
    this.changed();
  }

  /** The thing at a point of the picture. @param {number} x px of the canvas @param {number} y @returns {Found | null} */
  under(x, y) {
    const { camera, canvas, geometry } = this;
    const towards = c.rayThrough(camera, x, y, canvas.clientWidth, canvas.clientHeight),
      hit = geometry?.hit(camera.position, towards);
    if (!geometry || !hit?.thing) return null;
    const place = along(camera.position, towards, hit.m),
      onFloor = isFloor(camera, place, hit.face, geometry, this.bounds);
    return { ...hit, thing: hit.thing, place, onFloor };
  }

  /** @param {Found | null} found */
  select(found) {
    this.found = found;
    this.changed();
  }

  /** Walk to what was found. @param {Found} found */
  goTo({ place, onFloor }) {
    const { camera, geometry, bounds } = this;
    if (!geometry) return;
    const end = standingAt(camera, place, onFloor, geometry, bounds);
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) return this.view(end);
    this.play(glide(camera, end, FAST * c.paceOf(bounds)));
  }

  /** Orbit what was found or, without it, what the camera looks at; or walk again. */
  toggleOrbit() {
    const { found, camera } = this;
    this.motion = null;
    if (this.pivot || !found) this.pivot = this.pivot ? null : camera.target;
    else {
      const [low, high] = found.thing.bounds,
        isLarge = Math.hypot(...minus(high, low)) / 2 > LARGE * found.m;
      this.pivot = isLarge ? found.place : along(low, minus(high, low), 0.5);
    }
    this.changed();
  }

  /** Show a state of the room once what it needs has arrived, and say so. @param {number} number @param {string} label */
  async choose(number, label = this.manifest.states[number].name) {
    this.state = number;
    this.changed();
    if (this.data) await this.frame?.show(number, this.data);
    tellRest("");
    say(label);
    document.body.dataset.state = this.manifest.states[number].name;
    this.touch();
  }

  /** @param {{exposureEv?: number, viewTransform?: number}} look */
  expose(look) {
    Object.assign(this, look);
    this.changed();
  }

  /** What the page's address is to hold. */
  address() {
    return addressOf(this, this.manifest);
  }

  /** Show what the page's address holds. */
  async restore() {
    const { camera, state, light, ...look } = readAddress(location.hash, this.manifest);
    this.expose(look);
    this.view(camera);
    if (state !== this.state) await this.choose(state);
    this.light = light; // last: a state brings its own
    this.dispatchEvent(new Event("light"));
  }
}
