"""Light that answers exchanged textures: their mean and their detail, on surfaces and in probes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lambent.baked.answering.stored import StoredAnswer, read_answer
from lambent.baking.bake import bake
from lambent.baking.running.again import bake_again
from lambent.core.arrays import Floats
from lambent.realtime.answering.answering import AnsweredLight
from lambent.realtime.answering.texture_detail import Textures, filtered, with_own_albedos
from lambent.realtime.light.baked import BakedScene, read_baked
from lambent.scenes.geometry import box, patch, placed, sphere
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.looks.image_textures import mean_and_detail, with_image
from lambent.scenes.scene import ImageTexture, MaterialTextures, Texture
from lambent.store.store import Store
from tests.baking.small_scenes import TINY

SCENE = """
format = "lambent-scene"
version = 1
name = "stripes"
geometry = "room.obj"
[environment]
kind = "constant"
radiance = [0.0, 0.0, 0.0]
[objects.lamp]
emission = [8.0, 8.0, 8.0]
[materials.grey]
kd = 0.5
[materials.paper]
kd = 0.5
[materials.mirror]
lobes = [{ mx = 0.02, my = 0.02, r0 = 0.9 }]
"""


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """A room whose wall of paper has a picture's uv: u from 0 on its left to 1 on its right."""
    folder = tmp_path_factory.mktemp("stripes")
    parts = (
        ("floor", "grey", patch((-2, 0, 2), (4, 0, 0), (0, 0, -4)), 1.0),
        ("paper", "paper", patch((-2, 0, -2), (4, 0, 0), (0, 2, 0)), 0.25),
        ("left", "grey", patch((-2, 0, 2), (0, 0, -4), (0, 2, 0)), 1.0),
        ("right", "grey", patch((2, 0, -2), (0, 0, 4), (0, 2, 0)), 1.0),
        ("front", "grey", patch((2, 0, 2), (-4, 0, 0), (0, 2, 0)), 1.0),
        ("lamp", "grey", placed(box((1, 0.02, 0.4)), (0, 1.9, -1.3)), 1.0),
        ("ball", "mirror", placed(sphere(0.3, 16, 8), (0, 0.6, -1.0)), 1.0),
    )
    lines, first = ["mtllib room.mtl"], 1
    for name, material, mesh, scale in parts:
        lines += [f"o {name}", f"usemtl {material}"]
        lines += ["v {:g} {:g} {:g}".format(*p) for p in mesh.positions]
        lines += ["vt {:g} {:g}".format(*(scale * p)) for p in mesh.uv]
        lines += ["vn {:g} {:g} {:g}".format(*n) for n in mesh.normals]
        lines += ["f " + " ".join(f"{first + i}/{first + i}/{first + i}" for i in face) for face in mesh.faces]
        first += len(mesh.positions)
    (folder / "room.obj").write_text("\n".join(lines) + "\n")
    (folder / "room.mtl").write_text("newmtl grey\nnewmtl paper\nnewmtl mirror\n")
    (folder / "scene.toml").write_text(SCENE)
    halves = np.where(np.arange(64)[None, :, None] < 32, 255, 0) + np.zeros((64, 1, 3), int)
    Image.fromarray(halves.astype(np.uint8)).save(folder / "halves.png")
    return bake(load_scene(str(folder / "scene.toml")), folder / "s", quality=TINY, only=("answer",))


@pytest.fixture(scope="module")
def baked(store: Store) -> BakedScene:
    return read_baked(store)


@pytest.fixture(scope="module")
def stored(store: Store) -> StoredAnswer:
    return read_answer(store)


def even(factor: float) -> Textures:
    """A texture that multiplies the paper's colour everywhere, and brings no mean of its own."""
    return {"paper": MaterialTextures(diffuse=Texture(np.full((4, 4, 3), factor, np.float16)))}


