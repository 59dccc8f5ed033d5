"""The room with a torchiere loads whole, and its lamp lies in the bowl."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lambent.scenes.loaders.load import load_scene
from tests.generated.torchiere import written


def test_the_disc_lies_in_the_bowl(tmp_path: Path) -> None:
    places = []
    for seed in (1, 2):
        scene = load_scene(written(tmp_path / str(seed), seed))
        bowl, disc, foot = (np.array(scene.object(name).mesh.bounds) for name in ("enamel_bowl", "disc", "brass_foot"))
        assert (bowl[0] < disc[0]).all() and (disc[1] < bowl[1]).all() and foot[1, 1] < 0.2
        assert any(scene.object("disc").emission) and len(scene.lights) == 1
        assert {one.material for one in scene.objects} <= set(scene.materials) - {"default"}
        places.append(disc)
    assert not np.allclose(*places)
