// What the page says: while it loads, when something goes wrong, and what has changed.

import { element, found } from "./elements.js";
import { FileError, SiteError } from "./loading.js";

const [message, retry, rest, said] = ["message", "again", "rest", "said"].map(found);
/** @type {any} */
let fault = null;

/** Say over the picture how far the page is; a fault stays. @param {string} text */
export function tell(text) {
  if (!fault) message.textContent = text;
}

/** Say beside the picture how much of the rest has arrived; not aloud. @param {string} text */
export function tellRest(text) {
  rest.textContent = text;
}

/** Say what has changed; it fades, but for what `stays`. @param {string} text */
export function say(text, stays = false) {
  const line = element("span", { textContent: text, className: stays ? "stays" : "" });
  said.replaceChildren(line); // a new element: read aloud and faded anew
}

/** @param {any} error */
export function failed(error) {
  fault = error;
  message.textContent =
    error instanceof SiteError ? error.message : `The room cannot be shown: ${error.message ?? error}`;
  retry.hidden = !(error instanceof FileError);
  if (!(error instanceof SiteError)) console.error(error);
}

/** Say of what fails anywhere, but in browsers' extensions. @param {any} event */
export function caught(event) {
  const error = event.error ?? event.reason;
  if (!error || /-extension:/.test(error.stack)) return;
  event.preventDefault();
  failed(error);
}

/** Say nothing more of the last fault. */
export function forgive() {
  fault = null;
  retry.hidden = true;
  tell("");
}
