// The page: loads the room and shows it; again after the graphics device was lost, where the visitor stands.

import { openCard } from "./card.js";
import { openPanel } from "./controls.js";
import { openDevice, refusal } from "./device.js";
import { found } from "./elements.js";
import { Frame } from "./frame.js";
import { follow } from "./input.js";
import { offerLights } from "./lights.js";
import { Data, neededAgain, readManifest, SiteError } from "./loading.js";
import { caught, failed, forgive, tell, tellRest } from "./messages.js";
import { readGeometry } from "./picking.js";
import { Visit } from "./visit.js";

const canvas = /** @type {HTMLCanvasElement} */ (found("picture"));
const MB = 1e6;

/** Bytes of the files that the first state needs. @param {any} manifest @returns {number} */
function packedBytes(manifest) {
  const { counts } = manifest.states[0];
  const ones = ["buffer", "texture"].flatMap((kind) => manifest.tables[kind].slice(0, counts[kind])),
    pieces = ones.flatMap(({ data }) => (data ? [data, data.standin ?? []].flat() : []));
  return [...new Map(pieces.map((piece) => [piece.file, piece.packed])).values()].reduce((a, b) => a + b, 0);
}

/** Say what is to be seen, before it is. @param {any} manifest */
function entitle({ name, visit: { caption } }) {
  document.title = caption || name;
  canvas.ariaLabel = found("poster").alt = caption ? `${name}: ${caption}` : name;
}

/** Load the room: it is shown with stand-ins for large textures first, then with all that it consists of. */
async function open() {
  shown = undefined;
  const manifest = await readManifest();
  entitle(manifest);
  const device = await openDevice(manifest),
    all = packedBytes(manifest),
    here = visit ?? new Visit(manifest, canvas);
  const report = (/** @type {number} */ done) => {
    const of = done > all ? "" : ` of ${(all / MB).toFixed(1)}`;
    (shown ? tellRest : tell)(`Loading ${(done / MB).toFixed(1)}${of} MB…`);
  };
  const { vertices, indices } = manifest.visit.geometry,
    files = [vertices, indices].map((at) => manifest.tables.buffer[at].data.file); // for clicks, too
  const data = new Data(report, new Set([...neededAgain(manifest), ...files]));
  device.onuncapturederror = ({ error }) => failed(new SiteError(refusal(error)));
  device.lost.then((info) => {
    if (info.reason === "destroyed") return;
    tell("The graphics device was lost; loading the room again…");
    attempt(open);
  });
  await Promise.all([
    readGeometry(manifest, data).then((geometry) => (here.geometry = geometry)),
    Frame.open(manifest, device, canvas, data, here.state, (frame) => {
      if (frame === shown) return here.touch();
      shown = frame;
      tell("");
      report(data.done);
      here.take(frame, data);
      offerLights(here);
      if (!visit) begin(here);
    }),
  ]);
  files.forEach((file) => data.files.delete(file));
}

/** @param {Visit} here */
function begin(here) {
  visit = here;
  openPanel(here);
  openCard(here);
  follow(here);
  here.changed();
}

/** Once more: what has not arrived, or everything where there is no picture yet. */
const again = () => (shown && visit?.data ? shown.show(visit.state, visit.data) : open());

/** @param {() => Promise<void>} act */
const attempt = (act) => act().then(() => tellRest(""));

/** @type {Visit | undefined} */
let visit;
/** @type {Frame | undefined} that shows the room on the present device */
let shown;
for (const kind of ["error", "unhandledrejection"]) addEventListener(kind, caught);
found("again").onclick = () => {
  forgive();
  attempt(again);
};
attempt(open);
