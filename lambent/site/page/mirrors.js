// Mirrored views of planar reflectors: lambent/realtime/planar/{planar_view,reflector_faces}.py in JavaScript. A view's
// window is the first corner of a buffer that would hold the whole frame.

import { along, clamp, dot } from "./vectors.js";

/** @import { Vector } from "./vectors.js" */
/** @typedef {ReturnType<typeof import("./camera.js").frameOf>} FrameFields */
/** @typedef {{plane: number[], outline: Vector[], twoSided: boolean, deviationM: number, plan: any}} Reflector */
/** @typedef {{number: number, upright: boolean, frame: any, view: any, plan: any, clip: number[][]}} View */

const MARGIN_PX = 16,
  MOST_MARGIN = 0.1,
  STEP_PX = 64,
  STEP_ROWS = [512, 256], // of frames, below which the step is halved
  MOST_LEVELS = 7,
  LEAST_PX = 2 << MOST_LEVELS;
const CLEARANCE = 1e-5,
  LEAST_SHARE = 2e-4,
  LEAST_W = 1e-6;

/** How far a corner is within the frame's planes, by which polygons are cut one by one. @param {number[]} corner (x, y, w) */
const withinSides = ([x, y, w]) => [w - LEAST_W, w + x, w - x, w + y, w - y];

/** Size of a buffer that holds any window of a frame. @param {number[]} size */
export function wholeWindow(size) {
  const margin = Math.max(MARGIN_PX, Math.floor(MOST_MARGIN * Math.max(...size)));
  return size.map((length) => Math.max(Math.ceil((length + 2 * margin) / STEP_PX) * STEP_PX, LEAST_PX));
}

/** Size of a view's window, and the frame's first pixel in it: a pair for each side. @param {Reflector} one @param {number} m of its widest lobe @param {FrameFields} frame @param {number[]} size */
function windowOf(one, m, frame, size) {
  const shown = onScreen(one.outline.map((p) => [0, 1, 3].map((row) => dot(frame.rows[row], p) + frame.rows[row][3]))),
    step = STEP_PX >> STEP_ROWS.filter((rows) => size[1] < rows).length,
    reach = Math.max(MARGIN_PX, Math.floor((m * size[1]) / Math.hypot(...frame.up))),
    margin = Math.min(reach, Math.max(MARGIN_PX, Math.floor(MOST_MARGIN * Math.max(...size))));
  return size.map((length, i) => {
    const most = Math.ceil((length + 2 * margin) / step) * step,
      offset = Math.floor((most - length) / 2),
      at = shown.map((place) => ((1 + (i ? -place[1] : place[0])) / 2) * length + offset),
      low = clamp(Math.floor((Math.min(...at) - reach) / step) * step, 0, most),
      high = clamp(Math.ceil((Math.max(...at) + reach) / step) * step, 0, most);
    return [high - low, offset - low];
  });
}

/** MIP levels without remainder. @param {number[]} size */
function levelsOf([width, height]) {
  const sides = width | height;
  return Math.min(MOST_LEVELS, Math.floor(Math.log2(Math.min(width, height))) - 1, 32 - Math.clz32(sides & -sides));
}

/** The part of a polygon in a frame. @param {number[][]} polygon (x, y, w) */
function onScreen(polygon) {
  for (const side of [0, 1, 2, 3, 4]) {
    const heights = polygon.map((corner) => withinSides(corner)[side]);
    if (heights.every((height) => height > 0)) continue;
    polygon = polygon.flatMap((corner, i) => {
      const j = (i + 1) % polygon.length,
        s = heights[i] / (heights[i] - heights[j]),
        kept = heights[i] > 0 ? [corner] : [];
      if (heights[i] > 0 === heights[j] > 0) return kept;
      return [...kept, corner.map((value, k) => value + s * (polygon[j][k] - value))];
    });
    if (polygon.length < 3) return [];
  }
  return polygon.map(([x, y, w]) => [x / w, y / w]);
}

/** Share of the frame. @param {number[][]} polygon */
function area(polygon) {
  const next = polygon.map((_, i) => polygon[(i + 1) % polygon.length]),
    sum = polygon.reduce((before, [x, y], i) => before + x * next[i][1] - y * next[i][0], 0);
  return Math.abs(sum) / 8; // half, of the 2 x 2 square
}

/** Share of a frame that a reflector's triangles cover. @param {Float32Array} corners @param {number[][]} clip */
export function shareOf(corners, clip) {
  const [x, y, w] = [0, 1, 3].map((row) => {
    const [a, b, c, d] = clip[row],
      found = new Float64Array(corners.length / 3);
    for (let i = 0, k = 0; k < found.length; k++, i += 3) {
      found[k] = a * corners[i] + b * corners[i + 1] + c * corners[i + 2] + d;
    }
    return found;
  });
  let sum = 0;
  for (let i = 0; i < w.length; i += 3) {
    let out = 15; // sides that all corners are beyond, and whether a corner is beyond any
    let isCut = false;
    for (let k = i; k < i + 3; k++) {
      const beyond =
        (x[k] + w[k] > 0 ? 0 : 1) | (w[k] - x[k] > 0 ? 0 : 2) | (y[k] + w[k] > 0 ? 0 : 4) | (w[k] - y[k] > 0 ? 0 : 8);
      out &= beyond;
      isCut ||= beyond > 0 || w[k] <= LEAST_W;
    }
    if (out) continue;
    const triangle = [i, i + 1, i + 2];
    if (isCut) sum += area(onScreen(triangle.map((k) => [x[k], y[k], w[k]])));
    else sum += area(triangle.map((k) => [x[k] / w[k], y[k] / w[k]]));
  }
  return sum;
}

