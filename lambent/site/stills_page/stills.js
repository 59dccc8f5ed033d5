// Before and after: two stills of a view, one upon the other, and a slider between them. Without it, the page shows all.

/** @param {string} id */
const found = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
const SIDES = /** @type {const} */ (["before", "after"]);
const between = /** @type {HTMLInputElement} */ (found("between"));
const choices = SIDES.map((side) => /** @type {HTMLSelectElement} */ (found(`state-${side}`)));
const views = [...document.querySelectorAll(".view")].map((view) => [...view.querySelectorAll("figure")]);
const links = [...found("links").querySelectorAll("a")];
let shown = 0;

/** Show the chosen view in both states. */
function show() {
  SIDES.forEach((side, number) => {
    const still = /** @type {HTMLImageElement} */ (views[shown][choices[number].selectedIndex].querySelector("img"));
    const image = /** @type {HTMLImageElement} */ (found(side));
    Object.assign(image, { src: still.src, alt: still.alt, width: still.width, height: still.height });
    found("pair").style.setProperty("--aspect", String(still.width / still.height));
  });
  links.forEach((link, number) => link.setAttribute("aria-current", String(number === shown)));
  slide();
}

/** Follow the slider. */
function slide() {
  const [before, after] = choices.map((choice) => choice.value);
  found("pair").style.setProperty("--before", `${between.value}%`);
  between.setAttribute("aria-valuetext", `${between.value} % ${before}, the rest ${after}`);
}

if (views.length && views[0].length > 1) {
  choices.forEach((choice, number) => {
    choice.append(...views[0].map((figure) => new Option(figure.dataset.state)));
    choice.selectedIndex = number;
    choice.addEventListener("change", show);
  });
  links.forEach((link, number) =>
    link.addEventListener("click", (event) => {
      event.preventDefault();
      shown = number;
      show();
    }),
  );
  between.addEventListener("input", slide);
  found("compare").hidden = false;
  show();
}
