// The panel beside the picture.

import { failed, say } from "./messages.js";

/** @typedef {import("./visit.js").Visit} Visit */

/** @param {string} id @returns {any} */
const found = (id) => document.getElementById(id);

/** Fill a list with a button for each name. @param {string} id @param {string[]} names @param {(number: number) => void} act */
function offer(id, names, act) {
  const buttons = names.map((name, number) => {
    const button = document.createElement("button");
    button.textContent = name;
    button.addEventListener("click", () => act(number));
    return button;
  });
  found(id).replaceChildren(...buttons);
  return buttons;
}

/** Buttons of the room's states. @param {Visit} visit */
function offerStates(visit) {
  const names = visit.manifest.states.map((/** @type {{name: string}} */ state) => state.name);
  found("states").hidden = names.length < 2;
  const mark = () => buttons.forEach((one, number) => one.setAttribute("aria-pressed", String(number === visit.state)));
  const buttons = offer("states", names, (number) => {
    visit
      .choose(number)
      .then(() => say(names[number]))
      .catch(failed);
    mark();
  });
  mark();
}

/** Show the panel of a room. @param {Visit} visit */
export function openPanel(visit) {
  const { cameras, name } = visit.manifest;
  found("name").textContent = name;
  offerStates(visit);
  const names = cameras.map((/** @type {{name: string}} */ camera) => camera.name);
  offer("views", names, (number) => visit.go(cameras[number]));
  found("share").onclick = async () => {
    history.replaceState(null, "", `#${visit.address()}`);
    await navigator.clipboard?.writeText(location.href).catch(() => undefined);
  };
  found("panel").hidden = false;
}
