// The card of a thing that was clicked: what it is made of, how that was measured, and in which finishes it comes.

import { element, found, offer } from "./elements.js";

/** @import { Visit } from "./visit.js" */

/** Show what the visitor clicks. @param {Visit} visit */
export function openCard(visit) {
  visit.addEventListener("change", () => fill(visit));
  found("go").onclick = () => visit.found && visit.goTo(visit.found);
  found("orbit").onclick = () => visit.toggleOrbit();
  found("close").onclick = () => {
    visit.select(null);
    visit.canvas.focus();
  };
}

/** @param {Visit} visit */
function fill(visit) {
  const thing = visit.found?.thing;
  found("card").hidden = !thing;
  found("orbit").ariaPressed = String(visit.pivot !== null);
  if (!thing) return;
  const { finishes, finishesOfStates } = visit.manifest.visit,
    now = finishesOfStates[visit.state][thing.material],
    { name, facts } = finishes[now];
  const lines = [["Finish", name], ...(facts.length ? facts : [["Measurement", "none on record"]])];
  found("thing").textContent = thing.name;
  found("facts").replaceChildren(
    ...lines.flatMap(([what, textContent]) => [element("dt", { textContent: what }), element("dd", { textContent })]),
  );
  offerFinishes(visit, thing.material, now);
}

/** @param {Visit} visit @param {string} material @param {number} now */
function offerFinishes(visit, material, now) {
  const offered = finishesOf(visit.manifest, material),
    place = offered.findIndex(({ finish }) => finish === now),
    list = found("finishes"),
    isFocused = list.contains(document.activeElement);
  const choose = (/** @type {number} */ i) =>
    visit.choose(stateWith(visit.manifest, visit.state, material, offered[i].finish), offered[i].label);
  const names = offered.map(({ label }) => label),
    mark = offer("finishes", names, choose);
  mark(place);
  list.hidden = offered.length < 2;
  if (isFocused) list.children[place].focus();
}

/** The finishes of a material in all states; those of one name with the state that has them. @param {any} manifest @param {string} material @returns {{finish: number, label: string}[]} */
export function finishesOf({ visit, states }, material) {
  const ofStates = visit.finishesOfStates.map((/** @type {Record<string, number>} */ one) => one[material]);
  const offered = [...new Set(ofStates)],
    names = offered.map((finish) => visit.finishes[finish].name);
  return offered.map((finish, i) => {
    const isOnly = names.filter((name) => name === names[i]).length === 1;
    return { finish, label: isOnly ? names[i] : `${names[i]} (${states[ofStates.indexOf(finish)].name})` };
  });
}

/** The state with a finish that differs least from the present one. @param {any} manifest @param {number} now @param {string} material @param {number} finish */
export function stateWith({ visit }, now, material, finish) {
  /** @type {Record<string, number>[]} */
  const all = visit.finishesOfStates;
  const differences = all.map((one) =>
    one[material] === finish ? Object.keys(one).filter((name) => one[name] !== all[now][name]).length : Infinity,
  );
  return differences.indexOf(Math.min(...differences));
}
