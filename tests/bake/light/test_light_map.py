"""The light map against scenes whose answer is known by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.bake.bake import bake
from lambent.bake.surfaces.texels import texels_of
from lambent.materials.document import Material
from lambent.scenes.scene import DirectionalLight, ImageEnvironment, PointLight, SceneObject
from lambent.store.contract import sun_beside
from lambent.store.store import Store
from tests.bake.small_scenes import TINY, constant_picture, furnace, plane, room_with_step


def known(store: Store, side: str = "traced") -> np.ndarray:
    """Irradiance (K, 3) of the sampled texels, before filling and denoising."""
    raw = store.read(f"light_map/{side}")
    count = raw[..., 3].sum(axis=0)
    return raw[..., :3].sum(axis=0)[count > 0] / count[count > 0][:, None]


def test_closed_diffuse_box_has_radiance_one(tmp_path: Path) -> None:
    store = bake(furnace(), tmp_path / "s", quality=TINY)
    irradiance = known(store)
    # 2300 texels of 64 samples of relative deviation below 1.
    assert irradiance.mean() == pytest.approx(np.pi, rel=4e-3)
    finished = store.read("light_map/irradiance").astype(float)
    assert finished.min() > 0.9 * np.pi and finished.max() < 1.1 * np.pi, "no gutter is black"
    assert 0 < store.artefact("light_map/irradiance").meta["noise"] < 0.2


def test_gathering_keeps_the_light_and_lowers_its_noise(tmp_path: Path) -> None:
    gathering = TINY.changed(light_map={"gather_samples": 64})
    store = bake(furnace(), tmp_path / "furnace", quality=gathering)
    assert known(store, "gathered").mean() == pytest.approx(np.pi, rel=4e-3)
    store = bake(room_with_step(), tmp_path / "room", quality=gathering)
    traced, gathered = known(store), known(store, "gathered")
    assert gathered.mean() == pytest.approx(traced.mean(), rel=0.01)
    halves = [store.read(f"light_map/{stage}")[..., :3] for stage in ("traced", "gathered")]  # of 64 samples each
    noise = [np.abs(half[0] - half[1]).mean() for half in halves]
    assert noise[1] < 0.6 * noise[0]


def test_plane_under_a_constant_sky_receives_pi(tmp_path: Path) -> None:
    environment = ImageEnvironment(constant_picture(tmp_path, 2.0))
    store = bake(replace(plane(), environment=environment), tmp_path / "s", quality=TINY)
    assert np.allclose(store.read("light_map/irradiance"), 2 * np.pi, rtol=0.02)


@pytest.mark.parametrize("cosine", [1.0, 0.6, 0.1])
def test_plane_under_the_sun_receives_the_cosine(tmp_path: Path, cosine: float) -> None:
    sun = DirectionalLight((np.sqrt(1 - cosine**2), -cosine, 0.0), (3.0, 2.0, 1.0))
    store = bake(replace(plane(), lights=(sun,)), tmp_path / "s", quality=TINY)
    found = sun_beside(store)
    assert found is not None and not known(store).any(), "direct light of the sun is not in the map"
    assert np.allclose(np.array(found.irradiance) * found.direction[1], np.array([3, 2, 1]) * cosine, rtol=1e-5)


def test_plane_under_a_lamp_receives_the_inverse_square(tmp_path: Path) -> None:
    lamp = PointLight((0.0, 1.0, 0.0), (4.0, 4.0, 4.0))
    store = bake(replace(plane(), lights=(lamp,)), tmp_path / "s", quality=TINY)
    assert known(store).max() == pytest.approx(4.0, rel=2e-3)
    assert known(store).min() == pytest.approx(4 / 3**1.5, rel=0.1)  # the corner: r = sqrt 3, cos = 1/sqrt 3


def test_light_from_behind_reaches_only_the_far_side_of_a_sheet(tmp_path: Path) -> None:
    weak = DirectionalLight((0.0, 1.0, 0.0), (1.0, 1.0, 1.0))
    sun = DirectionalLight((0.1, 1.0, 0.0), (2.0, 2.0, 2.0))  # brighter, so that the map leaves it out
    paper = replace(plane(), materials={"black": Material(kt_d=0.4)}, lights=(weak, sun))
    store = bake(paper, tmp_path / "s", quality=TINY)
    assert not known(store).any()
    assert np.allclose(known(store, "traced_back"), 1.0, rtol=0.1)


def test_opaque_objects_have_no_far_side(tmp_path: Path) -> None:
    assert "light_map/irradiance_back" not in bake(plane(), tmp_path / "s", quality=TINY)


def test_no_light_is_a_black_map(tmp_path: Path) -> None:
    assert not bake(plane(), tmp_path / "s", quality=TINY).read("light_map/irradiance").any()


def test_texels_within_a_solid_are_not_sampled_and_do_not_darken_their_neighbours(tmp_path: Path) -> None:
    store = bake(room_with_step(), tmp_path / "s", quality=TINY.changed(geometry={"texels": 96}))
    raw = store.read("light_map/traced")
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
    lamp = SceneObject(
        "lamp", replace(floor.mesh, positions=floor.mesh.positions + np.float32([0, 1e-2, 0])), "black", (7, 0, 0)
    )
    upside_down = replace(
        lamp, mesh=replace(lamp.mesh, normals=-lamp.mesh.normals, faces=lamp.mesh.faces[:, ::-1].copy())
    )
    store = bake(replace(plane(), objects=(floor, upside_down)), tmp_path / "s", quality=TINY)
    assert known(store)[:, 0].max() == pytest.approx(7 * np.pi, rel=0.05)
