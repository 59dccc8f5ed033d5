"""A visit in headless Chromium: things, walks, exposure, links and pictures, by mouse, keys and fingers."""

from __future__ import annotations

import io
import math
import shutil
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import lambent
from lambent.core.pictures.metrics import flip
from lambent.core.views.camera import rays_through
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.render.applied_materials import AppliedMaterials
from lambent.store.contract import scene_record, whole_objects, write_scene_record
from lambent.store.kept.states import variants_of
from lambent.store.store import Store
from lambent.viewer.cameras.picking import Geometry
from tests.site.conftest import VIEWPORT, served
from tests.site.test_export import manifest_of

pytestmark = pytest.mark.slow
CAPTION, CREDIT = "Küche für Frau Süß – „hell“", "© 2026 Jörg Möller"
SIZE = VIEWPORT["width"], VIEWPORT["height"]
THING, FLOOR = (64, 112), (100, 197)  # px of a wall, and of the floor, beside the folded panel


@pytest.fixture(scope="module")
def store(blue_box, tmp_path_factory):
    """The box with a caption, and with a name that would be markup."""
    folder = shutil.copytree(blue_box, tmp_path_factory.mktemp("visited") / "box.store")
    found = Store.open(folder)
    update = {"caption": CAPTION, "credit": CREDIT, "name": "<b>Küche</b>"}
    write_scene_record(found, scene_record(found).model_copy(update=update))
    found.close()
    return Store.open(folder)


@pytest.fixture(scope="module")
def site(adapter, store, tmp_path_factory):
    folder = tmp_path_factory.mktemp("visited_site") / "box"
    lambent.export(store.folder, folder)
    return folder


@pytest.fixture(scope="module")
def hit(store):
    """(name, place) of what the window would pick at a pixel of the first camera."""
    record = scene_record(store)
    geometry = Geometry(store.read("geometry/positions"), store.read("geometry/faces"), whole_objects(record.objects))

    def of(x, y):
        camera = record.cameras[0]
        towards = rays_through(camera, x, y, *SIZE)
        found, distance_m = geometry.hit(camera.position, towards)
        return found.name, np.array(camera.position) + distance_m * towards

    return of


def camera_of(page):
    return np.array([float(x) for x in page.get_attribute("body", "data-camera").split(",")])


def moved(page, act):
    """Do something, and wait until the camera has moved."""
    before = page.get_attribute("body", "data-camera")
    act()
    page.wait_for_selector(f"body:not([data-camera='{before}'])", state="attached")


def opened(page, address):
    faults = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.goto(address)
    page.wait_for_selector("body[data-frames]", state="attached")
    return faults


@pytest.mark.long
def test_things_by_mouse_and_keys(chromium, site, hit):
    with chromium() as page, served(site) as address:
        faults = opened(page, address)
        first = camera_of(page)
        assert page.title() == CAPTION and page.inner_text("#credit") == CREDIT
        assert page.inner_text("#name") == "<b>Küche</b>"
        assert page.get_attribute("#picture", "aria-label") == f"<b>Küche</b>: {CAPTION}"

        page.mouse.click(*THING)
        name, place = hit(*THING)
        assert page.inner_text("#thing") == name and "none on record" in page.inner_text("#facts")
        assert page.locator("#finishes button").all_inner_texts() == ["red (as baked)", "red (blue)"]
        page.click("#finishes button >> text=red (blue)")
        page.wait_for_selector("body[data-state='blue']", state="attached")
        assert page.get_attribute("#finishes button >> text=red (blue)", "aria-pressed") == "true"
        assert page.get_attribute("#states button >> text=blue", "aria-pressed") == "true"
        assert page.inner_text("#said") == "red (blue)" and page.inner_text("#message") == ""

        page.focus("#picture")
        page.keyboard.press("o")
        assert page.get_attribute("#orbit", "aria-pressed") == "true"
        page.mouse.move(160, 120)
        moved(page, lambda: page.mouse.wheel(0, -200))
        arms = [np.linalg.norm(one[:3] - place) for one in (first, camera_of(page))]
        assert arms[1] < 0.95 * arms[0], "the wheel draws nearer to the clicked place of the large wall"
        page.keyboard.press("Escape")
        assert page.get_attribute("#orbit", "aria-pressed") == "false" and page.is_visible("#card")
        page.keyboard.press("Escape")
        assert page.is_hidden("#card")

        page.click("#views button >> text=front")
        page.focus("#picture")
        page.keyboard.press("Enter")
        assert page.inner_text("#thing") == hit(SIZE[0] / 2, SIZE[1] / 2)[0]
        assert page.evaluate("document.activeElement.id") == "card"
        page.click("#close")
        assert page.evaluate("document.activeElement.id") == "picture"

        name, place = hit(*FLOOR)
        assert name == "floor"
        page.click("#name")
        page.mouse.dblclick(*FLOOR)
        x, z = (math.trunc(100 * place[axis]) / 100 for axis in (0, 2))
        page.wait_for_selector(f"body[data-camera^='{x}'][data-camera*=',{z}']", state="attached")
        assert camera_of(page)[2] == pytest.approx(place[2], abs=0.01)
        assert faults == []


