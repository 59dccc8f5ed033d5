// What a shared link holds: the camera, and what differs from the room as exported.

/** @import { Camera } from "./camera.js" */
/** @typedef {Record<string, number | number[]>} Light factors by light group */
/** @typedef {{camera: Camera, state: number, exposureEv: number, viewTransform: number, light: Light}} Shared */

const DIGITS = 4;

/** @param {number[]} numbers */
const joined = (numbers) => numbers.map((x) => +x.toFixed(DIGITS)).join(",");

/** Position, target and field of view. @param {Camera} camera */
export const cameraAddress = ({ position, target, fovYDeg }) => joined([...position, ...target, fovYDeg]);

/** The part of the address after #. @param {Shared} shared @param {any} manifest */
export function addressOf({ camera, state, exposureEv, viewTransform, light }, manifest) {
  const more = new URLSearchParams(),
    ev = exposureEv - manifest.exposureEv;
  if (camera.up.some((x, i) => x !== [0, 1, 0][i])) more.set("up", joined(camera.up));
  if (state) more.set("state", manifest.states[state].name);
  if (Math.abs(ev) >= 10 ** -DIGITS) more.set("exposure", joined([ev]));
  const transforms = Object.entries(manifest.visit.viewTransforms);
  const [transform] = transforms.find(([, number]) => number === viewTransform) ?? [];
  if (transform && viewTransform !== manifest.viewTransform) more.set("transform", transform);
  if (Object.keys(light).length) more.set("light", JSON.stringify(light));
  return [cameraAddress(camera), ...(more.size ? [more] : [])].join("&");
}

/** What an address says; the rest as exported. @param {string} hash @param {any} manifest @returns {Shared} */
export function readAddress(hash, manifest) {
  const [first, ...rest] = hash.replace(/^#/, "").split("&"),
    more = new URLSearchParams(rest.join("&")),
    ev = Number(more.get("exposure"));
  const state = manifest.states.findIndex((/** @type {{name: string}} */ one) => one.name === more.get("state"));
  const transforms = new Map(Object.entries(manifest.visit.viewTransforms));
  return {
    camera: cameraIn(first, more.get("up")) ?? manifest.cameras[0],
    state: Math.max(state, 0),
    exposureEv: manifest.exposureEv + (Math.abs(ev) <= 30 ? ev : 0),
    viewTransform: transforms.get(more.get("transform") ?? "") ?? manifest.viewTransform,
    light: lightIn(more.get("light")),
  };
}

/** @param {string} text @param {number} count @returns {number[] | null} */
function numbersIn(text, count) {
  const numbers = text.split(",").map(Number);
  return numbers.length === count && numbers.every(Number.isFinite) ? numbers : null;
}

/** @param {string} text @param {string | null} upText @returns {Camera | null} */
function cameraIn(text, upText) {
  const numbers = numbersIn(text, 7),
    [ux, uy, uz] = numbersIn(upText ?? "", 3) ?? [0, 1, 0];
  if (!numbers) return null;
  const [x, y, z, tx, ty, tz, fovYDeg] = numbers;
  if (fovYDeg < 1 || fovYDeg > 170) return null;
  return { name: "free", position: [x, y, z], target: [tx, ty, tz], up: [ux, uy, uz], fovYDeg };
}

/** @param {string | null} text @returns {Light} */
function lightIn(text) {
  let said;
  try {
    said = JSON.parse(text ?? "{}");
  } catch {
    return {}; // a link cut short shows the room's own light
  }
  const isFactor = (/** @type {any} */ one) => Number.isFinite(one) && one >= 0;
  return Object.fromEntries(Object.entries(said ?? {}).filter(([, one]) => [one].flat().every(isFactor)));
}
