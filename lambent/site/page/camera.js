// Pinhole cameras, and how they move: lambent/core/views/camera.py and lambent/viewer/cameras/cameras.py in JavaScript.

/** @typedef {[number, number, number]} Vector */
/** @typedef {{name: string, position: Vector, target: Vector, up: Vector, fovYDeg: number}} Camera */
/** @typedef {[Vector, Vector]} Bounds */

export const TURN_RAD_PX = (0.3 * Math.PI) / 180;
const PITCH_LIMIT_RAD = (85 * Math.PI) / 180;
const WALK_M_S = 1.4,
  EYE_HEIGHT_M = 1.6,
  WALL_M = 0.15,
  SETTLE_S = 0.12,
  LONGEST_STEP_S = 0.25;

/** @type {Record<string, Vector>} right, up, forward by `KeyboardEvent.key` */
export const KEYS = {
  w: [0, 0, 1],
  ArrowUp: [0, 0, 1],
  s: [0, 0, -1],
  ArrowDown: [0, 0, -1],
  d: [1, 0, 0],
  ArrowRight: [1, 0, 0],
  a: [-1, 0, 0],
  ArrowLeft: [-1, 0, 0],
};

/** @param {Vector} a @param {Vector} b @returns {Vector} */
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
/** @param {Vector} a @param {Vector} b @param {number} s @returns {Vector} a + s b */
const along = (a, b, s) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
/** @param {Vector} a @param {Vector} b */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @param {Vector} a @param {Vector} b @returns {Vector} */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {Vector} a @returns {Vector} */
const unit = (a) => {
  const length = Math.hypot(...a);
  return length > 0 ? [a[0] / length, a[1] / length, a[2] / length] : a;
};

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
 * @param {Camera} camera @param {number} width @param {number} height @param {number} nearM
 */
export function frameOf(camera, width, height, nearM) {
  const [right, up, forward] = axes(camera);
  const half = Math.tan((camera.fovYDeg * Math.PI) / 360),
    x = height / (half * width),
    y = 1 / half;
  /** @param {Vector} axis */
  const behind = (axis) => -dot(axis, camera.position);
  const rows = [
    [...right, behind(right)].map((v) => x * v),
    [...up, behind(up)].map((v) => y * v),
    [0, 0, 0, nearM],
    [...forward, behind(forward)],
  ];
  return {
    clip_from_world: [0, 1, 2, 3].flatMap((column) => rows.map((row) => row[column])), // WGSL stores columns
    eye: camera.position,
    across: right.map((v) => (v * half * width) / height),
    up: up.map((v) => v * half),
    forward,
  };
}

/** Heading and elevation. @param {Camera} camera @returns {[number, number]} */
export function yawPitch(camera) {
  const [x, y, z] = minus(camera.target, camera.position);
  return [Math.atan2(x, -z), Math.atan2(y, Math.hypot(x, z))];
}

/** @param {number} yaw @param {number} pitch @returns {Vector} */
function direction(yaw, pitch) {
  const p = Math.min(Math.max(pitch, -PITCH_LIMIT_RAD), PITCH_LIMIT_RAD);
  return [Math.cos(p) * Math.sin(yaw), Math.sin(p), -Math.cos(p) * Math.cos(yaw)];
}

/** @param {Camera} camera @param {Vector} position @param {Vector} ahead unit @returns {Camera} */
function placed(camera, position, ahead) {
  const distance = Math.max(Math.hypot(...minus(camera.target, camera.position)), 0.02);
  return { ...camera, name: "free", position, target: along(position, ahead, distance), up: [0, 1, 0] };
}

/** Turn on the spot. @param {Camera} camera @param {number} dx px @param {number} dy px @returns {Camera} */
export function look(camera, dx, dy) {
  const [yaw, pitch] = yawPitch(camera);
  return placed(camera, camera.position, direction(yaw + TURN_RAD_PX * dx, pitch - TURN_RAD_PX * dy));
}

/**
 * Move on foot: at eye height above the lowest point of the scene, within its bounds.
 * @param {Camera} camera @param {Iterable<string>} keys held @param {number} dtS @param {Bounds} bounds
 * @param {number} fast factor @param {[number, number]} stick right, forward @returns {Camera}
 */
export function walk(camera, keys, dtS, bounds, fast = 1, stick = [0, 0]) {
  let [right, forward] = stick;
  for (const key of keys) {
    const way = KEYS[key];
    if (way) [right, forward] = [right + way[0], forward + way[2]];
  }
  const length = Math.hypot(right, forward);
  if (!length) return camera;
  dtS = Math.min(dtS, LONGEST_STEP_S);
  const [low, high] = bounds,
    heightM = high[1] - low[1];
  const eyeHeightM = heightM >= EYE_HEIGHT_M + 2 * WALL_M ? EYE_HEIGHT_M : 0.6 * heightM;
  const [yaw, pitch] = yawPitch(camera),
    step = ((WALK_M_S * eyeHeightM) / EYE_HEIGHT_M) * fast * dtS;
  /** @type {Vector} */
  const across = [Math.cos(yaw), 0, Math.sin(yaw)];
  const share = step / Math.max(length, 1);
  let eye = along(along(camera.position, across, share * right), direction(yaw, 0), share * forward);
  eye[1] += (low[1] + eyeHeightM - eye[1]) * (1 - Math.exp(-dtS / SETTLE_S));
  eye = /** @type {Vector} */ (
    eye.map((value, i) => {
      const margin = Math.min(WALL_M, 0.1 * (high[i] - low[i]));
      const least = Math.min(low[i] + margin, camera.position[i]),
        most = Math.max(high[i] - margin, camera.position[i]);
      return Math.min(Math.max(value, least), most);
    })
  );
  return placed(camera, eye, direction(yaw, pitch));
}
