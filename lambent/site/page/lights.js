// Sliders of the room's light groups: brightness and colour temperature, as in the window's Light panel.

import { failed, tellRest } from "./messages.js";
import { factorOf, Mixing } from "./mixing.js";

/** @typedef {import("./visit.js").Visit} Visit @typedef {import("./mixing.js").Mix} Mix */
/** @typedef {import("./address.js").Light} Light by group: intensity, or intensity and K */

const MOST_PERCENT = 200, // of the sliders
  MOST_INTENSITY = 1000, // as of Python
  USUAL_K = 6500,
  RATIO_K = 1.01; // of a step of a slider

/**
 * An element of the page. @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag @param {Record<string, string>} properties @returns {HTMLElementTagNameMap[K]}
 */
function element(tag, properties) {
  const made = document.createElement(tag);
  Object.assign(made, properties);
  return made;
}

/** The sliders of one group. */
class Row {
  /** @param {string} name @param {[number, number]} rangeK @param {(change: Partial<Mix> | null, rests: boolean) => void} changed null: reset */
  constructor(name, rangeK, changed) {
    const steps = rangeK.map((kelvin) => Math.round(Math.log(kelvin / rangeK[0]) / Math.log(RATIO_K)));
    this.lowK = rangeK[0];
    this.bright = element("input", { type: "range", max: String(MOST_PERCENT), ariaLabel: `${name}: brightness` });
    this.percent = element("output", {});
    this.tints = element("input", { type: "checkbox", ariaLabel: `${name}: colour temperature`, title: "K" });
    this.warm = element("input", { type: "range", max: String(steps[1]), ariaLabel: `${name}: colour temperature` });
    this.kelvin = element("output", {});
    this.element = element("fieldset", {});
    this.element.append(
      element("legend", { textContent: name }),
      ...[this.bright, this.percent, this.tints, this.warm, this.kelvin],
    );
    const brightness = () => ({ intensity: Number(this.bright.value) / 100 });
    const temperature = () => ({
      kelvin: this.tints.checked ? rangeK[0] * RATIO_K ** Number(this.warm.value) : null,
    });
    this.bright.oninput = () => changed(brightness(), false);
    this.bright.onchange = () => changed(brightness(), true);
    this.warm.oninput = () => changed(temperature(), false);
    this.warm.onchange = () => changed(temperature(), true);
    this.tints.onchange = () => changed({ kelvin: this.tints.checked ? USUAL_K : null }, true);
    this.bright.ondblclick = this.warm.ondblclick = () => changed(null, true);
  }

  /** @param {Mix} mix */
  show({ intensity, kelvin }) {
    const percent = Math.round(100 * intensity);
    this.bright.max = String(Math.max(MOST_PERCENT, percent));
    this.bright.value = String(percent);
    this.percent.textContent = this.bright.ariaValueText = `${percent} %`;
    this.tints.checked = kelvin !== null;
    this.warm.disabled = kelvin === null;
    this.warm.value = String(Math.log((kelvin ?? USUAL_K) / this.lowK) / Math.log(RATIO_K));
    this.kelvin.textContent = this.warm.ariaValueText = kelvin === null ? "" : `${Math.round(kelvin)} K`;
  }
}

/** The light of a visit: its sliders, and the mix that its frame shows. */
export class Lights {
  /** @param {Visit} visit */
  constructor(visit) {
    const { lightGroups, blackBodies } = visit.manifest;
    this.visit = visit;
    /** @type {string[]} */
    this.names = lightGroups;
    /** @type {import("./mixing.js").BlackBodies} */
    this.bodies = blackBodies;
    this.asked = 0;
    /** @type {Mix[]} by group: the state's own, and what is wanted */
    this.own = this.mixes = [];
    this.rows = this.names.map(
      (name, i) =>
        new Row(name, this.bodies.sliderK, (change, rests) => {
          this.mixes[i] = change ? { ...this.mixes[i], ...change } : this.own[i];
          this.change(rests);
        }),
    );
    const reset = element("button", { textContent: "Reset light" });
    reset.onclick = () => this.restore({});
    visit.addEventListener("light", () => this.restore(visit.light));
    const panel = /** @type {HTMLElement} */ (document.getElementById("light"));
    panel.append(...this.rows.map((row) => row.element), reset);
    panel.hidden = false;
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
    this.change(true);
  }

  /** Show what is wanted; with probes and skies if it `rests`. @param {boolean} rests */
  change(rests) {
    this.update(rests).catch(failed);
  }

  get factors() {
    return this.mixes.map((mix) => factorOf(mix, this.bodies));
  }

  /** @param {boolean} rests */
  async update(rests) {
    const { mixing, visit } = this,
      wanted = ++this.asked;
    this.show();
    const changed = this.names.flatMap((name, i) => (Object.hasOwn(visit.light, name) ? [i] : []));
    await mixing?.load(changed);
    await mixing?.objects.refined; // what a mix adds to is exact
    tellRest("");
    if (wanted !== this.asked) return; // a later one shows more
    mixing?.mix(this.factors, rests);
    if (rests) document.body.dataset.light = JSON.stringify(visit.light);
    visit.frame?.finer();
  }

  /** The sliders, and `visit.light`. */
  show() {
    this.mixes.forEach((mix, i) => this.rows[i].show(mix));
    const changed = this.mixes.map(({ intensity, kelvin }, i) => {
      const isOwn = intensity === this.own[i].intensity && kelvin === this.own[i].kelvin;
      return isOwn ? [] : [[this.names[i], kelvin === null ? intensity : [intensity, Math.round(kelvin)]]];
    });
    this.visit.light = Object.fromEntries(changed.flat());
  }
}

/** Sliders for a visit whose frame is new, if the room has light groups. @param {Visit} visit */
export function offerLights(visit) {
  if (!visit.manifest.lightGroups) return;
  visit.lights ??= new Lights(visit);
  visit.lights.attach();
}
