// The graphics device of a browser.

import { SiteError, takeBlocks } from "./loading.js";

/** What a browser lacks, in a line; null if nothing. @param {any} manifest @param {GPUAdapter} adapter */
function lacking(manifest, adapter) {
  const blocks = manifest.tables.texture.some((/** @type {any} */ one) => one.format.startsWith("bc"));
  return blocks && !adapter.features.has("texture-compression-bc") ? "compressed textures (BC)" : null;
}

/** What of a room an adapter does not allow, and what helps, in a line; null if nothing. @param {any} tables @param {GPUSupportedLimits} limits */
export function beyond({ texture, buffer }, limits) {
  /** @type {number[][]} */
  const sizes = texture.map((/** @type {any} */ { size }) => size.map((/** @type {any} */ n) => Number(n) || 1)); // or the canvas
  const wants = [
    {
      largest: Math.max(...sizes.flatMap(([w, h]) => [w, h])),
      most: limits.maxTextureDimension2D,
      what: "texels a side of a texture",
    },
    {
      largest: Math.max(...sizes.map(([, , layers = 1]) => layers)),
      most: limits.maxTextureArrayLayers,
      what: "layers of a texture",
    },
    {
      largest: Math.max(...buffer.map((/** @type {any} */ one) => one.size)),
      most: limits.maxBufferSize,
      what: "bytes of a buffer",
    },
  ];
  const found = wants.find(({ largest, most }) => largest > most);
  const help = "bake it at a lower --quality, with smaller pictures or fewer triangles, and export it again";
  return found
    ? `This graphics adapter allows ${found.most} ${found.what}, the room has ${found.largest}: ${help}.`
    : null;
}

/** Why there is no adapter, and what helps. */
function missing() {
  if (!isSecureContext) return "Browsers have WebGPU for pages from https or localhost only: serve this one by https.";
  if (!navigator.gpu) return "This browser has no WebGPU: Chrome, Edge or Safari of 2025 or later show the room.";
  return "WebGPU finds no graphics adapter: turn on hardware acceleration in the browser, or update the graphics driver.";
}

/** @param {any} manifest @returns {Promise<GPUDevice>} */
export async function openDevice(manifest) {
  const adapter = await navigator.gpu?.requestAdapter({ powerPreference: "high-performance" });
  if (!adapter) throw new SiteError(missing());
  const lack = lacking(manifest, adapter);
  if (lack) throw new SiteError(`This graphics adapter has no ${lack}.`);
  const excess = beyond(manifest.tables, adapter.limits);
  if (excess) throw new SiteError(excess);
  /** @type {GPUFeatureName[]} */
  const wanted = ["texture-compression-bc", "float32-filterable"];
  const most = Math.max(...manifest.tables.buffer.map((/** @type {any} */ one) => one.size), 1 << 27);
  if (adapter.features.has("texture-compression-bc")) takeBlocks(manifest);
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
