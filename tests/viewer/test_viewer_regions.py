"""Regions of a light map that is being baked again, as the window takes them up."""

import numpy as np

from lambent.realtime.gpu.device import open_device
from lambent.realtime.renderer import Renderer
from lambent.store.store import Store
from lambent.viewer.modes.walk.rebake.arrivals import Arrived, Region
from lambent.viewer.modes.walk.rebake.rebaked_light import FADE_STEPS, Rebaked, steps
from tests.viewer.test_viewer_rebaking import SIZE, baked_box


def test_a_region_that_finishes_no_object_changes_nothing(mi, adapter, tmp_path):
    """The picture goes on refining."""
    store = baked_box(tmp_path, "none")
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
