// What a visitor takes away: a link to what they see, and its picture.

import { element, found } from "./elements.js";
import { say } from "./messages.js";

/** @import { Visit } from "./visit.js" */

const COPIED = "Link copied";
const LONGEST_BYTES = 240; // of a file's name without its ending; file systems take 255

/** Put what is seen into the address, and copy that. @param {Visit} visit */
export async function share(visit) {
  const button = found("share"),
    address = visit.address(),
    text = button.textContent;
  history.replaceState(null, "", `#${address}`);
  try {
    await navigator.clipboard.writeText(location.href);
  } catch {
    return say(location.href, true); // refused, or not on a secure address: to be copied by hand
  }
  say(COPIED);
  if (text === COPIED) return;
  button.textContent = COPIED;
  const forget = () => {
    if (visit.address() === address) return;
    button.textContent = text;
    visit.removeEventListener("shown", forget);
  };
  visit.addEventListener("shown", forget);
}

/** Download the picture. @param {Visit} visit */
export async function keep(visit) {
  const { camera, manifest } = visit,
    frame = visit.exposed();
  if (!frame) return;
  const { width, height } = frame,
    pixels = await frame.pixels(camera);
  const canvas = element("canvas", { width, height });
  canvas.getContext("2d")?.putImageData(new ImageData(pixels, width, height), 0, 0);
  const blob = await new Promise((done) => canvas.toBlob(done, "image/png")),
    download = fileName([manifest.name, manifest.states[visit.state].name, camera.name]),
    link = element("a", { href: URL.createObjectURL(blob), download });
  link.click();
  URL.revokeObjectURL(link.href);
  say(`${download} saved`);
}

/** A name for a file that all systems take. @param {string[]} parts */
export function fileName(parts) {
  let stem = [...parts.join(" - ").replace(/[\\/:*?"<>|\p{Cc}]/gu, "_")];
  while (new TextEncoder().encode(stem.join("")).length > LONGEST_BYTES) stem = stem.slice(0, -1);
  return `${stem.join("")}.png`;
}
