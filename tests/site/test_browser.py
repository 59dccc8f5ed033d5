"""The page in headless Chromium: the same pictures as the native renderer, a visit, and what goes wrong."""

from __future__ import annotations

import base64
import json
import shutil

import numpy as np
import pytest

from lambent.core.pictures.metrics import flip
from lambent.core.views.camera import Camera
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.render.applied_materials import AppliedMaterials
from lambent.store.kept.states import variants_of
from lambent.store.store import Store
from tests.site.conftest import served
from tests.site.test_page_modules import said

SIZE = 96, 64
EYES = ((0, 1, 3.4), (0.3, 0.4, 0.2), (-0.6, 1.2, 0.5), (0.5, 1.5, -0.4), (0, 0.3, 0.8), (0.7, 0.2, -0.7))
PIXELS = """async ([cameras, width, height]) => {
  const { readManifest, Data } = await import("/loading.js");
  const { Frame } = await import("/frame.js"), { openDevice } = await import("/device.js");
  const manifest = await readManifest(), device = await openDevice(manifest), faults = [];
  device.addEventListener("uncapturederror", (event) => faults.push(event.error.message));
  const data = new Data(() => {});
  const frame = await Frame.open(manifest, device, document.createElement("canvas"), data);
  frame.resize(width, height);
  const found = [];
  for (const state of [0, 1, 0]) {
    await frame.show(state, data);
    for (const camera of cameras) {
      const bytes = await frame.pixels(camera);
      found.push(btoa(String.fromCharCode(...bytes)));
    }
  }
  return { faults, found, exposureEv: manifest.exposureEv };
}"""


@pytest.mark.slow
def test_pictures_are_those_of_the_native_renderer(chromium, device, blue_box, box_site):
    """Six cameras, in both states, and back in the first."""
    store = Store.open(blue_box)
    renderer = Renderer(device, store)
    low, high = np.array(renderer.scene.record.bounds)
    middle, half = (low + high) / 2, (high - low) / 2
    cameras = [
        Camera(f"view {k}", tuple((middle + half * (np.array(eye) - [0, 1, 0])).tolist()), tuple(middle.tolist()))
        for k, eye in enumerate(EYES)
    ]
    with chromium(bypass_csp=True) as page, served(box_site) as address:
        page.goto(f"{address}site.css")
        answer = page.evaluate(PIXELS, [[said(camera) for camera in cameras], *SIZE])
    assert answer["faults"] == []
    found = iter(answer["found"])
    applied, (blue,) = AppliedMaterials(store, renderer, lambda text: None), variants_of(store)
    for looks in ({}, blue.looks, {}):
        applied.apply(looks, {}, {})
        for camera in cameras:
            shown = np.frombuffer(base64.b64decode(next(found)), np.uint8).reshape(SIZE[1], SIZE[0], 4)[..., :3]
            state = FrameState(
                camera, *SIZE, planar="off", exposure_ev=answer["exposureEv"], materials=applied.materials,
                maps=renderer.light_version,
            )  # fmt: skip
            native = renderer.display_image(state)
            assert native.std() > 10, f"{camera.name} shows something"
            assert np.abs(shown.astype(float) - native).mean() < 0.5, camera.name
            assert flip(native / 255, shown / 255).mean < 0.02, camera.name


@pytest.mark.slow
def test_a_visit(chromium, box_site):
    """Look by dragging, walk by keys, go to a view, share, resize."""
    with chromium() as page, served(box_site) as address:
        faults = []
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.goto(address)
        page.wait_for_selector("body[data-frames]", state="attached")
        assert page.title() == "box" and page.inner_text("#message") == "" and not page.is_visible("#poster")
        first = page.get_attribute("body", "data-camera")
        page.mouse.move(150, 80)
        page.mouse.down()
        page.mouse.move(180, 86, steps=3)
        page.mouse.up()
        page.wait_for_selector(f"body:not([data-camera='{first}'])", state="attached")
        turned = page.get_attribute("body", "data-camera")
        assert turned.split(",")[:3] == first.split(",")[:3], "looking does not move the eye"
        page.keyboard.down("w")
        page.wait_for_selector(f"body:not([data-camera='{turned}'])", state="attached")
        page.keyboard.up("w")
        page.click("#views button >> text=front")
        page.wait_for_selector(f"body[data-camera='{first}']", state="attached")
        page.click("#states button >> text=blue")
        page.wait_for_selector("body[data-state='blue']", state="attached")
        assert page.get_attribute("#states button >> text=blue", "aria-pressed") == "true"
        page.click("#share")
        assert page.url == f"{address}#{first}&state=blue"
        frames = int(page.get_attribute("body", "data-frames"))
        page.set_viewport_size({"width": 200, "height": 300})
        page.wait_for_selector(f"body:not([data-frames='{frames}'])", state="attached")
        assert page.get_attribute("#picture", "width") == "200"
        where = turned.replace(turned.split(",")[0], "0.25", 1)
        page.goto(f"{address}#{where}")
        page.wait_for_selector(f"body[data-camera='{where}']", state="attached")
        assert faults == []


@pytest.mark.slow
def test_a_lost_device_comes_back(chromium, box_site):
    with chromium() as page, served(box_site) as address:
        page.goto(address)
        page.wait_for_selector("body[data-frames]", state="attached")
        frames = page.get_attribute("body", "data-frames")
        page.context.browser.new_browser_cdp_session().send("Browser.crashGpuProcess")
        page.wait_for_selector(f"body:not([data-frames='{frames}'])", state="attached")
        page.wait_for_selector("#message:empty", state="attached")


@pytest.mark.slow
def test_a_damaged_or_missing_file_is_said(chromium, box_site, tmp_path):
    damaged = shutil.copytree(box_site, tmp_path / "damaged")
    manifest = json.loads((box_site / "manifest.json").read_text())
    first = manifest["tables"]["texture"][: manifest["states"][0]["counts"]["texture"]]
    name = max((one["data"] for one in first if "data" in one), key=lambda piece: piece["packed"])["file"]
    largest = damaged / name
    content = bytearray(largest.read_bytes())
    content[len(content) // 2] ^= 255
    largest.write_bytes(content)
    missing = shutil.copytree(box_site, tmp_path / "missing")
    (missing / name).unlink()
    for folder, words in ((damaged, "is damaged; export the site again"), (missing, "cannot be fetched (404")):
        with chromium() as page, served(folder) as address:
            page.goto(address)
            page.wait_for_selector(f"#message:has-text('{words}')")
            assert page.is_visible("#poster")