def test_one_albedo_for_each_point_changes_nothing(stored: StoredAnswer) -> None:
    answer = stored.answer
    own = with_own_albedos(answer)
    assert len(own.albedos.reflected) == len(answer.albedos.reflected) + len(own.points.patch) + len(
        own.patches.material
    )
    assert np.array_equal(own.reference(), answer.reference())
    assert np.array_equal(own.albedos.reflected[own.points.material], answer.albedos.reflected[answer.points.material])


def test_an_even_texture_is_another_colour(baked: BakedScene, stored: StoredAnswer) -> None:
    answer, paper = AnsweredLight(baked, stored), baked.record.materials["paper"]
    dark = answer.lit({"paper": paper.model_copy(update={"kd": tuple(0.3 * x for x in paper.kd)})})
    textured = answer.lit({}, even(0.3))
    assert not textured.is_baked and answer.lit({}, {"paper": None}) is answer.as_baked
    assert np.allclose(textured.irradiance, dark.irradiance, rtol=2e-3, atol=1e-4)
    change = answer.probe_change("ball", dark)
    assert np.abs(change).max() > 0.05
    assert np.allclose(answer.probe_change("ball", textured), change, atol=0.02 * np.abs(change).max())


@pytest.mark.long
def test_a_half_black_picture_is_dark_beside_its_black_half(
    store: Store, baked: BakedScene, stored: StoredAnswer, tmp_path: Path
) -> None:
    """Its mean alone would light both sides of the room alike; truth is a bake with the picture."""
    file = Path(store.folder).parent / "halves.png"
    mean, image = mean_and_detail(file).mean, ImageTexture(str(file))
    paper = baked.record.materials["paper"].model_copy(update={"kd": mean})
    answer = AnsweredLight(baked, stored)
    detail = answer.lit({"paper": paper}, {"paper": with_image(None, image)})
    alone = answer.lit({"paper": paper})
    rebaked = bake_again(store.folder, tmp_path / "s", {"paper": paper}, textures={"paper": image}, quality=TINY)
    true = rebaked.read("light_map/irradiance").astype(float)
    left, right = (_mean_near(baked, name, true) for name in ("left", "right"))
    assert left > 1.1 * right, "the picture's white half is on the left"
    for light, least, most in ((detail, 0.93, 1.08), (alone, 0.0, 0.97)):
        shown = answer.maps(light)[0]
        ratio = _mean_near(baked, "left", shown) / _mean_near(baked, "right", shown)
        assert least < ratio / (left / right) < most
    probe = answer.probe("ball", detail).radiance.astype(float)
    seen = read_baked(rebaked).probes["ball"].radiance.astype(float)
    lamps = seen.max(axis=-1) > 2
    wrong = [np.abs(one - seen)[~lamps].mean() for one in (probe, baked.probes["ball"].radiance.astype(float))]
    assert wrong[0] < 0.25 * wrong[1]


def _mean_near(baked: BakedScene, name: str, light: Floats) -> float:
    """Mean light of an object's texels at the paper, the quarter of its surface nearest to it."""
    record = next(o for o in baked.record.objects if o.name == name)
    vertex = np.unique(baked.faces[record.first_face : record.first_face + record.face_count])
    height, width = light.shape[:2]
    depth, place = baked.positions[vertex, 2].astype(float), baked.uv2[vertex] * (width, height)
    plane = np.linalg.lstsq(np.c_[place, np.ones(len(place))], depth, rcond=None)[0]
    low, high = np.ceil(place.min(axis=0)).astype(int), np.floor(place.max(axis=0)).astype(int)
    x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
    near = (x + 0.5) * plane[0] + (y + 0.5) * plane[1] + plane[2] < -1
    return float(np.asarray(light, float)[y[near], x[near]].mean())


def test_a_texture_behind_a_pixel_is_averaged_over_it() -> None:
    stripes = np.zeros((64, 64, 3), np.float16)
    stripes[:, ::2] = 2.0
    texture = Texture(stripes)
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    wide, narrow = (filtered(texture, (0.1 + size * corners)[None]) for size in (0.5, 1e-4))
    assert np.allclose(wide, 1.0, atol=0.05) and abs(float(narrow[0, 0]) - 1.0) > 0.3
