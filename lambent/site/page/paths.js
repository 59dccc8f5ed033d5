// Cameras along a path: lambent/scenes/camera_paths.py in JavaScript.

import { minus, unit } from "./camera.js";

/** @typedef {import("./camera.js").Camera} Camera */
/** @typedef {{name: string, keys: Camera[], seconds: number, timesS: number[] | null}} Path */

const STEPS = 256; // chords per segment that measure the curve's length

/** Position, target, up and field of view. @param {Camera} camera */
const numbersOf = ({ position, target, up, fovYDeg }) => [...position, ...target, ...up, fovYDeg];
/** @param {number} value @param {number} a @param {number} b */
const between = (value, a, b) => Math.min(Math.max(value, Math.min(a, b)), Math.max(a, b));
/** How many of ascending numbers are not above a value. @param {number[]} numbers @param {number} value */
function countTo(numbers, value) {
  let count = 0;
  while (count < numbers.length && numbers[count] <= value) count++;
  return count;
}

/** What gives the camera of a path at a time, clamped to its ends. @param {Path} path @returns {(timeS: number) => Camera} */
export function cameraAlong(path) {
  const { keys, seconds, timesS } = path;
  if (keys.length < 2 || seconds <= 0) return () => keys[0];
  if (timesS) return (timeS) => recorded(path, timesS, timeS);
  const knots = centripetalKnots(keys),
    curve = catmullRom(keys.map(numbersOf), knots),
    fovs = keys.map((key) => key.fovYDeg),
    parameter = byLength(curve, knots);
  return (timeS) => {
    const found = curve(parameter(between(timeS / seconds, 0, 1)));
    found.splice(6, 3, ...unit([found[6], found[7], found[8]]));
    return cameraOf(path.name, found, Math.min(...fovs), Math.max(...fovs));
  };
}

/** @param {string} name @param {number[]} numbers @param {number} least of the field of view @param {number} most @returns {Camera} */
function cameraOf(name, numbers, least, most) {
  const [x, y, z, tx, ty, tz, ux, uy, uz, fov] = numbers;
  return { name, position: [x, y, z], target: [tx, ty, tz], up: [ux, uy, uz], fovYDeg: between(fov, least, most) };
}

/** Steps grow with the square root of the distance, and are at least a quarter of their mean. @param {Camera[]} keys */
function centripetalKnots(keys) {
  const roots = keys.slice(1).map((key, i) => Math.sqrt(Math.hypot(...minus(key.position, keys[i].position))));
  const mean = roots.reduce((a, b) => a + b, 0) / roots.length || 1;
  return roots.reduce((knots, root) => [...knots, knots[knots.length - 1] + Math.max(root, mean / 4)], [0]);
}

/** The curve through points at their knots, by its parameter. @param {number[][]} points @param {number[]} knots @returns {(t: number) => number[]} */
function catmullRom(points, knots) {
  const steps = knots.slice(1).map((knot, i) => knot - knots[i]);
  const slopes = steps.map((step, k) => points[k].map((x, i) => (points[k + 1][i] - x) / step));
  const tangents = points.map((point, k) => {
    const [b, a] = [Math.max(k - 1, 0), Math.min(k, steps.length - 1)];
    return point.map((_, i) => (slopes[b][i] * steps[a] + slopes[a][i] * steps[b]) / (steps[b] + steps[a]));
  });
  return (t) => {
    const k = between(countTo(knots, t) - 1, 0, steps.length - 1),
      d = steps[k],
      s = (t - knots[k]) / d;
    return points[k].map((p0, i) => {
      const p1 = points[k + 1][i],
        m0 = d * tangents[k][i],
        m1 = d * tangents[k + 1][i];
      return p0 + s * (m0 + s * (3 * (p1 - p0) - 2 * m0 - m1 + s * (2 * (p0 - p1) + m0 + m1)));
    });
  };
}

/** The parameter of a curve by the share of its length. @param {(t: number) => number[]} curve @param {number[]} knots */
function byLength(curve, knots) {
  const parameters = [knots[0]],
    lengths = [0];
  let last = curve(knots[0]);
  for (let k = 0; k < knots.length - 1; k++) {
    for (let i = 1; i <= STEPS; i++) {
      const t = knots[k] + (i / STEPS) * (knots[k + 1] - knots[k]),
        next = curve(t);
      lengths.push(lengths[lengths.length - 1] + Math.hypot(next[0] - last[0], next[1] - last[1], next[2] - last[2]));
      parameters.push(t);
      last = next;
    }
  }
  const whole = lengths[lengths.length - 1];
  /** @param {number} share */
  return (share) => {
    if (!whole) return share * knots[knots.length - 1];
    const i = between(countTo(lengths, share * whole), 1, lengths.length - 1);
    const part = (share * whole - lengths[i - 1]) / (lengths[i] - lengths[i - 1] || 1);
    return parameters[i - 1] + part * (parameters[i] - parameters[i - 1]);
  };
}

/** Cubic Hermite curve through the keys; the slope at a key is that between its neighbours. @param {Path} path @param {number[]} times @param {number} timeS */
function recorded({ name, keys }, times, timeS) {
  const now = between(timeS, times[0], times[times.length - 1]),
    here = between(countTo(times, now) - 1, 0, keys.length - 2);
  const near = [here - 1, here, here + 1, here + 2].map((i) => between(i, 0, keys.length - 1));
  const [p, a, b, n] = near.map((i) => numbersOf(keys[i])),
    t = near.map((i) => times[i]);
  const length = t[2] - t[1],
    s = (now - t[1]) / length;
  const found = a.map((x, i) => {
    const before = ((b[i] - p[i]) / (t[2] - t[0])) * length,
      after = ((n[i] - x) / (t[3] - t[1])) * length;
    return (
      (1 + 2 * s) * (1 - s) ** 2 * x + s * (1 - s) ** 2 * before + s * s * (3 - 2 * s) * b[i] - s * s * (1 - s) * after
    );
  });
  return cameraOf(name, found, a[9], b[9]);
}
