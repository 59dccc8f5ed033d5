"""Photons against scenes whose answer is known by hand, and against path tracing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.photons import shooting
from lambent.baking.photons.density import Kernel
from lambent.baking.quality import Quality
from lambent.baking.surfaces.coverage import texel_areas
from lambent.baking.surfaces.texels import texels_of
from lambent.core.errors import UserError
from lambent.core.progress import Cancelled
from lambent.materials.document import Material
from lambent.scenes.geometry import patch
from lambent.scenes.scene import DirectionalLight, ImageEnvironment, PointLight, Scene, SceneObject
from lambent.store.contract import sun_left_out
from lambent.store.store import Store
from tests.baking.small_scenes import TINY, constant_picture, furnace, plane

SMALL = TINY.changed(light_map={"photons_per_texel": 512, "max_depth": 48})


def photon_baked(scene: Scene, folder: Path, quality: Quality = SMALL) -> Store:
    return bake(scene, folder, quality=quality, light_map="photons", only=("light_map",))


def geometry_of(store: Store) -> dict[str, np.ndarray]:
    return {name: store.read(f"geometry/{name}") for name in ("positions", "normals", "uv2", "faces")}


def areas(store: Store) -> np.ndarray:
    height, width = store.artefact("light_map/photons").shape[2:4]
    return texel_areas(geometry_of(store), width, height)


def flux(store: Store) -> np.ndarray:
    """(BATCHES, 3) W in all texels of the normal's side."""
    return store.read("light_map/photons")[:, 0].astype(float).sum(axis=(1, 2))


