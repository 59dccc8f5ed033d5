// A gamepad: lambent/viewer/gamepad.py in JavaScript, for the standard mapping.

import { clamp } from "./vectors.js";

/** @typedef {[number, number]} Stick right, up, within the unit disc */
/** @typedef {{left: Stick, right: Stick, slower: number, faster: number, pressed: string[]}} Pad */

const DEAD = 0.15, // deflection of a stick or trigger that counts as none
  BUTTONS = { A: 0, B: 1 },
  TRIGGERS = [6, 7];

/** @param {number} value */
const beyondDead = (value) => clamp((value - DEAD) / (1 - DEAD), 0, 1);

/** A deflection without its dead zone. @param {number} x @param {number} y @returns {Stick} */
export function stick(x, y) {
  const length = Math.hypot(x, y),
    factor = length > 0 ? beyondDead(length) / length : 0;
  return [factor * x, factor * y];
}

/** The first gamepad; null without one. @returns {Pad | null} */
function readPad() {
  const pad = navigator.getGamepads().find((one) => one?.mapping === "standard");
  if (!pad) return null;
  const [lx, ly, rx, ry] = pad.axes,
    [slower, faster] = TRIGGERS.map((number) => beyondDead(pad.buttons[number].value)),
    pressed = Object.entries(BUTTONS).flatMap(([name, number]) => (pad.buttons[number].pressed ? [name] : []));
  return { left: stick(lx, -ly), right: stick(rx, -ry), slower, faster, pressed };
}

/** Call with the deflections and seconds while a stick is deflected, and with each button as it is pressed. @param {(pad: Pad, dtS: number) => void} steer @param {(button: string) => void} push */
export function watchPads(steer, push) {
  let polls = false,
    lastMs = 0,
    /** @type {string[]} */ pushed = [];
  const poll = (/** @type {number} */ ms) => {
    const pad = readPad();
    polls = pad !== null;
    if (!pad) return;
    pad.pressed.filter((one) => !pushed.includes(one)).forEach(push);
    pushed = pad.pressed;
    if ([...pad.left, ...pad.right].some((x) => x)) steer(pad, (ms - lastMs) / 1e3);
    lastMs = ms;
    requestAnimationFrame(poll);
  };
  window.addEventListener("gamepadconnected", () => {
    if (!polls) requestAnimationFrame(poll);
    polls = true;
    lastMs = performance.now();
  });
}
