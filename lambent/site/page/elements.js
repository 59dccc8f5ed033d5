// Elements of the page.

/** @param {string} id @returns {any} */
export const found = (id) => document.getElementById(id);

/**
 * A new element. @template {keyof HTMLElementTagNameMap} K @param {K} tag
 * @param {Partial<HTMLElementTagNameMap[K]>} properties @param {HTMLElement[]} children @returns {HTMLElementTagNameMap[K]}
 */
export function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

/** Fill a list with a button for each name; what is returned marks one as pressed. @param {string} id @param {string[]} names @param {(number: number) => void} act */
export function offer(id, names, act) {
  const buttons = names.map((textContent, i) => element("button", { textContent, onclick: () => act(i) }));
  found(id).replaceChildren(...buttons);
  found(id).hidden = !names.length;
  return (/** @type {number} */ now) => buttons.forEach((one, i) => (one.ariaPressed = String(i === now)));
}
