// Pinhole cameras, and how they move: lambent/core/views/camera.py and lambent/viewer/cameras/cameras.py in JavaScript.

import { along, clamp, cross, dot, minus, unit } from "./vectors.js";

/** @import { Bounds, Vector } from "./vectors.js" */
/** @typedef {{name: string, position: Vector, target: Vector, up: Vector, fovYDeg: number}} Camera */

export const TURN_RAD_PX = (0.3 * Math.PI) / 180;
const PITCH_LIMIT_RAD = (85 * Math.PI) / 180;
export const PACE_M_S = 1.4,
  WALL_M = 0.15, // the eye keeps this distance from walls
  NEAREST_M = 0.02;
const EYE_HEIGHT_M = 1.6,
  SETTLE_S = 0.12,
  LONGEST_STEP_S = 0.25,
  ZOOM_PER_STEP = 0.88,
  FARTHEST_SIZES = 20; // of the scene

/** @type {Record<string, [number, number]>} right and forward */
const WAYS = { w: [0, 1], s: [0, -1], d: [1, 0], a: [-1, 0] };
/** @type {Record<string, string>} */
const ARROWS = { ArrowUp: "w", ArrowDown: "s", ArrowRight: "d", ArrowLeft: "a" };

/** The way of a key that moves. @param {string} key */
export const wayOf = (key) => WAYS[ARROWS[key] ?? key];

/** To the right and forward, by held keys. @param {Iterable<string>} keys @returns {[number, number]} */
export function pushOf(keys) {
  const ways = [...keys].map(wayOf);
  return [ways.reduce((sum, [right]) => sum + right, 0), ways.reduce((sum, [, forward]) => sum + forward, 0)];
}

