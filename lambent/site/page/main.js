// The page: loads the room and shows it; again after the graphics device was lost, where the visitor stands.

import { openCard } from "./card.js";
import { openPanel } from "./controls.js";
import { openDevice } from "./device.js";
import { Frame } from "./frame.js";
import { follow } from "./input.js";
import { Data, readManifest } from "./loading.js";
import { failed, tell } from "./messages.js";
import { readGeometry } from "./picking.js";
import { Visit } from "./visit.js";

const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById("picture"));
const MB = 1e6;

/** Bytes of the files that the first state needs. @param {any} manifest @returns {number} */
function packedBytes(manifest) {
  const { counts } = manifest.states[0];
  const pieces = ["buffer", "texture"].flatMap((kind) =>
    manifest.tables[kind].slice(0, counts[kind]).flatMap((/** @type {any} */ one) => one.data ?? []),
  );
  return [...new Map(pieces.map((piece) => [piece.file, piece.packed])).values()].reduce((a, b) => a + b, 0);
}

/** Say what is to be seen, before it is. @param {any} manifest */
function entitle({ name, visit: { caption } }) {
  document.title = caption || name;
  const description = caption ? `${name}: ${caption}` : name;
  canvas.setAttribute("aria-label", description);
  document.getElementById("poster")?.setAttribute("alt", description);
}

async function open() {
  const manifest = await readManifest(),
    all = packedBytes(manifest);
  entitle(manifest);
  const device = await openDevice(manifest);
  const data = new Data((done) => {
    const of = done > all ? "" : ` of ${(all / MB).toFixed(1)}`;
    tell(`Loading ${(done / MB).toFixed(1)}${of} MB…`);
  });
  const frame = await Frame.open(manifest, device, canvas, data);
  device.lost.then((info) => {
    if (info.reason === "destroyed") return;
    tell("The graphics device was lost; loading the room again…");
    open().catch(failed);
  });
  const geometry = await readGeometry(manifest, data);
  tell("");
  if (visit) return visit.take(frame, data, geometry);
  visit = new Visit(manifest, canvas);
  openPanel(visit);
  openCard(visit);
  await visit.take(frame, data, geometry);
  follow(visit);
}

/** @type {Visit | undefined} */
let visit;
open().catch(failed);
