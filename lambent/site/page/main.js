// The page: loads the room and shows it; again after the graphics device was lost, where the visitor stands.

import { openPanel } from "./controls.js";
import { openDevice } from "./device.js";
import { Frame } from "./frame.js";
import { Data, readManifest } from "./loading.js";
import { failed, tell } from "./messages.js";
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

async function open() {
  const manifest = await readManifest(),
    all = packedBytes(manifest);
  document.title = manifest.name;
  const device = await openDevice(manifest);
  const data = new Data((done) => {
    const of = done > all ? "" : ` of ${(all / MB).toFixed(1)}`;
    tell(`Loading ${(done / MB).toFixed(1)}${of} MB…`);
  });
  const frame = await Frame.open(manifest, device, canvas, data);
  if (visit) {
    Object.assign(visit, { frame, data });
    if (visit.state) await frame.show(visit.state, data);
  } else {
    visit = new Visit(manifest, canvas, frame, data);
    openPanel(visit);
    visit.follow();
  }
  device.lost.then((info) => {
    if (info.reason === "destroyed") return;
    tell("The graphics device was lost; loading the room again…");
    open().catch(failed);
  });
  tell("");
  visit.touch();
}

/** @type {Visit | undefined} */
let visit;
open().catch(failed);
