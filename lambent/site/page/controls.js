// The panel beside the picture.

import { found, offer } from "./elements.js";
import { keep, share } from "./keeping.js";
import { say, tellRest } from "./messages.js";
import { cameraAlong } from "./paths.js";

/** @import { Visit } from "./visit.js" */

const THIRDS = 3; // of a stop, the steps of the exposure

/** @param {{name: string}[]} ones */
const namesOf = (ones) => ones.map((one) => one.name);

/** Show the panel of a room. @param {Visit} visit */
export function openPanel(visit) {
  const { cameras, states, name, visit: about } = visit.manifest;
  for (const [part, text] of Object.entries({ name, caption: about.caption, credit: about.credit })) {
    found(part).textContent = text;
    found(part).hidden = !text;
  }
  const markState = offer("states", namesOf(states), (number) => visit.choose(number));
  offer("views", namesOf(cameras), (number) => {
    visit.view(cameras[number]);
    say(cameras[number].name);
  });
  const markWalk = offer("walks", namesOf(about.paths), (number) => walk(visit, about.paths[number]));
  offerLook(visit);
  found("share").onclick = () => share(visit);
  found("save").onclick = () => keep(visit);
  visit.addEventListener("change", () => {
    markState(visit.state);
    markWalk(namesOf(about.paths).indexOf(visit.motion?.name ?? ""));
  });
  found("states").hidden = states.length < 2;
  found("panel").hidden = false;
}

/** Play a recorded walk, or stop it. @param {Visit} visit @param {any} walk */
async function walk(visit, { name, seconds, cameras }) {
  if (!visit.data) return;
  if (visit.motion?.name === name) {
    visit.stop();
    return say(`${name} stopped`);
  }
  const samples = new Float32Array(/** @type {ArrayBuffer} */ (await visit.data.read(cameras)));
  tellRest("");
  visit.play({ name, seconds, timeS: 0, at: cameraAlong(name, samples, seconds) });
  say(`${name}, ${Math.round(seconds)} s`);
}

/** Exposure and view transform. @param {Visit} visit */
function offerLook(visit) {
  const { exposureEv, visit: about } = visit.manifest,
    [slider, shown, reset, transform] = ["exposure", "ev", "reset", "transform"].map(found);
  const transforms = Object.entries(about.viewTransforms);
  transform.replaceChildren(...transforms.map(([name, number]) => new Option(name, String(number))));
  slider.oninput = () => visit.expose({ exposureEv: exposureEv + slider.value / THIRDS });
  reset.onclick = () => visit.expose({ exposureEv });
  transform.onchange = () => visit.expose({ viewTransform: Number(transform.value) });
  visit.addEventListener("change", () => {
    const thirds = Math.round(THIRDS * (visit.exposureEv - exposureEv));
    slider.value = thirds;
    shown.textContent = slider.ariaValueText = inWords(thirds);
    reset.disabled = visit.exposureEv === exposureEv;
    transform.value = visit.viewTransform;
  });
}

/** As "+1 1/3 EV". @param {number} thirds */
export function inWords(thirds) {
  const whole = Math.floor(Math.abs(thirds) / THIRDS),
    part = Math.abs(thirds) % THIRDS;
  const words = [...(whole || !part ? [whole] : []), ...(part ? [`${part}/3`] : [])];
  return `${thirds ? (thirds > 0 ? "+" : "−") : ""}${words.join(" ")} EV`;
}
