// Rays against the triangles of the room: lambent/viewer/cameras/picking.py, and its floors as views/walls.py.

/** @import { Vector } from "./vectors.js" */
/** @typedef {{name: string, material: string, first: number, count: number, bounds: [Vector, Vector]}} Thing */
/** @typedef {{thing: Thing | null, m: number, face: number}} Hit distance in m, Infinity for none */

export const STEP_M = 0.35; // a floor higher above the feet than this is a table, not a stair
const CORNERS = 9, // numbers of a triangle
  LEVEL = Math.cos(Math.PI / 4); // of a floor's normal

export class Geometry {
  /**
   * @param {Float32Array} vertices positions first in records of `stride` @param {number} stride
   * @param {Uint32Array} indices three a triangle @param {Thing[]} things
   */
  constructor(vertices, stride, indices, things) {
    this.things = things;
    const corners = (this.corners = new Float32Array(3 * indices.length));
    for (let i = 0; i < indices.length; i++) {
      for (let axis = 0; axis < 3; axis++) corners[3 * i + axis] = vertices[stride * indices[i] + axis];
    }
    const floors = [];
    for (let face = 0; face < indices.length / 3; face++) if (this.isLevel(face)) floors.push(face);
    this.floors = Uint32Array.from(floors);
  }

  /** Normal of a triangle, as long as twice its area. @param {number} face @returns {Vector} */
  normal(face) {
    const c = this.corners,
      i = CORNERS * face;
    const [ux, uy, uz] = [c[i + 3] - c[i], c[i + 4] - c[i + 1], c[i + 5] - c[i + 2]],
      [vx, vy, vz] = [c[i + 6] - c[i], c[i + 7] - c[i + 1], c[i + 8] - c[i + 2]];
    return [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
  }

  /** @param {number} i @returns {Vector} */
  corner(i) {
    return [this.corners[i], this.corners[i + 1], this.corners[i + 2]];
  }

  /** Whether a triangle slopes by at most 45 degrees; some are modelled upside down. @param {number} face */
  isLevel(face) {
    const normal = this.normal(face);
    return Math.abs(normal[1]) > LEVEL * Math.max(Math.hypot(...normal), 1e-20);
  }

  /** The first thing on a ray. @param {Vector} origin @param {Vector} towards unit @returns {Hit} */
  hit(origin, towards) {
    /** @type {Hit} */
    let nearest = { thing: null, m: Infinity, face: -1 };
    for (const thing of this.things) {
      if (!(boxEntry(origin, towards, thing.bounds) < nearest.m)) continue;
      for (let face = thing.first; face < thing.first + thing.count; face++) {
        const m = this.distance(origin, towards, face);
        if (m < nearest.m) nearest = { thing, m, face };
      }
    }
    return nearest;
  }

  /** Distance to a triangle, on either side; Infinity for a miss (Moller & Trumbore 1997). @param {Vector} origin @param {Vector} towards @param {number} face */
  distance([ox, oy, oz], [dx, dy, dz], face) {
    const c = this.corners,
      i = CORNERS * face;
    const ux = c[i + 3] - c[i],
      uy = c[i + 4] - c[i + 1],
      uz = c[i + 5] - c[i + 2],
      vx = c[i + 6] - c[i],
      vy = c[i + 7] - c[i + 1],
      vz = c[i + 8] - c[i + 2];
    const px = dy * vz - dz * vy,
      py = dz * vx - dx * vz,
      pz = dx * vy - dy * vx,
      det = ux * px + uy * py + uz * pz;
    if (Math.abs(det) < 1e-20) return Infinity;
    const sx = ox - c[i],
      sy = oy - c[i + 1],
      sz = oz - c[i + 2],
      u = (sx * px + sy * py + sz * pz) / det;
    if (!(u >= -1e-6 && u <= 1 + 1e-6)) return Infinity;
    const qx = sy * uz - sz * uy,
      qy = sz * ux - sx * uz,
      qz = sx * uy - sy * ux,
      v = (dx * qx + dy * qy + dz * qz) / det;
    if (!(v >= -1e-6 && u + v <= 1 + 1e-6)) return Infinity;
    const m = (vx * qx + vy * qy + vz * qz) / det;
    return m > 1e-6 ? m : Infinity;
  }

  /** Height of the highest floor below an eye within reach of a step; undefined without one. @param {Vector} eye @param {number} eyeHeightM */
  floorBelow([x, y, z], eyeHeightM) {
    const c = this.corners,
      reach = y - eyeHeightM + STEP_M;
    let nearest = Infinity;
    for (const face of this.floors) {
      const i = CORNERS * face;
      if (Math.min(c[i], c[i + 3], c[i + 6]) > x || Math.max(c[i], c[i + 3], c[i + 6]) < x) continue;
      if (Math.min(c[i + 2], c[i + 5], c[i + 8]) > z || Math.max(c[i + 2], c[i + 5], c[i + 8]) < z) continue;
      nearest = Math.min(nearest, this.distance([x, reach, z], [0, -1, 0], face));
    }
    return nearest < Infinity ? reach - nearest : undefined;
  }
}

/** Distance at which a ray enters a box; 0 from inside, Infinity when it misses. @param {Vector} origin @param {Vector} towards @param {[Vector, Vector]} box */
function boxEntry(origin, towards, [low, high]) {
  let enter = 0,
    leave = Infinity;
  for (let i = 0; i < 3; i++) {
    const a = (low[i] - origin[i]) / towards[i],
      b = (high[i] - origin[i]) / towards[i];
    if (Number.isNaN(a) || Number.isNaN(b)) continue; // in a face's plane, parallel to it
    enter = Math.max(enter, Math.min(a, b));
    leave = Math.min(leave, Math.max(a, b));
  }
  return leave < enter - 1e-6 ? Infinity : enter;
}

/** The triangles of a room. @param {any} manifest @param {import("./loading.js").Data} data */
export async function readGeometry({ visit, tables }, data) {
  const { vertices, indices, stride } = visit.geometry;
  const read = (/** @type {number} */ at) => /** @type {Promise<ArrayBuffer>} */ (data.read(tables.buffer[at].data));
  const [positions, faces] = await Promise.all([read(vertices), read(indices)]);
  return new Geometry(new Float32Array(positions), stride, new Uint32Array(faces), visit.objects);
}
