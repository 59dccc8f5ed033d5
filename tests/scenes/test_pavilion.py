"""The pavilion: closed shapes that stand where they should, a teapot in the open, a park that is bright and dark."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.latlong import lat_long_directions
from lambent.scenes import load_scene
from lambent.scenes.builtin import pavilion
from lambent.scenes.scene import Scene
from lambent.scenes.sky.computed import lat_long_image
from lambent.scenes.sky.gardens import SUN


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("builtin:pavilion")


def test_things_stand_on_each_other(scene: Scene) -> None:
    def low(name: str) -> float:
        return float(scene.object(name).mesh.bounds[0][1])

    for name in ("teapot", "saucer_white", "saucer_blue", "saucer_red", "bowl"):
        assert low(name) == pytest.approx(pavilion.TABLE_HIGH, abs=1e-5), name
        x, z = np.abs(scene.object(name).mesh.positions[:, [0, 2]]).max(axis=0)
        assert np.hypot(x, z) < pavilion.CLOTH.flat_radius + 0.05
    cloth, table = scene.object("cloth").mesh, scene.object("table").mesh
    assert cloth.bounds[1][1] == pytest.approx(pavilion.TABLE_HIGH, abs=1e-6)
    assert table.bounds[1][1] < pavilion.TABLE_HIGH - pavilion.GAP / 2  # below the cloth, not in it
    assert cloth.bounds[0][1] > 0.3 and low("table") == pytest.approx(0, abs=1e-6)
    assert abs(low("posts")) < 0.07  # their tilted ends are in the deck


def test_things_on_the_table_do_not_touch(scene: Scene) -> None:
    names = ["teapot", "saucer_white", "saucer_blue", "saucer_red", "bowl"]
    outlines = [scene.object(n).mesh.positions[:, [0, 2]].astype(float) for n in names]
    for i, one in enumerate(outlines):
        for other in outlines[i + 1 :]:
            assert np.linalg.norm(one[:, None] - other[::7], axis=-1).min() > 0.01


def test_the_park_is_bright_and_dark_in_many_colours() -> None:
    image = lat_long_image("park")
    assert np.isfinite(image).all() and image.min() > 0 and image.max() > 1e5 * image.min()
    w = lat_long_directions(*image.shape[:2])
    at = np.unravel_index(image.sum(axis=-1).argmax(), image.shape[:2])
    assert w[at] @ SUN > np.cos(np.radians(1.5))
    band = image[w[..., 1] > 0].astype(float)
    share = band / band.sum(axis=-1, keepdims=True)
    for channel in range(3):  # red and green leaves, blue sky
        assert (share[:, channel] > 0.45).mean() > 0.02


def test_the_park_has_no_seam() -> None:
    """Neighbours across the first and the last column differ no more than those within."""
    image = np.log(lat_long_image("park").astype(float))
    within = np.abs(np.diff(image, axis=1)).mean()
    assert np.abs(image[:, 0] - image[:, -1]).mean() < 2 * within