@pytest.mark.long
def test_walks_links_and_pictures(chromium, device, store, site):
    with chromium() as page, served(site) as address:
        faults = opened(page, address)
        context, walk = page.context, page.locator("#walks button >> text=pass")
        moved(page, walk.click)
        assert walk.get_attribute("aria-pressed") == "true"
        page.keyboard.press("Shift")
        assert walk.get_attribute("aria-pressed") == "false", "any input stops it"
        walk.click()
        last = scene_record(store).paths[0].keys[-1].position
        page.wait_for_selector(f"body[data-camera^='{','.join(f'{x:g}' for x in last)},']", state="attached")
        page.wait_for_selector("#walks button[aria-pressed=false]")

        page.click("#states button >> text=blue")
        page.wait_for_selector("body[data-state='blue']", state="attached")
        page.focus("#exposure")
        for _ in range(4):
            page.keyboard.press("ArrowRight")
        assert page.inner_text("#ev") == "+1 1/3 EV"
        page.select_option("#transform", "neutral")
        context.grant_permissions(["clipboard-read", "clipboard-write"], origin=address)
        page.click("#share")
        page.wait_for_selector("#share >> text=Link copied")
        shared = page.evaluate("navigator.clipboard.readText()")
        assert shared == page.url and shared.endswith("&state=blue&exposure=1.3333&transform=neutral")
        with page.expect_download() as download:
            page.click("#save")
        assert download.value.suggested_filename == "_b_Küche__b_ - blue - pass.png"
        pixels = np.array(Image.open(io.BytesIO(download.value.path().read_bytes())))[..., :3]
        camera = camera_of(page)
        assert faults == []

        page.goto("about:blank")
        opened(page, shared)
        assert np.array_equal(camera_of(page), camera) and page.inner_text("#ev") == "+1 1/3 EV"
        assert page.get_attribute("#states button >> text=blue", "aria-pressed") == "true"
        assert page.input_value("#transform") == "1"
        page.evaluate("() => { navigator.clipboard.writeText = () => Promise.reject(new Error('refused')); }")
        page.click("#share")
        page.wait_for_selector(f"#said .stays >> text={page.url}")
        page.click("#reset")
        assert page.inner_text("#ev") == "0 EV" and page.is_disabled("#reset")

    renderer = Renderer(device, store)
    applied, (blue,) = AppliedMaterials(store, renderer, lambda text: None), variants_of(store)
    applied.apply(blue.looks, {}, {})
    seen = replace(
        scene_record(store).cameras[0], position=tuple(camera[:3]), target=tuple(camera[3:6]), fov_y_deg=camera[6]
    )
    state = FrameState(
        seen, *SIZE, planar="off", exposure_ev=manifest_of(site)["exposureEv"] + 4 / 3, view_transform="neutral",
        materials=applied.materials, maps=renderer.light_version,
    )  # fmt: skip
    native = renderer.display_image(state)
    assert pixels.shape == native.shape and native.std() > 10
    assert flip(native / 255, pixels / 255).mean < 0.02, "the picture that is saved has the state, exposure, transform"


PAD = """(pad) => {
  const buttons = Array.from({ length: 17 }, (_, i) => ({ pressed: i === pad.pressed, value: 0 }));
  navigator.getGamepads = () => [{ mapping: "standard", axes: pad.axes, buttons }];
  window.dispatchEvent(new Event("gamepadconnected"));
}"""


def test_by_fingers_and_gamepad(chromium, site, hit):
    with chromium(has_touch=True, reduced_motion="reduce") as page, served(site) as address:
        faults = opened(page, address)
        first = camera_of(page)
        page.touchscreen.tap(*THING)
        page.wait_for_selector(f"#thing >> text={hit(*THING)[0]}")
        assert np.array_equal(camera_of(page), first), "a tap on a thing shows its card alone"
        page.click("#close")
        page.click("#name")
        moved(page, lambda: page.touchscreen.tap(*FLOOR))
        there = camera_of(page)
        np.testing.assert_allclose(there[[0, 2]], hit(*FLOOR)[1][[0, 2]], atol=0.02)
        ahead = [(one[3:6] - one[:3]) / np.linalg.norm(one[3:6] - one[:3]) for one in (first, there)]
        np.testing.assert_allclose(*ahead, atol=1e-3)

        page.click("#card #orbit")
        pivot = camera_of(page)
        session = page.context.new_cdp_session(page)

        def fingers(kind, *places):
            points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(places)]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        fingers("touchStart", (140, 120), (180, 120))
        moved(page, lambda: fingers("touchMove", (100, 120), (220, 120)))
        fingers("touchEnd")
        assert not np.array_equal(camera_of(page)[:3], pivot[:3]), "a pinch draws nearer"

        page.evaluate(PAD, {"pressed": 0, "axes": [0, 0, 0, 0]})
        page.wait_for_selector(f"body[data-camera='{','.join(f'{x:g}' for x in first)}']", state="attached")
        page.evaluate(PAD, {"pressed": 1, "axes": [0, 0, 0, 0]})
        page.wait_for_selector("body[data-state='blue']", state="attached")
        page.evaluate(PAD, {"pressed": -1, "axes": [0, -1, 0, 0]})
        page.wait_for_function("z => document.body.dataset.camera.split(',')[2] < z", arg=first[2])
        page.evaluate(PAD, {"pressed": -1, "axes": [0.1, 0, 0, 0]})
        assert (camera_of(page) - first)[0] == pytest.approx(0, abs=1e-3), "the left stick walks ahead"
        assert faults == []
