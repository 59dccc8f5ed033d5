"""The page's pictures in headless Chromium are those of the native renderer."""

from __future__ import annotations

import base64
from dataclasses import replace

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
EYES = ((0.013, 1.021, 3.4), (0.3, 0.4, 0.2), (-0.6, 1.2, 0.5), (0.5, 1.5, -0.4), (0.017, 0.3, 0.8), (0.7, 0.2, -0.7))
REST = 6  # frames of a picture at rest
PIXELS = """async ([cameras, states, kinds, width, height]) => {
  const { readManifest, Data } = await import("/loading.js");
  const { Frame } = await import("/frame.js"), { openDevice } = await import("/device.js");
  const manifest = await readManifest(), device = await openDevice(manifest), faults = [];
  device.addEventListener("uncapturederror", (event) => faults.push(event.error.message));
  const data = new Data(() => {});
  const frame = await Frame.open(manifest, device, document.createElement("canvas"), data);
  frame.resize(width, height);
  const found = [];
  for (const state of states) {
    await frame.show(state, data);
    for (const kind of kinds) {
      for (const camera of cameras) {
        const bytes = await frame.pixels(camera, ...(typeof kind === "string" ? [kind] : Array(kind).keys()));
        found.push(btoa(String.fromCharCode(...bytes)));
      }
    }
  }
  return { faults, found, exposureEv: manifest.exposureEv };
}"""


def cameras_in(renderer):
    low, high = np.array(renderer.scene.record.bounds)
    middle, half = (low + high) / 2, (high - low) / 2
    return [
        Camera(f"view {k}", tuple((middle + half * (np.array(eye) - [0, 1, 0])).tolist()), tuple(middle.tolist()))
        for k, eye in enumerate(EYES)
    ]


def pictures(chromium, site, cameras, states=(0,), kinds=("plain",)):
    """Pictures (height, width, 3) of the page, by state, kind and camera; and the exposure."""
    with chromium(bypass_csp=True) as page, served(site) as address:
        page.goto(f"{address}site.css")
        answer = page.evaluate(PIXELS, [[said(camera) for camera in cameras], states, kinds, *SIZE])
    assert answer["faults"] == []
    return [
        np.frombuffer(base64.b64decode(one), np.uint8).reshape(SIZE[1], SIZE[0], 4)[..., :3] for one in answer["found"]
    ], answer["exposureEv"]


def assert_same_picture(shown, native, name):
    assert native.std() > 10, f"{name} shows something"
    assert np.abs(shown.astype(float) - native).mean() < 0.5, name
    assert flip(native / 255, shown / 255).mean < 0.02, name


@pytest.mark.slow
def test_pictures_are_those_of_the_native_renderer(chromium, device, blue_box, box_site):
    """Six cameras, in both states, and back in the first."""
    store = Store.open(blue_box)
    renderer = Renderer(device, store)
    cameras = cameras_in(renderer)
    shown, exposure_ev = pictures(chromium, box_site, cameras, (0, 1, 0))
    found = iter(shown)
    applied, (blue,) = AppliedMaterials(store, renderer, lambda text: None), variants_of(store)
    for looks in ({}, blue.looks, {}):
        applied.apply(looks, {}, {})
        for camera in cameras:
            state = FrameState(
                camera, *SIZE, exposure_ev=exposure_ev, materials=applied.materials, maps=renderer.light_version
            )
            assert_same_picture(next(found), renderer.display_image(state), camera.name)


@pytest.mark.long
def test_mirrors_panes_and_edges_are_those_of_the_native_renderer(chromium, device, hall_store, hall_site):
    """In motion with and without averaged edges, and at rest."""
    renderer = Renderer(device, Store.open(hall_store))
    cameras = cameras_in(renderer)
    shown, exposure_ev = pictures(chromium, hall_site, cameras, kinds=("plain", "moving", REST))
    found = iter(shown)
    for kind in ("plain", "moving", "rest"):
        for camera in cameras:
            state = FrameState(camera, *SIZE, exposure_ev=exposure_ev, covers=kind == "moving")
            if kind == "rest":
                for index in range(REST - 1):
                    renderer.draw(replace(state, accumulate=index))
                state = replace(state, accumulate=REST - 1)
            assert_same_picture(next(found), renderer.display_image(state), f"{camera.name}, {kind}")
