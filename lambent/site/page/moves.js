// Where a visitor comes to stand: by going to a place, and by turning about a thing.

import * as c from "./camera.js";
import { STEP_M } from "./picking.js";
import { along, dot, minus, unit } from "./vectors.js";

/** @import { Camera } from "./camera.js" */
/** @import { Geometry } from "./picking.js" */
/** @import { Bounds, Vector } from "./vectors.js" */
/** @typedef {{name: string, seconds: number, timeS: number, at: (timeS: number) => Camera}} Motion */

const ARM_M = 0.7, // before a wall or a thing: at arm's length, so that it stays in view
  TURN_RAD_S = Math.PI, // while going somewhere
  PIECE_PX = 12; // of a drag, which are checked for walls one by one

/** Height of the floor that carries the camera. @param {Camera} camera @param {Geometry} geometry @param {Bounds} bounds */
const feetOf = (camera, geometry, bounds) =>
  geometry.floorBelow(camera.position, c.eyeHeightOf(bounds)) ?? bounds[0][1];

/** Whether a place on a triangle can be walked to. @param {Camera} camera @param {Vector} place @param {number} face @param {Geometry} geometry @param {Bounds} bounds */
export const isFloor = (camera, place, face, geometry, bounds) =>
  geometry.isLevel(face) && place[1] <= feetOf(camera, geometry, bounds) + STEP_M;

/**
 * The camera that stands on a place of the floor, or before a thing and looks at it.
 * @param {Camera} camera @param {Vector} place @param {boolean} onFloor @param {Geometry} geometry
 * @param {Bounds} bounds @returns {Camera}
 */
export function standingAt(camera, place, onFloor, geometry, bounds) {
  const eyeHeightM = c.eyeHeightOf(bounds),
    feetY = feetOf(camera, geometry, bounds),
    armM = onFloor ? 0 : (ARM_M * c.paceOf(bounds)) / c.PACE_M_S;
  const [x, , z] = minus(place, camera.position),
    eye = along(camera.position, [x, 0, z], Math.max(0, 1 - armM / Math.max(Math.hypot(x, z), 1e-9)));
  const floorY = onFloor ? place[1] : geometry.floorBelow([eye[0], feetY + eyeHeightM, eye[2]], eyeHeightM);
  eye[1] = (floorY ?? feetY) + eyeHeightM;
  const end = c.confined(eye, camera.position, bounds);
  if (onFloor) return c.placed(camera, end, c.direction(...c.yawPitch(camera)));
  return { ...camera, name: "free", position: end, target: place, up: [0, 1, 0] };
}

/** From one camera to another at a quick pace. @param {Camera} from @param {Camera} to @param {number} paceM_S @returns {Motion} */
export function glide(from, to, paceM_S) {
  const way = minus(to.position, from.position),
    [yaw, pitch] = c.yawPitch(from),
    [toYaw, toPitch] = c.yawPitch(to);
  const turn = Math.atan2(Math.sin(toYaw - yaw), Math.cos(toYaw - yaw)), // the shorter way round
    tilt = toPitch - pitch;
  const seconds = Math.max(Math.hypot(...way) / paceM_S, Math.hypot(turn, tilt) / TURN_RAD_S);
  const at = (/** @type {number} */ timeS) => {
    if (timeS >= seconds) return to;
    const s = (timeS / seconds) ** 2 * (3 - (2 * timeS) / seconds);
    return c.placed(to, along(from.position, way, s), c.direction(yaw + s * turn, pitch + s * tilt));
  };
  return { name: "", seconds, timeS: 0, at };
}

/**
 * Turn about a place; a camera within the room stays inside, and moves nearer if a wall is in the way.
 * @param {Camera} camera @param {number} dx px @param {number} dy px @param {Vector} pivot
 * @param {Bounds} bounds @param {Geometry | null} geometry @returns {Camera}
 */
export function turned(camera, dx, dy, pivot, bounds, geometry) {
  const pieces = Math.ceil(Math.hypot(dx, dy) / PIECE_PX);
  for (let i = 0; i < pieces; i++) {
    let after = c.orbit(camera, dx / pieces, dy / pieces, pivot);
    if (geometry && c.isWithin(camera.position, bounds)) {
      after = c.nearer(after, pivot, openShare(pivot, camera.position, after.position, bounds, geometry));
    }
    camera = after;
  }
  return camera;
}

/**
 * Permitted share of the distance from a pivot, for an eye that comes from `before`: see viewer/modes/walk/views/walls.py.
 * @param {Vector} pivot @param {Vector} before @param {Vector} after @param {Bounds} bounds @param {Geometry} geometry
 */
export function openShare(pivot, before, after, bounds, geometry) {
  const way = minus(after, pivot),
    armM = Math.max(Math.hypot(...way), 1e-9),
    step = minus(after, before);
  let openM = armM;
  if (c.isWithin(pivot, bounds)) openM = Math.min(armM, wayOutM(pivot, way, bounds) - c.WALL_M);
  const { m, face } = geometry.hit(before, unit(step));
  if (m <= Math.hypot(...step) + c.WALL_M) {
    const normal = geometry.normal(face),
      slope = dot(normal, way) / armM;
    const planeM = Math.abs(slope) > 1e-9 ? dot(normal, minus(geometry.corner(9 * face), pivot)) / slope : 0;
    if (planeM > 0) openM = Math.min(openM, planeM - c.WALL_M);
  }
  return openM < armM ? Math.max(openM, c.NEAREST_M) / armM : 1;
}

/** Metres from a place within the bounds, in a direction, to where they end. @param {Vector} from @param {Vector} way @param {Bounds} bounds */
function wayOutM(from, way, [low, high]) {
  const towards = unit(way);
  return Math.min(...towards.map((x, i) => (Math.abs(x) > 1e-12 ? ((x > 0 ? high : low)[i] - from[i]) / x : Infinity)));
}
