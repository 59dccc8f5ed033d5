"""The noise that a bake of interreflections notes, against bakes of other seeds; a store that no longer fits itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.interreflection.settings import Bounces
from lambent.baking.transport.view import View
from lambent.core.errors import UserError
from lambent.core.light.colour import luminance
from lambent.core.progress import silent
from lambent.editing.interreflection.noise import PassNoise, light_of, noted_noise
from lambent.editing.interreflection.stored import interreflections
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.of_lobes import of_material
from lambent.store.store import Store
from tests.baking.interreflection.test_interreflection import FROM_ABOVE, corner

SIZE, BOUNCES = (20, 20), Bounces((16, 1, 1), 64, frozenset({"black"}))
PAINT, SATIN = Material(kd=(0.6, 0.4, 0.3)), Material(kd=0.1, lobes=(Lobe(mx=0.3, my=0.3),))
KINDS = {"floor": PAINT, "back": PAINT, "side": Material(kd=0.5), "ball": SATIN}
SCENE = corner(KINDS)
MATERIALS = {name: of_material(one) for name, one in SCENE.materials.items()}
VIEW = View(FROM_ABOVE, *SIZE)


def baked(folder: Path, seed: int) -> Store:
    watch = PassNoise(folder, [(FROM_ABOVE, SIZE)], MATERIALS, BOUNCES.samples, silent)
    with bake(
        SCENE, folder, only={"interreflection"}, views=[VIEW], bounces=BOUNCES, seed=seed, progress=watch.progress
    ) as store:
        watch.note(store)
    return Store.open(folder)


@pytest.mark.long
def test_the_noise_is_noted_and_is_that_between_bakes(tmp_path: Path) -> None:
    stores = [baked(tmp_path / f"{seed}", seed) for seed in (0, 1)]
    noted = [noted_noise(store, FROM_ABOVE, SIZE, 64) for store in stores]
    one, other = (luminance(light_of(interreflections(s, FROM_ABOVE, SIZE, MATERIALS), MATERIALS).T) for s in stores)
    between = float(np.sqrt(np.mean((one - other) ** 2) / 2) / one.mean())
    assert noted == pytest.approx([between, between], rel=0.3) and between > 0.02
    assert noted_noise(stores[0], FROM_ABOVE, SIZE, 128) is None, "of other samples"
    assert noted_noise(stores[0], replace(FROM_ABOVE, fov_y_deg=9.0), SIZE, 64) is None, "of another view"


@pytest.mark.long
def test_interreflections_of_other_materials_than_the_view_has_now_are_refused(tmp_path: Path) -> None:
    folder, few = tmp_path / "s", replace(BOUNCES, samples=4)
    bake(SCENE, folder, only={"interreflection"}, views=[VIEW], bounces=few).close()
    merged = SCENE.merged({"back": "floor"})
    bake(merged, folder, only={"view_points"}, views=[VIEW]).close()
    with pytest.raises(UserError, match="baked for other materials"):
        interreflections(Store.open(folder), FROM_ABOVE, SIZE, MATERIALS)
    bake(merged, folder, only={"interreflection"}, views=[VIEW], bounces=few).close()
    light = interreflections(Store.open(folder), FROM_ABOVE, SIZE, MATERIALS)
    assert set(light.parts) == {"floor", "side", "ball"} and light.samples == 4
