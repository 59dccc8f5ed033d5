// A gamepad: lambent/viewer/gamepad.py in JavaScript, for the standard mapping.

/** @typedef {[number, number]} Stick right, up, within the unit disc */
/** @typedef {{left: Stick, right: Stick, slower: number, faster: number, pressed: Set<string>}} Pad */

const DEAD = 0.15, // deflection of a stick or trigger that counts as none
  BUTTONS = { A: 0, B: 1 },
  TRIGGERS = [6, 7];

/** @param {number} value */
const beyondDead = (value) => Math.min(Math.max(value - DEAD, 0) / (1 - DEAD), 1);

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
    [slower, faster] = TRIGGERS.map((number) => beyondDead(pad.buttons[number].value));
  const pressed = Object.entries(BUTTONS).filter(([, number]) => pad.buttons[number].pressed);
  return {
    left: stick(lx, -ly),
    right: stick(rx, -ry),
    slower,
    faster,
    pressed: new Set(pressed.map(([name]) => name)),
  };
}

/** Call with the deflections and seconds while a stick is deflected, and with each button as it is pressed. @param {(pad: Pad, dtS: number) => void} steer @param {(button: string) => void} push */
export function watchPads(steer, push) {
  let polls = false,
    lastMs = 0,
    pushed = new Set();
  /** @param {number} ms */
  const poll = (ms) => {
    const pad = readPad();
    polls = pad !== null;
    if (!pad) return;
    [...pad.pressed].filter((one) => !pushed.has(one)).forEach(push);
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