/** Right, up and forward. @param {Camera} camera @returns {[Vector, Vector, Vector]} */
export function axes(camera) {
  let forward = unit(minus(camera.target, camera.position));
  if (!forward.some((x) => x)) forward = [0, 0, -1];
  let right = cross(forward, camera.up);
  if (Math.hypot(...right) < 1e-6 * Math.max(1e-30, Math.hypot(...camera.up))) {
    right = cross(forward, Math.abs(forward[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]);
  }
  right = unit(right);
  return [right, cross(right, forward), forward];
}

/**
 * The fields of a frame's record that depend on the camera.
 * @param {Camera} camera @param {number} width @param {number} height @param {number} nearM @param {number[]} jitter px, right and down
 */
export function frameOf(camera, width, height, nearM, jitter = [0, 0]) {
  const [right, up, forward] = axes(camera);
  const half = Math.tan((camera.fovYDeg * Math.PI) / 360),
    x = height / (half * width),
    y = 1 / half;
  const behind = (/** @type {Vector} */ axis) => -dot(axis, camera.position);
  const ahead = [...forward, behind(forward)],
    [aside, down] = [(2 * jitter[0]) / width, (2 * jitter[1]) / height];
  const rows = [
    [...right, behind(right)].map((v, i) => x * v - aside * ahead[i]),
    [...up, behind(up)].map((v, i) => y * v + down * ahead[i]),
    [0, 0, 0, nearM],
    ahead,
  ];
  const across = /** @type {Vector} */ (right.map((v) => (v * half * width) / height)),
    above = /** @type {Vector} */ (up.map((v) => v * half));
  return {
    rows,
    clip_from_world: [0, 1, 2, 3].flatMap((column) => rows.map((row) => row[column])), // WGSL stores columns
    eye: camera.position,
    across,
    up: above,
    forward: along(along(forward, across, aside), above, -down),
  };
}

/** Heading and elevation. @param {Camera} camera @returns {[number, number]} */
export function yawPitch(camera) {
  const [x, y, z] = minus(camera.target, camera.position);
  return [Math.atan2(x, -z), Math.atan2(y, Math.hypot(x, z))];
}

/** @param {number} yaw @param {number} pitch @returns {Vector} */
export function direction(yaw, pitch) {
  const p = clamp(pitch, -PITCH_LIMIT_RAD, PITCH_LIMIT_RAD);
  return [Math.cos(p) * Math.sin(yaw), Math.sin(p), -Math.cos(p) * Math.cos(yaw)];
}

/** @param {Camera} camera @param {Vector} position @param {Vector} ahead unit @returns {Camera} */
export function placed(camera, position, ahead) {
  return moved(camera, position, along(position, ahead, distanceOf(camera)));
}

/** @param {Camera} camera @param {Vector} position @param {Vector} target @returns {Camera} */
const moved = ({ fovYDeg }, position, target) => ({ name: "free", position, target, up: [0, 1, 0], fovYDeg });

/** @param {Camera} camera m from its target */
const distanceOf = (camera) => Math.max(Math.hypot(...minus(camera.target, camera.position)), NEAREST_M);

/** Turn on the spot. @param {Camera} camera @param {number} dx px @param {number} dy px @returns {Camera} */
export function look(camera, dx, dy) {
  const [yaw, pitch] = yawPitch(camera);
  return placed(camera, camera.position, direction(yaw + TURN_RAD_PX * dx, pitch - TURN_RAD_PX * dy));
}

/** To the right, up and ahead of a level camera. @param {number} yaw @param {number} pitch @returns {Vector[]} */
function level(yaw, pitch) {
  const ahead = direction(yaw, pitch),
    /** @type {Vector} */ right = [Math.cos(yaw), 0, Math.sin(yaw)];
  return [right, cross(right, ahead), ahead];
}

/** Turn about a place, which stays where it is in the picture. @param {Camera} camera @param {number} dx px @param {number} dy px @param {Vector} pivot @returns {Camera} */
export function orbit(camera, dx, dy, pivot = camera.target) {
  const [yaw, pitch] = yawPitch(camera),
    before = level(yaw, pitch),
    after = level(yaw + TURN_RAD_PX * dx, pitch - TURN_RAD_PX * dy),
    arm = minus(camera.position, pivot);
  const eye = after.reduce((at, axis, i) => along(at, axis, dot(before[i], arm)), pivot);
  return moved(camera, eye, isTarget(camera, pivot) ? pivot : along(eye, after[2], distanceOf(camera)));
}

/** Move steps of the wheel towards a place, or away. @param {Camera} camera @param {number} steps @param {Bounds} bounds @param {Vector} pivot @returns {Camera} */
export function zoom(camera, steps, bounds, pivot = camera.target) {
  const before = Math.max(Math.hypot(...minus(pivot, camera.position)), NEAREST_M),
    most = FARTHEST_SIZES * Math.hypot(...minus(bounds[1], bounds[0]));
  return nearer(camera, pivot, clamp(before * ZOOM_PER_STEP ** steps, NEAREST_M, most) / before);
}

/** Move to this share of the distance from a place. @param {Camera} camera @param {Vector} pivot @param {number} share @returns {Camera} */
export function nearer(camera, pivot, share) {
  const eye = along(pivot, minus(camera.position, pivot), share),
    ahead = direction(...yawPitch(camera));
  const target = along(eye, ahead, Math.max(share * distanceOf(camera), NEAREST_M));
  return moved(camera, eye, isTarget(camera, pivot) ? pivot : target);
}

/** @param {Camera} camera @param {Vector} place */
const isTarget = (camera, place) => camera.target.every((x, i) => x === place[i]);

/** Steps of the wheel that a pinch by this factor stands for. @param {number} factor */
export const stepsOf = (factor) => -Math.log(factor) / Math.log(ZOOM_PER_STEP);

/** The unit direction through a point of the picture, px from the top left. @param {Camera} camera @param {number} x @param {number} y @param {number} width @param {number} height @returns {Vector} */
export function rayThrough(camera, x, y, width, height) {
  const [right, up, forward] = axes(camera),
    half = Math.tan((camera.fovYDeg * Math.PI) / 360);
  const across = along(forward, right, (((2 * x) / width - 1) * half * width) / height);
  return unit(along(across, up, (1 - (2 * y) / height) * half));
}

/** Metres in a second on foot. @param {Bounds} bounds */
export const paceOf = (bounds) => (PACE_M_S * eyeHeightOf(bounds)) / EYE_HEIGHT_M;

/** Height of the eye on foot, m. @param {Bounds} bounds */
export function eyeHeightOf([low, high]) {
  const heightM = high[1] - low[1];
  return heightM >= EYE_HEIGHT_M + 2 * WALL_M ? EYE_HEIGHT_M : 0.6 * heightM;
}

/** @param {Vector} place @param {Bounds} bounds */
export const isWithin = (place, [low, high]) => place.every((x, i) => x >= low[i] && x <= high[i]);

/** Within the bounds, or no farther out than before. @param {Vector} eye @param {Vector} before @param {Bounds} bounds */
export function confined(eye, before, [low, high]) {
  const found = eye.map((value, i) => {
    const margin = Math.min(WALL_M, 0.1 * (high[i] - low[i]));
    return clamp(value, Math.min(low[i] + margin, before[i]), Math.max(high[i] - margin, before[i]));
  });
  return /** @type {Vector} */ (found);
}

/**
 * Move on foot: at eye height above the floor, within the scene's bounds.
 * @param {Camera} camera @param {[number, number]} push right, forward @param {number} dtS @param {Bounds} bounds
 * @param {number} fast factor @param {number} floorY by default the lowest point of the scene @returns {Camera}
 */
export function walk(camera, [right, forward], dtS, bounds, fast = 1, floorY = bounds[0][1]) {
  const length = Math.hypot(right, forward);
  if (!length) return camera;
  dtS = Math.min(dtS, LONGEST_STEP_S);
  const [yaw, pitch] = yawPitch(camera),
    share = (paceOf(bounds) * fast * dtS) / Math.max(length, 1);
  const across = along(camera.position, [Math.cos(yaw), 0, Math.sin(yaw)], share * right);
  const eye = along(across, direction(yaw, 0), share * forward);
  eye[1] += (floorY + eyeHeightOf(bounds) - eye[1]) * (1 - Math.exp(-dtS / SETTLE_S));
  return placed(camera, confined(eye, camera.position, bounds), direction(yaw, pitch));
}