def test_photons_are_counted_by_side_and_texel_in_whole_units(mi: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    import drjit as dr

    monkeypatch.setattr(shooting, "light_map_texel", lambda texel, width, height, active: texel)
    texel, far = mi.UInt32(0, 5, 5, 3, 4), mi.Bool(False, False, False, True, False)
    active = mi.Bool(True, True, True, True, False)
    power = mi.Color3f([0.4, 1.0, 2.0, 7.0, 9.0], [0.6, 2.0, 2.0, 7.0, 9.0], [1.5, 3.0, 2.0, 7.0, 9.0])
    for sides in (1, 2):
        sums = dr.zeros(mi.UInt64, sides * 18)
        shooting._count(sums, (sides, 2, 3), texel, power, far, active)
        expected = np.zeros((2, 6, 3))
        expected[0, [0, 5]], expected[1, 3] = [[0, 1, 2], [3, 4, 5]], 7
        assert np.array_equal(np.array(sums).reshape(sides, 6, 3), expected[:sides])


@pytest.mark.long
def test_closed_diffuse_box_has_radiance_one(tmp_path: Path) -> None:
    store = photon_baked(furnace(), tmp_path / "s")
    assert areas(store).sum() == pytest.approx(24.0, rel=1e-6)
    mean = flux(store) / 24.0
    error = mean.std(axis=0, ddof=1) / np.sqrt(len(mean))
    assert (error < 2e-3 * np.pi).all()
    assert np.all(np.abs(mean.mean(axis=0) - np.pi) < 4 * error + 1e-4)
    finished = store.read("light_map/irradiance").astype(float)
    assert finished.min() > 0.93 * np.pi and finished.max() < 1.07 * np.pi, "no border is darker, no gutter black"
    height, width = areas(store).shape
    texels = texels_of(geometry_of(store), width, height)
    kernel = Kernel(areas(store), texels, np.ones(len(texels.index)))
    raw = kernel.irradiance(store.read("light_map/photons")[:, 0].astype(float).mean(axis=0))[kernel.known]
    noise = np.sqrt(np.mean((raw / np.pi - 1) ** 2))
    assert store.artefact("light_map/irradiance").meta["noise"] == pytest.approx(noise, rel=0.15), "as it is known here"


@pytest.mark.long
def test_plane_under_a_constant_sky_receives_pi(tmp_path: Path) -> None:
    environment = ImageEnvironment(constant_picture(tmp_path, 2.0))
    store = photon_baked(replace(plane(), environment=environment), tmp_path / "s")
    assert flux(store).mean() == pytest.approx(4 * 2 * np.pi, rel=0.01)
    assert np.allclose(store.read("light_map/irradiance"), 2 * np.pi, rtol=0.25)


@pytest.mark.parametrize("cosine", [1.0, 0.3])
def test_plane_under_the_sun_receives_the_cosine(tmp_path: Path, cosine: float) -> None:
    sun = DirectionalLight((np.sqrt(1 - cosine**2), -cosine, 0.0), (3.0, 2.0, 1.0))
    store = photon_baked(replace(plane(), lights=(sun,)), tmp_path / "s")
    found = sun_left_out(store)
    assert found is not None and not flux(store).any(), "direct light of the sun is not in the map"
    assert np.array(found.irradiance) * found.direction[1] == pytest.approx(np.array([3, 2, 1]) * cosine)


@pytest.mark.long
def test_plane_under_lamps_receives_the_inverse_square(tmp_path: Path) -> None:
    lamp = PointLight((0.0, 1.0, 0.0), (4.0, 4.0, 4.0))
    spot = PointLight((0.0, 1.0, 0.0), (2.0, 2.0, 2.0), (0.0, -1.0, 0.0), 60.0, 60.0)  # covers the square's corners
    store = photon_baked(replace(plane(), lights=(lamp, spot)), tmp_path / "s")
    batches, area = store.read("light_map/photons")[:, 0, ..., 0].astype(float), areas(store)
    texels = texels_of(geometry_of(store), area.shape[1], area.shape[0])
    wanted = np.zeros(area.size)
    wanted[texels.index] = (6 / (1 + texels.positions[..., [0, 2]] ** 2 @ [1, 1]) ** 1.5).mean(axis=1)
    whole = (area > 0.9 * area.max()).reshape(-1)
    means = batches.reshape(len(batches), -1)[:, whole] / area.reshape(-1)[whole]
    z = (means.mean(axis=0) - wanted[whole]) / (means.std(axis=0, ddof=1) / np.sqrt(len(means)))
    assert np.abs(z).mean() < 1.2 and abs(z.mean()) < 0.2, "over the whole square"
    assert means.mean() == pytest.approx(wanted[whole].mean(), rel=0.01)


@pytest.mark.long
def test_low_lamp_far_from_the_origin_lights_the_floor_before_it(tmp_path: Path) -> None:
    """Mitsuba's offset of rays is 9 mm there, a third of the lamp's height: as if the lamp stood so much nearer."""
    high, far = 0.03, 100.0
    objects = (
        SceneObject("floor", patch((far, 0, 1), (0.25, 0, 0), (0, 0, -2)), "black"),
        SceneObject("strip", patch((far, 0, -1), (0, high, 0), (0, 0, 2)), "black", emission=(1, 1, 1)),
    )
    scene = Scene("low lamp", objects, {"black": Material()})
    store = photon_baked(scene, tmp_path / "s", SMALL.changed(geometry={"texels": 96}))
    flux, area = store.read("light_map/photons")[:, 0, ..., 0].astype(float), areas(store)
    texels = texels_of(geometry_of(store), area.shape[1], area.shape[0])
    near, wanted = np.zeros(area.size, bool), np.zeros(area.size)
    x, y, z = np.moveaxis(texels.positions.astype(float) - (far, 0, 0), -1, 0)
    near[texels.index] = (
        (np.abs(y) < 1e-4).all(axis=1) & (np.abs(z) < 0.5).all(axis=1) & (np.abs(x - 0.065) < 0.035).all(axis=1)
    )
    wanted[texels.index] = np.pi / 2 * (1 - x / np.hypot(x, high)).mean(axis=1)  # of a strip without end
    near &= area.reshape(-1) > 0.9 * np.median(texels.spacing) ** 2
    assert near.sum() > 50
    ratio = flux.reshape(len(flux), -1)[:, near].sum(axis=1) / (wanted * area.reshape(-1))[near].sum()
    error = ratio.std(ddof=1) / np.sqrt(len(ratio))
    assert error < 0.01 and abs(ratio.mean() - 1) < 0.06 + 3 * error


def test_light_from_behind_reaches_only_the_far_side_of_a_sheet(tmp_path: Path) -> None:
    weak = DirectionalLight((0.0, 1.0, 0.0), (1.0, 1.0, 1.0))
    sun = DirectionalLight((0.1, 1.0, 0.0), (2.0, 2.0, 2.0))  # brighter, so that the map leaves it out
    store = photon_baked(replace(plane(), materials={"black": Material(kt_d=0.4)}, lights=(weak, sun)), tmp_path / "s")
    assert not store.read("light_map/irradiance").any()
    assert np.allclose(store.read("light_map/irradiance_back"), 1.0, rtol=0.12)


@pytest.mark.long
def test_interrupted_and_resumed_is_the_same_bit_for_bit(tmp_path: Path) -> None:
    small = SMALL.changed(light_map={"photons_per_texel": 32})
    whole = photon_baked(furnace(), tmp_path / "whole", small)

    def stop(done: float, total: float, what: str) -> None:
        if "photons" in what and done >= 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        bake(furnace(), tmp_path / "s", quality=small, light_map="photons", progress=stop)
    assert Store.open(tmp_path / "s").artefact("light_map/photons").state.startswith("partial")
    resumed = bake(furnace(), tmp_path / "s", quality=small, only=("light_map",))
    assert resumed.documents["ways"]["light_map"] == "photons", "as the store has it"
    for name in ("light_map/photons", "light_map/irradiance"):
        assert resumed.read(name).tobytes() == whole.read(name).tobytes()


def test_other_integrator_makes_the_map_anew(tmp_path: Path) -> None:
    small = TINY.changed(light_map={"photons_per_texel": 8, "samples": (4, 4)})
    first = bake(plane(), tmp_path / "s", quality=small, only=("light_map",))
    second = photon_baked(plane(), tmp_path / "s", small)
    assert not second.read("light_map/irradiance").any(), "there is no light"
    found = [store.artefact("light_map/irradiance") for store in (first, second)]
    assert found[0].key != found[1].key
    assert [artefact.meta["integrator"] for artefact in found] == ["paths", "photons"]
    with pytest.raises(UserError, match="photons"):
        bake(plane(), tmp_path / "s", quality=small, light_map="photon")
