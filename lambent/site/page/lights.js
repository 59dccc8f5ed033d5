// Sliders of the room's light groups: brightness and colour temperature, as in the window's Light panel.

import { element, found } from "./elements.js";
import { tellRest } from "./messages.js";
import { factorOf, Mixing } from "./mixing.js";

/** @import { Light } from "./address.js" */
/** @import { BlackBodies, Mix } from "./mixing.js" */
/** @import { Visit } from "./visit.js" */

const MOST_PERCENT = 200, // of the sliders
  MOST_INTENSITY = 1000, // as of Python
  USUAL_K = 6500,
  RATIO_K = 1.01; // of a step of a slider

/** Steps of a slider from one temperature to another. @param {number} fromK @param {number} toK */
const stepsK = (fromK, toK) => Math.log(toK / fromK) / Math.log(RATIO_K);

/** The sliders of one group. */
class Row {
  percent = element("output");
  kelvin = element("output");

  /** @param {string} name @param {[number, number]} rangeK @param {(change: Partial<Mix> | null, rests: boolean) => void} changed null: reset */
  constructor(name, [lowK, highK], changed) {
    const ariaLabel = `${name}: colour temperature`;
    this.lowK = lowK;
    this.bright = slider(MOST_PERCENT, `${name}: brightness`, (value) => ({ intensity: value / 100 }), changed);
    const most = Math.round(stepsK(lowK, highK));
    this.warm = slider(most, ariaLabel, (value) => ({ kelvin: lowK * RATIO_K ** value }), changed);
    this.tints = element("input", { type: "checkbox", ariaLabel, title: "K" });
    this.tints.onchange = () => changed({ kelvin: this.tints.checked ? USUAL_K : null }, true);
    const legend = element("legend", { textContent: name });
    this.element = element("fieldset", {}, legend, this.bright, this.percent, this.tints, this.warm, this.kelvin);
  }

  /** @param {Mix} mix */
  show({ intensity, kelvin }) {
    const percent = Math.round(100 * intensity);
    this.bright.max = String(Math.max(MOST_PERCENT, percent));
    this.bright.value = String(percent);
    this.percent.textContent = this.bright.ariaValueText = `${percent} %`;
    this.tints.checked = kelvin !== null;
    this.warm.disabled = kelvin === null;
    this.warm.value = String(stepsK(this.lowK, kelvin ?? USUAL_K));
    this.kelvin.textContent = this.warm.ariaValueText = kelvin === null ? "" : `${Math.round(kelvin)} K`;
  }
}

/** A slider that says what it changes as it moves, and once it rests; a double click resets. @param {number} most @param {string} ariaLabel @param {(value: number) => Partial<Mix>} mixOf @param {ConstructorParameters<typeof Row>[2]} changed */
function slider(most, ariaLabel, mixOf, changed) {
  const made = element("input", { type: "range", max: String(most), ariaLabel });
  made.oninput = () => changed(mixOf(Number(made.value)), false);
  made.onchange = () => changed(mixOf(Number(made.value)), true);
  made.ondblclick = () => changed(null, true);
  return made;
}

/** The light of a visit: its sliders, and the mix that its frame shows. */
export class Lights {
  /** @type {Mix[]} by group: the state's own */ own = [];
  /** @type {Mix[]} what is wanted */ mixes = [];
  asked = 0;

  /** @param {Visit} visit */
  constructor(visit) {
    this.visit = visit;
    this.names = /** @type {string[]} */ (visit.manifest.lightGroups);
    this.bodies = /** @type {BlackBodies} */ (visit.manifest.blackBodies);
    this.rows = this.names.map(
      (name, i) =>
        new Row(name, this.bodies.sliderK, (change, rests) => {
          this.mixes[i] = change ? { ...this.mixes[i], ...change } : this.own[i];
          this.update(rests);
        }),
    );
    const reset = element("button", { textContent: "Reset light", onclick: () => this.restore({}) });
    visit.addEventListener("light", () => this.restore(visit.light));
    found("light").append(...this.rows.map((row) => row.element), reset);
    found("light").hidden = false;
  }

  /** Light the visit's frame, which is new, as `visit.light` says. */
  attach() {
    const { frame, manifest, data, light, state } = this.visit;
    if (!frame || !data) return;
    this.mixing = new Mixing(manifest, frame.objects, data);
    frame.objects.leave = () => this.mixing?.leave();
    frame.entered = (number) => this.follow(number);
    this.follow(state);
    this.restore(light);
  }

  /** Show the own light of a state. @param {number} number */
  follow(number) {
    this.asked++;
    this.own = this.visit.manifest.states[number].mixing.light;
    this.mixes = [...this.own];
    this.mixing?.take(number, this.factors);
    this.show();
    document.body.dataset.light = "{}";
  }

  /** Mix groups like this, the others as the state's own. @param {Light} light */
  restore(light) {
    const [lowK, highK] = this.bodies.rangeK;
    this.mixes = this.own.map((mix, i) => {
      if (!Object.hasOwn(light, this.names[i])) return mix;
      const [intensity = 1, kelvin] = [light[this.names[i]]].flat();
      const isK = kelvin >= lowK && kelvin <= highK;
      return { ...mix, intensity: Math.min(intensity, MOST_INTENSITY), kelvin: isK ? kelvin : null };
    });
    this.update(true);
  }

  get factors() {
    return this.mixes.map((mix) => factorOf(mix, this.bodies));
  }

  /** Show what is wanted; with probes and skies if it `rests`. @param {boolean} rests */
  async update(rests) {
    const { mixing, visit } = this,
      wanted = ++this.asked;
    this.show();
    const changed = this.names.flatMap((name, i) => (Object.hasOwn(visit.light, name) ? [i] : []));
    await mixing?.load(changed);
    tellRest("");
    if (wanted !== this.asked) return; // a later one shows more
    mixing?.mix(this.factors, rests);
    if (rests) document.body.dataset.light = JSON.stringify(visit.light);
    visit.frame?.finer();
  }

  /** The sliders, and `visit.light`. */
  show() {
    this.mixes.forEach((mix, i) => this.rows[i].show(mix));
    const changed = this.mixes.flatMap(({ intensity, kelvin }, i) => {
      const isOwn = intensity === this.own[i].intensity && kelvin === this.own[i].kelvin;
      return isOwn ? [] : [[this.names[i], kelvin === null ? intensity : [intensity, Math.round(kelvin)]]];
    });
    this.visit.light = Object.fromEntries(changed);
  }
}

/** Sliders for a visit whose frame is new, if the room has light groups. @param {Visit} visit */
export function offerLights(visit) {
  if (!visit.manifest.lightGroups) return;
  visit.lights ??= new Lights(visit);
  visit.lights.attach();
}
