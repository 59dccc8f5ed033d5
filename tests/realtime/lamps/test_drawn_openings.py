"""Luminaires with an opening, drawn by pixel: soft shadows, near field, the opening's own radiance, and moved ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera, pixel_rays
from lambent.materials.document import Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import read_baked
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import patch
from lambent.scenes.lamp_edits import LampEdit, edited_lamp
from lambent.scenes.photometry.distribution import Photometry
from lambent.scenes.photometry.luminous_surfaces import with_luminous_surfaces
from lambent.scenes.photometry.opening import Opening
from lambent.scenes.scene import IesLight, Scene, SceneObject
from lambent.store.store import Store
from tests.baking.small_scenes import TINY
from tests.realtime.lamps.test_drawn_lamps import CAMERA, SIZE, floor_seen

THETA = np.linspace(0, 90, 46)
CD = 100 * np.cos(np.radians(THETA)).clip(0) ** 3
DISC = Opening("cylinder", (0.3, 0.3, 0.0))
PANEL = IesLight(
    (0.1, 1.6, 0.0), replace(Photometry.of(THETA, np.array([0.0, 360.0]), np.stack([CD, CD])), opening=DISC),
    (0.01, 0.02, 0.01), name="panel",
)  # fmt: skip
UP = Camera(name="up", position=(0.5, 0.2, 0.3), target=(0.1, 1.6, 0.0), fov_y_deg=20.0)


@pytest.fixture(scope="module")
def store(mi: Any, tmp_path_factory: pytest.TempPathFactory) -> Store:
    """A floor under a plate of .4 m, half a metre up, and a luminaire of .3 m."""
    floor = SceneObject("floor", patch((-2, 0, 2), (4, 0, 0), (0, 0, -4)), "grey")
    plate = SceneObject("plate", patch((-0.2, 0.5, 0.2), (0.4, 0, 0), (0, 0, -0.4)), "dark")
    scene = Scene("room", (floor, plate), {"grey": Material(kd=0.5), "dark": Material(kd=0.0)}, lights=(PANEL,))
    folder: Path = tmp_path_factory.mktemp("openings") / "s"
    return bake(with_luminous_surfaces(scene), folder, quality=TINY, only=("lamps", "probe"))


def seen_share(p: Floats, lamp: IesLight) -> Floats:
    """(n,) share of the disc that the plate leaves to points of the floor."""
    k = np.arange(1024)
    spiral = np.sqrt((k + 0.5) / 1024)[:, None] * np.column_stack([np.cos(2.39996 * k), np.sin(2.39996 * k)])
    of_disc = np.array(lamp.position) + 0.15 * spiral @ lamp.axes[:2]
    at = p[:, None] + (of_disc - p[:, None]) * (0.5 / of_disc[:, 1])[None, :, None]
    return np.asarray(1 - (np.abs(at[..., [0, 2]]) < 0.2).all(axis=-1).mean(axis=1))


def radiance_of(lamp: IesLight, w: Floats) -> Floats:
    """W/(sr m^2) of the disc along unit directions (n, 3): intensity over silhouette."""
    cosine = w @ lamp.axes[2]
    cd = lamp.photometry.at(np.degrees(np.arccos(cosine.clip(-1, 1))), np.zeros(len(w)))
    return cd[:, None] * lamp.scale / (np.pi * 0.15**2 * np.maximum(cosine, 1e-9)[:, None])


def floor_under(lamp: IesLight, p: Floats) -> Floats:
    """Radiance (n, 3) of the grey floor, by the disc's near field on its axis."""
    away = p - np.array(lamp.position)
    square = (away**2).sum(axis=1)
    d = away / np.sqrt(square)[:, None]
    cd = lamp.photometry.at(np.degrees(np.arccos((d @ lamp.axes[2]).clip(-1, 1))), np.zeros(len(p)))
    return (seen_share(p, lamp) * cd * -d[:, 1] / (square + 0.15**2))[:, None] * lamp.scale * 0.5 / np.pi


EDITS: list[LampEdit | None] = [None, LampEdit((-0.2, 1.4, 0.2), (0.1, -1.0, 0.0))]


@pytest.mark.long
@pytest.mark.parametrize("edit", EDITS, ids=["as baked", "moved"])
def test_the_floor_has_soft_shadows(device: Any, store: Store, edit: LampEdit | None) -> None:
    renderer, lamp = Renderer(device, read_baked(store)), PANEL
    if edit is not None:
        renderer.resources.changed_lamps.show({0: edit})
        moved = edited_lamp(PANEL, edit)
        assert isinstance(moved, IesLight)
        lamp = moved
    state = FrameState(CAMERA, SIZE, SIZE, antialias=False, show="diffuse")
    found = np.asarray(renderer.still_radiance(state, 1), float).reshape(-1, 3)
    p, to_eye, open_floor = floor_seen()
    expected, share = floor_under(lamp, p), seen_share(p, lamp)
    across = p + to_eye * ((np.array(lamp.position) - p) @ lamp.axes[2] / (to_eye @ lamp.axes[2]))[:, None]
    open_floor &= np.linalg.norm(across - np.array(lamp.position), axis=1) > 0.17
    lit, umbra, soft = (open_floor & of for of in (share == 1, share == 0, (share > 0) & (share < 1)))
    assert min(lit.sum(), umbra.sum(), soft.sum()) > 200
    off = np.abs(found - expected)[lit] - 2e-4
    assert np.quantile(off / expected[lit], 0.99) < 0.05, "visible shares are averaged over texels beside penumbras"
    assert found[umbra].max() < 0.1 * expected[lit].max()
    bright = expected[soft & (share > 0.95)].mean()
    assert np.abs(found - expected)[soft].mean() < 0.12 * bright


@pytest.mark.parametrize("edit", EDITS, ids=["as baked", "moved"])
def test_the_opening_has_the_radiance_of_its_photometry(device: Any, store: Store, edit: LampEdit | None) -> None:
    renderer, lamp, camera = Renderer(device, read_baked(store)), PANEL, UP
    if edit is not None:
        renderer.resources.changed_lamps.show({0: edit})
        moved = edited_lamp(PANEL, edit)
        assert isinstance(moved, IesLight)
        lamp, camera = moved, replace(UP, target=edit.position)
    state = FrameState(camera, SIZE, SIZE, antialias=False)
    found = np.asarray(renderer.still_radiance(state, 1), float).reshape(-1, 3)
    w = pixel_rays(camera, SIZE, SIZE).reshape(-1, 3)
    to_plane = (np.array(lamp.position) - np.array(camera.position)) @ lamp.axes[2]
    at = np.array(camera.position) + w * (to_plane / (w @ lamp.axes[2]))[:, None]
    radius = np.linalg.norm(at - np.array(lamp.position), axis=1)
    inside = radius < 0.145
    assert inside.sum() > 500
    np.testing.assert_allclose(found[inside], radiance_of(lamp, normalize(-w[inside])), rtol=0.02)
    assert found[(radius > 0.155) & (radius < 0.3)].max() < 0.05 * found[inside].max()


def test_the_mean_is_the_light_map(device: Any, store: Store) -> None:
    baked = read_baked(store)
    state = FrameState(CAMERA, SIZE, SIZE, antialias=False, show="diffuse")
    by_pixel, by_texel = (
        np.asarray(Renderer(device, one).still_radiance(state, 1), float).reshape(-1, 3)[floor_seen()[2]]
        for one in (baked, replace(baked, lamps=None))
    )
    assert by_texel.mean() == pytest.approx(by_pixel.mean(), rel=0.02)
