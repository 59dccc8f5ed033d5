// Mouse, fingers, keys and gamepad over the picture.

import { stepsOf, wayOf } from "./camera.js";
import { watchPads } from "./gamepad.js";
import { say } from "./messages.js";
import { FAST } from "./visit.js";

/** @import { Visit } from "./visit.js" */
/** @typedef {{x: number, y: number, wanders: boolean}} Pointer */

const CLICK_PX = { mouse: 4, touch: 12, pen: 12 }, // a press that moves less is a click; fingers waver
  DRAG_PX_S = 400, // of two fingers, for a second of walking
  NOTCH = 100, // of a wheel, in px
  LINES_PX = 33, // of a line of a wheel that counts lines
  NOTCH_S = 0.15; // of walking, for a notch of the wheel

/** Follow the visitor's hands. @param {Visit} visit */
export function follow(visit) {
  const { canvas } = visit;
  new Pointers(visit);
  canvas.addEventListener("wheel", (event) => scroll(visit, event), { passive: false });
  canvas.addEventListener("dblclick", ({ offsetX, offsetY }) => {
    const found = visit.under(offsetX, offsetY);
    if (found) visit.goTo(found);
  });
  for (const kind of ["pointerdown", "wheel", "keydown"])
    window.addEventListener(kind, (event) => halt(visit, event), true);
  window.addEventListener("keydown", (event) => press(visit, event));
  window.addEventListener("keyup", (event) => visit.held.delete(keyOf(event)));
  window.addEventListener("blur", () => visit.held.clear());
  window.addEventListener("hashchange", () => visit.restore());
  new ResizeObserver(() => visit.touch()).observe(canvas);
  watchPads(
    (pad, dtS) => visit.steer(pad, dtS),
    (button) => push(visit, button),
  );
}

/** Any input stops a walk, but for presses of its own button, which does. @param {Visit} visit @param {Event} event */
function halt(visit, event) {
  const isPress = !(event instanceof KeyboardEvent) || event.key === "Enter" || event.key === " ";
  if (!isPress || !(event.target instanceof Element && event.target.closest("#walks"))) visit.stop();
}

/** One finger or the mouse looks or orbits, two fingers walk or zoom; a click picks. */
class Pointers {
  /** @type {Map<number, Pointer>} */ down = new Map();

  /** @param {Visit} visit */
  constructor(visit) {
    this.visit = visit;
    const { canvas } = visit;
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    canvas.addEventListener("pointerup", (event) => this.release(event));
    canvas.addEventListener("pointercancel", (event) => this.down.delete(event.pointerId));
  }

  /** @param {PointerEvent} event */
  press(event) {
    this.visit.canvas.setPointerCapture(event.pointerId);
    this.down.set(event.pointerId, { x: event.clientX, y: event.clientY, wanders: this.down.size > 0 });
    if (this.down.size > 1) this.down.forEach((one) => (one.wanders = true));
  }

  /** @param {PointerEvent} event */
  drag({ pointerId, pointerType, clientX, clientY }) {
    const last = this.down.get(pointerId),
      { visit } = this;
    if (!last) return;
    const [dx, dy] = [clientX - last.x, clientY - last.y],
      far = Math.hypot(dx, dy);
    if (!last.wanders && far < CLICK_PX[/** @type {keyof CLICK_PX} */ (pointerType)]) return; // not yet a drag
    const before = this.spread();
    this.down.set(pointerId, { x: clientX, y: clientY, wanders: true });
    if (this.down.size === 1) visit.turn(dx, dy);
    else if (visit.pivot) visit.zoom(stepsOf(this.spread() / before));
    else if (far) visit.step([-dx / far, dy / far], far / DRAG_PX_S, FAST);
  }

  /** Px between two fingers. */
  spread() {
    const [a, b = a] = [...this.down.values()];
    return Math.max(1, Math.hypot(a.x - b.x, a.y - b.y));
  }

  /** @param {PointerEvent} event */
  release({ pointerId, pointerType, button, offsetX, offsetY }) {
    const last = this.down.get(pointerId),
      { visit } = this;
    this.down.delete(pointerId);
    if (!last || last.wanders || button) return;
    const found = visit.under(offsetX, offsetY);
    visit.select(found);
    if (found && pointerType === "touch" && found.onFloor) visit.goTo(found);
  }
}

/** @param {Visit} visit @param {WheelEvent} event */
function scroll(visit, event) {
  event.preventDefault();
  const up = (-event.deltaY * (event.deltaMode ? LINES_PX : 1)) / NOTCH;
  if (visit.pivot) visit.zoom(up);
  else if (up) visit.step([0, Math.sign(up)], NOTCH_S * Math.abs(up));
}

/** @param {KeyboardEvent} event */
const keyOf = (event) => (event.key.length === 1 ? event.key.toLowerCase() : event.key);

/** @param {Visit} visit @param {KeyboardEvent} event */
function press(visit, event) {
  const key = keyOf(event),
    target = event.target instanceof Element ? event.target : document.body;
  visit.fast = event.shiftKey ? FAST : 1;
  if (event.ctrlKey || event.metaKey || event.altKey || target.closest("input, select")) return;
  if (wayOf(key)) {
    event.preventDefault();
    if (!visit.held.size) visit.lastMs = performance.now();
    visit.held.add(key);
    visit.touch();
  } else if (key === "o") {
    visit.toggleOrbit();
  } else if (key === "Escape") {
    if (visit.pivot) visit.toggleOrbit();
    else visit.select(null);
  } else if (key === "Enter" && target === visit.canvas) {
    const { clientWidth, clientHeight } = visit.canvas;
    visit.select(visit.under(clientWidth / 2, clientHeight / 2));
    document.getElementById("card")?.focus();
  }
}

/** A shows the next view, B the next state. @param {Visit} visit @param {string} button */
function push(visit, button) {
  const { cameras, states } = visit.manifest;
  if (button === "A") {
    const camera = cameras[(cameras.indexOf(visit.camera) + 1) % cameras.length];
    visit.view(camera);
    say(camera.name);
  } else {
    visit.choose((visit.state + 1) % states.length);
  }
}
