// The graphics device of a browser.

import { SiteError, takeBlocks } from "./loading.js";

const BLOCKS_FEATURE = "texture-compression-bc";
/** @type {Record<string, string>} what of a room a limit of an adapter is for */
const LIMITS = {
  maxTextureDimension2D: "texels a side of a texture",
  maxTextureArrayLayers: "layers of a texture",
  maxBufferSize: "bytes of a buffer",
};

/** What of a room an adapter does not allow, and what helps, in a line; null if nothing. @param {Record<string, number>} needs by limit @param {any} limits */
export function beyond(needs, limits) {
  const name = Object.keys(LIMITS).find((one) => needs[one] > limits[one]);
  if (!name) return null;
  const help = "bake it at a lower --quality, with smaller pictures or fewer triangles, and export it again";
  return `This graphics adapter allows ${limits[name]} ${LIMITS[name]}, the room has ${needs[name]}: ${help}.`;
}

/** Why there is no adapter, and what helps. */
function missing() {
  if (!isSecureContext) return "Browsers have WebGPU for pages from https or localhost only: serve this one by https.";
  if (!navigator.gpu) return "This browser has no WebGPU: Chrome, Edge or Safari of 2025 or later show the room.";
  return "WebGPU finds no graphics adapter: turn on hardware acceleration in the browser, or update the graphics driver.";
}

/** What a device says of what it cannot do. @param {GPUError} error */
export const refusal = ({ message }) =>
  `The graphics device cannot show the room: ${message.split("\n")[0] || "no memory"}`;

/** @param {any} manifest @returns {Promise<GPUDevice>} */
export async function openDevice(manifest) {
  const adapter = await navigator.gpu?.requestAdapter({ powerPreference: "high-performance" });
  if (!adapter) throw new SiteError(missing());
  const hasBlocks = adapter.features.has(BLOCKS_FEATURE);
  if (!hasBlocks && manifest.tables.texture.some((/** @type {any} */ { format }) => format.startsWith("bc"))) {
    throw new SiteError("This graphics adapter has no compressed textures (BC).");
  }
  const excess = beyond(manifest.needs, adapter.limits);
  if (excess) throw new SiteError(excess);
  /** @type {GPUFeatureName[]} */
  const wanted = [BLOCKS_FEATURE, "float32-filterable"];
  const most = Math.max(manifest.needs.maxBufferSize, 1 << 27);
  if (hasBlocks) takeBlocks(manifest);
  return adapter.requestDevice({
    requiredFeatures: wanted.filter((one) => adapter.features.has(one)),
    requiredLimits: {
      maxBufferSize: Math.min(Math.max(most, 256 << 20), adapter.limits.maxBufferSize),
      maxStorageBufferBindingSize: Math.min(most, adapter.limits.maxStorageBufferBindingSize),
      maxTextureDimension2D: adapter.limits.maxTextureDimension2D,
      maxTextureArrayLayers: adapter.limits.maxTextureArrayLayers,
    },
  });
}
