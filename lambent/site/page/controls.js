// The panel beside the picture.

import { keep, share } from "./keeping.js";
import { failed, say } from "./messages.js";
import { cameraAlong } from "./paths.js";

/** @typedef {import("./visit.js").Visit} Visit */

const THIRDS = 3; // of a stop, the steps of the exposure

/** @param {string} id @returns {any} */
const found = (id) => document.getElementById(id);
/** @param {{name: string}[]} ones */
const namesOf = (ones) => ones.map((one) => one.name);

/** Show the panel of a room. @param {Visit} visit */
export function openPanel(visit) {
  const { cameras, states, name, visit: about } = visit.manifest;
  found("name").textContent = name;
  for (const part of ["caption", "credit"]) {
    found(part).textContent = about[part];
    found(part).hidden = !about[part];
  }
  const ofStates = offer("states", namesOf(states), (number) => visit.choose(number));
  offer("views", namesOf(cameras), (number) => {
    visit.view(cameras[number]);
    say(cameras[number].name);
  });
  const ofWalks = offerWalks(visit);
  offerLook(visit);
  found("share").onclick = () => share(visit);
  found("save").onclick = () => keep(visit).catch(failed);
  visit.addEventListener("change", () => {
    mark(ofStates, visit.state);
    mark(ofWalks, namesOf(about.paths).indexOf(visit.motion?.name ?? ""));
  });
  found("states").hidden = states.length < 2;
  found("panel").hidden = false;
}

/** Fill a list with a button for each name. @param {string} id @param {string[]} names @param {(number: number) => void} act */
function offer(id, names, act) {
  const buttons = names.map((name, number) => {
    const button = document.createElement("button");
    button.textContent = name;
    button.addEventListener("click", () => act(number));
    return button;
  });
  found(id).replaceChildren(...buttons);
  found(id).hidden = !names.length;
  return buttons;
}

/** @param {HTMLElement[]} buttons @param {number} now */
const mark = (buttons, now) => buttons.forEach((one, i) => one.setAttribute("aria-pressed", String(i === now)));

/** Buttons that play a recorded walk, or stop it. @param {Visit} visit */
function offerWalks(visit) {
  const { paths } = visit.manifest.visit;
  return offer("walks", namesOf(paths), (number) => {
    const { name, seconds } = paths[number];
    if (visit.motion?.name === name) visit.stop();
    else visit.play({ name, seconds, timeS: 0, at: cameraAlong(paths[number]) });
    say(visit.motion ? `${name}, ${Math.round(seconds)} s` : `${name} stopped`);
  });
}

/** Exposure and view transform. @param {Visit} visit */
function offerLook(visit) {
  const { exposureEv, visit: about } = visit.manifest,
    [slider, shown, reset, transform] = ["exposure", "ev", "reset", "transform"].map(found);
  transform.replaceChildren(
    ...Object.entries(about.viewTransforms).map(([name, number]) => new Option(name, String(number))),
  );
  slider.oninput = () => visit.expose({ exposureEv: exposureEv + slider.value / THIRDS });
  reset.onclick = () => visit.expose({ exposureEv });
  transform.onchange = () => visit.expose({ viewTransform: Number(transform.value) });
  visit.addEventListener("change", () => {
    const thirds = Math.round(THIRDS * (visit.exposureEv - exposureEv));
    slider.value = thirds;
    shown.textContent = inWords(thirds);
    slider.setAttribute("aria-valuetext", inWords(thirds));
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
