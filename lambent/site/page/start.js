// Before the page's modules, and no module itself, because browsers load none from a disk: says if they do not come.

{
  const message = /** @type {HTMLElement} */ (document.getElementById("message"));
  message.textContent = "Loading…";
  const fault =
    location.protocol === "file:"
      ? "Browsers show the room from a server only: put this folder on a web host, or run: lambent serve FOLDER"
      : "The page's scripts cannot be fetched; is the server still there?";
  const isScript = (/** @type {EventTarget | null} */ one) => one instanceof HTMLScriptElement;
  addEventListener("error", (event) => isScript(event.target) && (message.textContent = fault), true);
}
