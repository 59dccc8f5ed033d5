"""A baked lens that refracts, beside exact rays through it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.core.pictures.images import read_image
from lambent.core.pictures.metrics import flip_error
from lambent.core.views.camera import Camera
from lambent.render import Settings, still
from lambent.store.store import Store
from tests.baking.small_scenes import TINY
from tests.render.lens_room import FRONT, OBLIQUE, Lens

LENS, PIXELS = Lens(1.0, 0.01), 96
FIELD = {"points": 100, "texels": 126, "strata": 2}


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    quality = TINY.changed("lens", light_field=FIELD, geometry={"texels": 96})
    return bake(LENS.scene(), tmp_path_factory.mktemp("lens") / "s", quality=quality, only=("light_field",))


@pytest.mark.long
@pytest.mark.parametrize(
    ("camera", "rms", "flip"), [(FRONT, 0.16, 0.18), (OBLIQUE, 0.33, 0.48)], ids=["front", "oblique"]
)
def test_a_lens_shows_what_it_refracts(store: Store, tmp_path: Path, camera: Camera, rms: float, flip: float) -> None:
    """Errors relative to those of light that passes straight.

    From the side, .43 and .56 if the second face is the plane behind the place where rays enter, not leave.
    """
    settings = Settings(PIXELS, PIXELS, integrator="qmc", samples=4, exposure_ev=0.0)
    still(store.folder, tmp_path / "lens.exr", camera, settings)
    image = read_image(tmp_path / "lens.exr")[..., :3]
    truth, straight, through = LENS.seen(camera, PIXELS)
    errors = [float(np.sqrt(((of - truth)[through] ** 2).mean())) for of in (image, straight)]
    flips = [float(flip_error(*(np.where(through[..., None], of, 0.0) for of in (truth, one)))[through].mean())
             for one in (image, straight)]  # fmt: skip
    assert through.sum() > 1500
    assert errors[0] < rms * errors[1] and flips[0] < flip * flips[1], (errors, flips)
