// Recorded walks: cameras that Python has sampled (lambent/site/walks.py), and straight lines between them.

import { clamp } from "./vectors.js";

/** @import { Camera } from "./camera.js" */

const NUMBERS = 10; // of a camera: position, target, up, field of view

/** What gives the camera of a walk at a time, clamped to its ends. @param {string} name @param {Float32Array} samples at equal intervals, two at least @param {number} seconds @returns {(timeS: number) => Camera} */
export function cameraAlong(name, samples, seconds) {
  const last = samples.length / NUMBERS - 1;
  return (timeS) => {
    const at = clamp(timeS / (seconds || 1), 0, 1) * last,
      before = Math.min(Math.floor(at), last - 1);
    const [here, next] = [before, before + 1].map((i) => [...samples.subarray(NUMBERS * i, NUMBERS * (i + 1))]);
    const [x, y, z, tx, ty, tz, ux, uy, uz, fovYDeg] = here.map(
      (value, k) => value + (at - before) * (next[k] - value),
    );
    return { name, position: [x, y, z], target: [tx, ty, tz], up: [ux, uy, uz], fovYDeg };
  };
}
