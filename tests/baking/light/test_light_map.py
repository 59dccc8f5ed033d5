"""The light map against scenes whose answer is known by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.surfaces.texels import texels_of
from lambent.materials.document import Material
from lambent.realtime.light.baked import read_baked
from lambent.scenes.scene import DirectionalLight, ImageEnvironment, PointLight, Scene
from lambent.store.store import Store
from tests.baking.small_scenes import TINY, constant_picture, furnace, plane, room_with_step

GATHERING = TINY.changed(geometry={"texels": 96}, light_map={"gather_samples": 64})


def lit(scene: Scene, folder: Path) -> Store:
    return bake(scene, folder / "s", quality=TINY, only=("light_map",))


def known(store: Store, side: str = "traced") -> np.ndarray:
    """Irradiance (K, 3) of the sampled texels, before filling and denoising."""
    raw = store.read(f"light_map/{side}")
    count = raw[..., 3].sum(axis=0)
    return raw[..., :3].sum(axis=0)[count > 0] / count[count > 0][:, None]


def test_closed_diffuse_box_has_radiance_one(tmp_path: Path) -> None:
    gathering = TINY.changed(light_map={"gather_samples": 64})
    store = bake(furnace(), tmp_path / "s", quality=gathering, only=("light_map",))
    # 2300 texels of 64 samples of relative deviation below 1.
    assert known(store).mean() == pytest.approx(np.pi, rel=4e-3)
    assert known(store, "gathered").mean() == pytest.approx(np.pi, rel=4e-3)
    finished = store.read("light_map/irradiance").astype(float)
    assert finished.min() > 0.9 * np.pi and finished.max() < 1.1 * np.pi, "no gutter is black"
    assert 0 < store.artefact("light_map/irradiance").meta["noise"] < 0.2


def test_plane_under_a_constant_sky_receives_pi(tmp_path: Path) -> None:
    store = lit(replace(plane(), environment=ImageEnvironment(constant_picture(tmp_path, 2.0))), tmp_path)
    assert np.allclose(store.read("light_map/irradiance"), 2 * np.pi, rtol=0.02)
    assert "light_map/irradiance_back" not in store, "it is opaque"


def test_plane_under_the_sun_receives_the_cosine(tmp_path: Path) -> None:
    sun = DirectionalLight((0.8, -0.6, 0.0), (3.0, 2.0, 1.0))
    store = lit(replace(plane(), lights=(sun,)), tmp_path)
    found = read_baked(store).sun
    assert found is not None and found.radius_rad == 0 and not known(store).any(), (
        "direct light of the sun is not in the map"
    )
    assert np.allclose(np.array(found.irradiance) * found.direction[1], np.array([3, 2, 1]) * 0.6, rtol=1e-5)


def test_plane_under_a_lamp_receives_the_inverse_square(tmp_path: Path) -> None:
    store = lit(replace(plane(), lights=(PointLight((0.0, 1.0, 0.0), (4.0, 4.0, 4.0)),)), tmp_path)
    light = store.read("light_map/irradiance")[store.read("light_map/traced")[..., 3].any(axis=0)].astype(float)
    assert light.max() == pytest.approx(4.0, rel=2e-3)
    assert light.min() == pytest.approx(4 / 3**1.5, rel=0.1)  # the corner: r = sqrt 3, cos = 1/sqrt 3
    assert not known(store).any(), "no sample has it"


def test_light_from_behind_reaches_only_the_far_side_of_a_sheet(tmp_path: Path) -> None:
    weak = DirectionalLight((0.0, 1.0, 0.0), (1.0, 1.0, 1.0))
    sun = DirectionalLight((0.1, 1.0, 0.0), (2.0, 2.0, 2.0))  # brighter, so that the map leaves it out
    store = lit(replace(plane(), materials={"black": Material(kt_d=0.4)}, lights=(weak, sun)), tmp_path)
    assert not known(store).any() and not store.read("light_map/irradiance").any()
    assert np.allclose(known(store, "traced_back"), 1.0, rtol=0.1)


@pytest.mark.long
def test_gathering_lowers_the_noise_and_texels_within_a_solid_are_filled(tmp_path: Path) -> None:
    store = bake(room_with_step(), tmp_path / "s", quality=GATHERING, only=("light_map",))
    assert known(store, "gathered").mean() == pytest.approx(known(store).mean(), rel=0.01)
    raw = store.read("light_map/traced")
    halves = [of[..., :3] for of in (raw, store.read("light_map/gathered"))]  # of 64 samples each
    noise = [np.abs(half[0] - half[1]).mean() for half in halves]
    assert noise[1] < 0.6 * noise[0]
    sampled = raw[..., 3].sum(axis=0) > 0
    black = raw[..., :3].sum(axis=(0, 3))[sampled] == 0
    assert black.mean() < 0.035, "only the underside of the block, outside the room"
    finished = store.read("light_map/irradiance").reshape(-1, 3)
    geometry = {name: store.read(f"geometry/{name}") for name in ("positions", "normals", "uv2", "faces")}
    texels = texels_of(geometry, sampled.shape[1], sampled.shape[0])
    floor = (texels.face[:, 0] < store.documents["scene"]["objects"][0]["face_count"]) & (texels.flat[:, 0, 1] > 0.9)
    assert not sampled.reshape(-1)[texels.index[floor]].all(), "the floor under the block is within it"
    assert finished[texels.index[floor]].min() > 0.1, "and is filled from around it"


def test_emission_of_many_objects_keeps_its_place(tmp_path: Path) -> None:
    floor = plane().objects[0]
    mesh = replace(
        floor.mesh, positions=floor.mesh.positions + np.float32([0, 1e-2, 0]), normals=-floor.mesh.normals,
        faces=floor.mesh.faces[:, ::-1].copy(),
    )  # fmt: skip
    store = lit(replace(plane(), objects=(floor, replace(floor, name="lamp", mesh=mesh, emission=(7, 0, 0)))), tmp_path)
    assert known(store)[:, 0].max() == pytest.approx(7 * np.pi, rel=0.05)