/** @param {Reflector} one @param {Vector} eye */
const clearanceM = (one, eye) => CLEARANCE * Math.max(...one.outline.flat().map(Math.abs), ...eye.map(Math.abs));

/**
 * The views that a frame needs, the largest first.
 * @param {Reflector[]} reflectors @param {Float32Array[]} corners of their triangles @param {Record<string, number>} widest
 * m, by the numbers of the reflectors that the state mirrors @param {FrameFields} frame @param {number[]} size @param {number} most
 * @returns {View[]}
 */
export function mirroredViews(reflectors, corners, widest, frame, size, most) {
  const seen = Object.entries(widest).flatMap(([of, m], number) => {
    const one = reflectors[Number(of)],
      share = shareOf(corners[Number(of)], frame.rows);
    if (share < LEAST_SHARE) return [];
    let plane = one.plane,
      above = dot(plane, frame.eye) + plane[3];
    if (above < 0 && one.twoSided) [plane, above] = [plane.map((value) => -value), -above];
    return above > 2 * clearanceM(one, frame.eye) ? [{ share, number, one, plane, m }] : [];
  });
  seen.sort((a, b) => b.share - a.share);
  return seen.slice(0, most).flatMap(({ number, one, plane, m }, order) => {
    const view = viewOf(one, m, plane, frame, size, order);
    return view ? [{ ...view, number }] : [];
  });
}

/** @param {Reflector} one @param {number} m of its widest lobe @param {number[]} plane towards the viewer @param {FrameFields} frame @param {number[]} size @param {number} order */
function viewOf(one, m, plane, frame, size, order) {
  const n = /** @type {Vector} */ (plane.slice(0, 3)),
    d = plane[3],
    sides = windowOf(one, m, frame, size),
    [wide, offset] = [0, 1].map((which) => sides.map((side) => side[which]));
  const turned = (/** @type {Vector} */ v) => along(v, n, -2 * dot(n, v));
  const scale = [0, 1].map((i) => size[i] / wide[i]),
    shift = [0, 1].map((i) => (size[i] + 2 * offset[i] - wide[i]) / wide[i]);
  const clip = frame.rows.map((row) => [...turned(/** @type {any} */ (row)), row[3] - 2 * d * dot(row, n)]);
  clip[0] = clip[0].map((value, i) => scale[0] * value + shift[0] * clip[3][i]);
  clip[1] = clip[1].map((value, i) => scale[1] * value - shift[1] * clip[3][i]);
  const eye = along(turned(frame.eye), n, -2 * d),
    across = /** @type {Vector} */ (turned(frame.across).map((value) => value / scale[0])),
    up = /** @type {Vector} */ (turned(frame.up).map((value) => value / scale[1]));
  const forward = along(along(turned(frame.forward), across, -shift[0]), up, shift[1]);
  const steepest = dot(forward, n) + Math.abs(dot(across, n)) + Math.abs(dot(up, n));
  if (steepest <= 0 || wide[0] < 0) return null; // nothing of its outline is in the frame
  const clearance = clearanceM(one, frame.eye),
    near = [...n, d - one.deviationM - clearance];
  clip[2] = clip[3].map((value, i) => value - (0.999 / steepest) * near[i]);
  const upright = dot(n, one.plane) > 0;
  return {
    upright,
    clip,
    frame: {
      clip_from_world: [0, 1, 2, 3].flatMap((column) => clip.map((row) => row[column])),
      eye,
      across: [...across, n[0]],
      up: [...up, n[1]],
      forward: [...forward, n[2]],
      show: [1, 1, 1, 0],
    },
    view: {
      eye,
      row_x: clip[0].slice(0, 3),
      row_y: clip[1].slice(0, 3),
      row_w: clip[3].slice(0, 3),
      plane,
      size: wide,
      offset,
      tolerance: [one.deviationM + 2 * clearance],
      focal_px: [wide[1] / 2 / Math.hypot(...up)],
      levels: [levelsOf(wide)],
      number: [order],
    },
    plan: upright && one.plan ? planOf(one.plan, plane, eye) : null,
  };
}

/** @param {any} plan @param {number[]} plane @param {Vector} eye */
function planOf(plan, plane, eye) {
  const from = along(eye, plan.corner, -1);
  /** @param {Vector} axis @param {number} cells */
  const row = (axis, cells) => [
    ...axis.map((value) => value / (plan.cellM * cells)),
    (dot(from, axis) / plan.cellM + 0.5) / cells,
  ];
  return {
    to_u: row(plan.across, plan.columns),
    to_v: row(plan.along, plan.rows),
    below: [-(dot(plane, eye) + plane[3])],
  };
}
