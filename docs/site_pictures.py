"""Makes the picture and the film of a site in the browser: pictures/site.jpg and site.webp.

.venv/bin/lambent bake builtin:room -o room.store --light-groups scene && .venv/bin/lambent export room.store -o site
.venv/bin/python docs/site_pictures.py site room.store        # needs Chromium; minutes on its software adapter
"""

from __future__ import annotations

import io
import json
import sys
import threading
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from lambent.bench.card_rows.site import SOFTWARE, browser_program
from lambent.core.views.camera import Camera, CameraPath
from lambent.scenes.camera_paths import camera_at
from lambent.site.serving import SiteServer
from lambent.store.contract import scene_record
from lambent.store.store import Store

PICTURES = Path(__file__).parent / "pictures"
SIZE, FILM = (1120, 630), (400, 225)
STEPS, MS = 24, 200
THING = 0.714, 0.74  # of the picture: what is clicked, the teapot


def main(site: Path, store: Path) -> None:
    with SiteServer(site) as server, sync_playwright() as driver:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        browser = driver.chromium.launch(executable_path=browser_program(), args=list(SOFTWARE))
        picture(browser, server.address)
        film(browser, server.address, scene_record(Store.open(store)).paths[0])
        browser.close()
        server.shutdown()


def opened(browser: Any, address: str, size: tuple[int, int], **more: Any) -> Page:
    page: Page = browser.new_page(viewport={"width": size[0], "height": size[1]}, **more)
    page.set_default_timeout(600_000)
    page.goto(address)
    page.wait_for_selector("body[data-frames]", state="attached")
    page.wait_for_load_state("networkidle")
    return page


def picture(browser: Any, address: str) -> None:
    """The page with its panel, and the card of a thing that was clicked."""
    page = opened(browser, address, SIZE)
    frames = page.get_attribute("body", "data-frames")
    page.mouse.click(SIZE[0] * THING[0], SIZE[1] * THING[1])
    page.wait_for_selector("#card:not([hidden])")
    page.wait_for_selector(f"body:not([data-frames='{frames}'])", state="attached")
    Image.open(io.BytesIO(page.screenshot())).convert("RGB").save(PICTURES / "site.jpg", quality=85)
    page.close()


def film(browser: Any, address: str, path: CameraPath) -> None:
    """A recorded walk, camera after camera by the page's address; controls are folded away."""
    page, shots = opened(browser, address, FILM, bypass_csp=True), []
    page.add_style_tag(content="#panel, #card, #message { display: none }")
    for step in range(STEPS):
        where = said(camera_at(path, path.seconds * step / (STEPS - 1)))
        page.evaluate("(where) => { location.hash = where }", where)
        page.wait_for_selector(f"body[data-camera='{where}']", state="attached")
        shots.append(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))
    shots[0].save(
        PICTURES / "site.webp", save_all=True, append_images=shots[1:], duration=MS, loop=0, quality=60, method=6
    )


def said(camera: Camera) -> str:
    """As the page's address has it."""
    numbers = [*camera.position, *camera.target, camera.fov_y_deg]
    return ",".join(json.dumps(round(float(x), 4)).removesuffix(".0") for x in numbers)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
