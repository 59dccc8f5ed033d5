"""The copy beside a store, and the light read from it, step by step."""

from dataclasses import replace

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.running.again import COPY_OF, bake_again, rebaked_copy
from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe
from lambent.realtime.gpu.device import open_device
from lambent.realtime.light.baked import read_baked
from lambent.realtime.renderer import Renderer
from lambent.scenes.loaders.load import load_scene
from lambent.store.store import Store
from lambent.viewer.modes.walk.rebake.arrivals import Arrived, Region
from lambent.viewer.modes.walk.rebake.rebaked_light import (
    FADE_STEPS,
    Rebaked,
    in_view_order,
    steps,
    texel_steps,
)
from tests.baking.small_scenes import TINY
from tests.viewer.modes.walk.rebake.recorded_bakes import TILES, painted

SIZE = (64, 48)


@pytest.mark.long
def test_the_copy_is_the_bake_of_the_edited_scene(boxes, store, tmp_path):
    """To the bit, since seeds and effort are the same."""
    scene, copy = load_scene("builtin:box"), Store.open(boxes["none"].recordings / "painted" / "copy")
    edited = replace(scene, materials={**scene.materials, **painted(scene)})
    direct = bake(edited, tmp_path / "direct", quality=TILES, only={"light_map", "probe"})
    names = [a.name for a in copy.artefacts() if a.kind in ("light_map", "probe")]
    assert "light_map/irradiance" in names
    for name in names:
        np.testing.assert_array_equal(copy.read(name), direct.read(name), err_msg=name)
    assert copy.documents[COPY_OF] == "box.store"


def test_a_folder_of_somebody_else_is_left_alone(store, tmp_path):
    other = Store.create(tmp_path / "other", {})
    other.close()
    with pytest.raises(UserError, match="is another store"):
        bake_again(store, tmp_path / "other", {}, quality=TINY)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "letter.txt").write_text("dear")
    with pytest.raises(UserError, match="neither empty"):
        bake_again(store, tmp_path / "full", {}, quality=TINY)
    assert (tmp_path / "full" / "letter.txt").read_text() == "dear"


def test_an_edit_that_needs_what_the_store_lacks_is_one_line(store, tmp_path):
    """A matte material that mirrors, and one that lets light through; its name and what is lacking are said."""
    scene = load_scene("builtin:box")
    probes = {a.name.split("/")[1] for a in Store.open(store).artefacts("probe")}
    bare = next(o for o in scene.objects if o.name not in probes and not scene.materials[o.material].lobes)
    material = scene.materials[bare.material]
    glossy = material.model_copy(update={"lobes": (Lobe(mx=0.05, my=0.05, r0=0.5),)})
    with pytest.raises(UserError, match=f"{bare.material}: needs a probe"):
        bake_again(store, tmp_path / "copy", {bare.material: glossy}, quality=TINY)
    if "light_map/irradiance_back" not in Store.open(store):
        thin = material.model_copy(update={"kd": (0.2,) * 3, "kt_d": (0.4,) * 3})
        with pytest.raises(UserError, match=f"{bare.material}: needs a light map of its far side"):
            bake_again(store, tmp_path / "copy", {bare.material: thin}, quality=TINY)
    assert not (tmp_path / "copy").exists()


def test_settings_of_its_own_are_one_line(store, tmp_path):
    with pytest.raises(UserError, match="unknown quality"):
        bake_again(store, tmp_path / "copy", {})
    assert rebaked_copy(tmp_path / "room.store").name == "room.rebake.store"


def test_texels_go_over_by_their_batches_and_end_exactly():
    rng = np.random.default_rng(1)
    before, after = ([rng.random((4, 6, 4)).astype(np.float16)] for _ in range(2))
    batch = np.repeat([[0, 0, 1, 1, 2, 2]], 4, axis=0)
    frames = [layers[0].astype(np.float32) for layers in texel_steps(before, after, batch)]
    np.testing.assert_array_equal(frames[-1], after[0].astype(np.float32))
    first, last = before[0].astype(np.float32), after[0].astype(np.float32)
    changes = np.abs(np.diff([first, *frames], axis=0)) / np.maximum(np.abs(last - first), 1e-3)
    assert changes.max() < 0.25, "no frame jumps"
    np.testing.assert_array_equal(frames[1][:, 2:], first[:, 2:])
    np.testing.assert_array_equal(frames[FADE_STEPS - 1][:, :2], last[:, :2])


def test_objects_in_view_come_first_and_near_ones_before_far_ones(scene):
    camera = Camera(name="in", position=(0.0, 1.0, 0.0), target=(0.0, 1.0, -1.0), fov_y_deg=40)
    places = {"behind": 1.0, "far": -3.0, "near": -1.0}
    first = scene.objects[0]
    objects = tuple(
        first.model_copy(update={"name": name, "bounds": ((-0.1, 0.9, z), (0.1, 1.1, z + 0.1))})
        for name, z in places.items()
    )
    order = in_view_order(scene.model_copy(update={"objects": objects}), camera, (64, 48))
    assert [objects[number].name for number in order] == ["near", "far", "behind"]


def test_reading_takes_the_units_of_the_scene_that_is_shown(boxes, store):
    scene, folder = Renderer(open_device(), Store.open(store)).scene, boxes["none"].recordings / "painted" / "copy"
    copy = read_baked(Store.open(folder))
    names = frozenset(one.name for one in Store.open(folder).artefacts("probe"))
    again = Rebaked.read(folder, scene, Arrived(None, True, names, True))
    found, expected = again.layers({}, [])[0][..., :3], copy.irradiance * copy.unit / scene.unit
    np.testing.assert_allclose(found, expected, rtol=2e-3)
    assert again.scene.probes.keys() == scene.probes.keys() == copy.probes.keys()
    for name, probe in copy.probes.items():
        found = again.probe(name, {}).radiance * scene.unit
        np.testing.assert_allclose(found, probe.radiance * copy.unit, rtol=1e-3, atol=1e-4)


def test_a_region_that_finishes_no_object_changes_nothing(store):
    """The picture goes on refining."""
    renderer = Renderer(open_device(), Store.open(store))
    scene, size = renderer.scene, renderer.scene.irradiance.shape[:2]

    def arrived(finished, before=None):
        light = np.zeros((1, *size, 3), np.float16)
        return Rebaked.read(store, scene, Arrived(Region(light, np.full(size, finished))), before)

    def uploads(rebaked, since):
        return list(steps(rebaked, since, scene, renderer.resources, {}, scene.record.cameras[0], SIZE))

    nothing, everything = arrived(False), arrived(True)
    assert not nothing.lit.any() and uploads(nothing, None) == []
    assert len(uploads(everything, nothing)) >= FADE_STEPS
    assert uploads(arrived(True, everything), everything) == []
