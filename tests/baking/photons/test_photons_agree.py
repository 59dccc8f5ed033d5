"""Photons and paths are two integrators of one light map: they agree within noise, tables and caustics included."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.surfaces.coverage import texel_areas
from lambent.baking.surfaces.texels import texels_of
from lambent.core.errors import UserError
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio
from lambent.scenes.geometry import box, patch, placed, sphere
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import Scene, SceneObject
from lambent.store.store import Store
from tests.baking.small_scenes import GREY, TINY, turned_inwards

QUALITY = TINY.changed(
    geometry={"texels": 40}, light_map={"samples": (128, 128), "max_depth": 6, "photons_per_texel": 512}
)
SATIN = Material(name="satin", kd=(0.1, 0.05, 0.02), lobes=(Lobe(mx=0.2, my=0.2, k=0.9, r0=(0.8, 0.6, 0.4)),))


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A measurement whose document, worn beside it, says something else: black."""
    path = tmp_path_factory.mktemp("table") / "satin.bsdf"
    write_gonio(path, synthesise(SATIN, Setup((0, 20, 40, 60, 75), step_deg=6, fine_deg=3, noise=0.0, floor=0.0)))
    return path


def room(file: Path) -> Scene:
    """A lamp low over a sheet of satin throws its light down: ceiling, walls and ball have it from the sheet."""
    objects = (
        SceneObject("room", placed(turned_inwards(box((2, 2, 2))), (0, 1, 0)), "grey"),
        SceneObject("sheet", patch((-0.9, 0.2, 0.6), (1.8, 0, 0), (0, 0.3, -1.4)), "satin"),
        SceneObject("lamp", patch((-0.4, 0.9, -0.4), (0.8, 0, 0), (0, 0, 0.8)), "black", emission=(5, 5, 5)),
        SceneObject("ball", placed(sphere(0.3, 16, 8), (0.5, 1.3, 0.4)), "grey"),
    )
    black = Material(name="satin")
    return Scene("satin", objects, {"grey": GREY, "black": black, "satin": black}, measured={"satin": file})


def regions(store: Store) -> np.ndarray:
    """(H, W) number of the triangle's object and main direction, -1 elsewhere."""
    geometry = {name: store.read(f"geometry/{name}") for name in ("positions", "normals", "uv2", "faces")}
    height, width = store.read("light_map/irradiance").shape[:2]
    texels = texels_of(geometry, width, height)
    first = [o["first_face"] for o in store.documents["scene"]["objects"]]
    which = np.searchsorted(first, texels.face[:, 0], side="right") - 1
    normal = texels.flat.mean(axis=1)
    axis = np.argmax(np.abs(normal), axis=1)
    side = 2 * axis + (np.take_along_axis(normal, axis[:, None], axis=1)[:, 0] > 0)
    labels = np.full(width * height, -1)
    labels[texels.index] = 6 * which + side
    area = texel_areas(geometry, width, height)
    return np.where(area.reshape(-1) > 0, labels, -1).reshape(height, width), area


def scores(photons: Store, paths: Store) -> np.ndarray:
    """z of each region and channel: the difference of the mean irradiance in standard deviations of it."""
    labels, area = regions(photons)
    flux = photons.read("light_map/photons")[:, 0].astype(float)
    raw = paths.read("light_map/traced").astype(float)
    found = []
    for label in np.unique(labels[labels >= 0]):
        mine = (labels == label) & (raw[0, ..., 3] > 0)
        of_batch = flux[:, mine].sum(axis=1) / area[mine].sum()
        halves = raw[:, mine, :3] / raw[:, mine, 3:]
        share = area[mine, None] / area[mine].sum()
        traced = (halves.mean(axis=0) * share).sum(axis=0)
        variance = of_batch.var(axis=0, ddof=1) / len(of_batch)
        variance += (((halves[0] - halves[1]) / 2 * share) ** 2).sum(axis=0)
        if (variance > (0.1 * traced) ** 2).any():
            continue  # too little light to tell
        found.append((of_batch.mean(axis=0) - traced) / np.sqrt(variance))
    return np.array(found)


@pytest.mark.long
def test_measured_table_throws_the_same_light_by_photons_and_by_paths(tmp_path: Path, table: Path) -> None:
    scene = room(table)
    photons = bake(scene, tmp_path / "photons", quality=QUALITY, light_map="photons", only=("light_map",))
    paths = bake(scene, tmp_path / "paths", quality=QUALITY, only=("light_map",))
    z = scores(photons, paths)
    assert len(z) > 8
    assert np.sqrt((z**2).mean()) < 1.4 and np.abs(z).max() < 4.5
    document = bake(replace(scene, measured={}), tmp_path / "black", quality=QUALITY, only=("light_map",))
    assert paths.read("light_map/traced")[..., :3].sum() > 1.2 * document.read("light_map/traced")[..., :3].sum()


@pytest.mark.long
def test_gathering_counts_the_table_once(tmp_path: Path, table: Path) -> None:
    quality = QUALITY.changed(light_map={"samples": (64, 64), "gather_samples": 32})
    satin = replace(room(table), materials={"grey": GREY, "black": Material(), "satin": SATIN})
    store = bake(satin, tmp_path / "s", quality=quality, only=("light_map",))
    traced, gathered = (store.read(f"light_map/{stage}").astype(float) for stage in ("traced", "gathered"))
    assert gathered[..., :3].sum() == pytest.approx(traced[..., :3].sum() / 2, rel=0.03), "of half as many samples"


def test_scene_toml_names_the_table(tmp_path: Path, table: Path) -> None:
    (tmp_path / "satin.bsdf").write_bytes(table.read_bytes())
    text = 'format = "lambent-scene"\nversion = 1\ngeometry = "builtin:box"\n[materials]\n'
    text += "\n".join(f"{name} = {{ kd = 0.5 }}" for name in ("white", "red", "green", "black", "metal"))
    path = tmp_path / "scene.toml"
    path.write_text(f'{text}\n[measured]\nmetal = "satin.bsdf"\n')
    assert load_scene(str(path)).measured == {"metal": tmp_path / "satin.bsdf"}
    path.write_text(f'{text}\n[measured]\nmetall = "satin.bsdf"\n')
    with pytest.raises(UserError, match="metal"):
        load_scene(str(path))
