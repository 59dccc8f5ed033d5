"""Objects that only a variant makes glossy have a probe, and variants keep what is baked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lambent.baking.bake import bake
from lambent.realtime.light.baked import read_baked
from lambent.scenes.looks.variants import VariantByObject, with_variants
from lambent.scenes.scene import Look
from tests.baking.small_scenes import MIRROR, TINY, room_with_step


@pytest.mark.long
def test_an_object_that_a_variant_makes_glossy_has_a_probe(tmp_path: Path) -> None:
    plain = room_with_step()
    matte, shiny = {name: Look(m) for name, m in plain.materials.items()}, Look(MIRROR)
    looks = [shiny if o.name == "block" else matte[o.material] for o in plain.objects]
    varied = with_variants(plain, [VariantByObject("chrome", looks)])
    bake(plain, tmp_path / "s", quality=TINY, only=("probe",)).close()
    store = bake(varied, tmp_path / "s", quality=TINY, only=("probe",))
    before = store.artefact("light_map/irradiance").key
    assert "probe/block/radiance" in store and "block" in read_baked(store).probes
    fewer = bake(replace(varied, variants=()), tmp_path / "s", quality=TINY, only=("light_map",))
    assert fewer.artefact("light_map/irradiance").key == before, "variants are no input of the light"
