"""What a bake tells of its light before it is done."""

import io

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.running.watch import Watch
from lambent.scenes.loaders.load import load_scene
from lambent.viewer.modes.walk.rebake.arrivals import Arrivals, Region
from tests.baking.small_scenes import TINY

IN_TILES = TINY.changed("tiles", light_map={"tile_texels": 16})


class Seen(Watch):
    region_pause = 0.0

    def __init__(self):
        self.told, self.regions = [], []

    def arrived(self, kind, names):
        self.told.append((kind, set(names)))

    def region(self, light, finished):
        self.told.append(("region", set()))
        self.regions.append((light.astype(np.float32), finished))


@pytest.mark.long
def test_regions_come_tile_by_tile_and_are_near_to_the_finished_map(mi, tmp_path):
    seen, scene = Seen(), load_scene("builtin:box")
    how = {"quality": IN_TILES, "only": {"light_map", "probe"}, "light_groups": "scene"}
    store = bake(scene, tmp_path / "box.store", watch=seen, **how)
    kinds = [kind for kind, _ in seen.told]
    probes = [names for kind, names in seen.told if kind == "probe"]
    assert max(n for n, kind in enumerate(kinds) if kind == "region") < kinds.index("light_map") < kinds.index("probe")
    assert probes[-1] == {a.name for a in store.artefacts("probe")} and len(probes) > 2
    shares = [finished.mean() for _, finished in seen.regions]
    assert len(shares) > 3 and (np.diff(shares) > 0).all() and shares[-1] < 1
    whole = store.read("light_map/irradiance").astype(np.float32)
    assert len(seen.regions[0][0]) == len(store.read("light_map/groups"))
    light, finished = seen.regions[-1]
    near = np.abs(light.sum(axis=0) - whole)[finished].mean() / whole[finished].mean()
    assert near < 0.08
    again = Seen()
    bake(scene, tmp_path / "box.store", watch=again, **how)
    assert not again.regions and {kind for kind, _ in again.told} >= {"light_map", "probe"}


def test_light_that_is_cut_off_is_none():
    light, finished = np.ones((2, 4, 6, 3), np.float16), np.arange(24).reshape(4, 6) % 2 == 0
    sent = light.tobytes() + finished.tobytes()
    found = Region.read((2, 4, 6), io.BytesIO(sent))
    np.testing.assert_array_equal(found.light, light)
    np.testing.assert_array_equal(found.finished, finished)
    arrivals = Arrivals()
    assert arrivals.take({"region": [2, 4, 6]}, io.BytesIO(sent[:-1])) and arrivals.now.region is None
    assert not arrivals.take({"what": "light map", "done": 1, "total": 2}, io.BytesIO())
    arrivals.take({"kind": "probe", "there": ["probe/a/radiance", "probe/a/distance", "probe/a/planes"]}, io.BytesIO())
    assert arrivals.now.has_probe("a", by_group=False) and not arrivals.now.has_probe("a", by_group=True)
    assert not arrivals.now.light_map
