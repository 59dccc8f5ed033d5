"""Other colours of materials, and what light between surfaces sees of them."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baked.answering.albedos import albedos_of, edited_albedos
from lambent.baked.answering.answer import MOST_ALBEDO
from lambent.core.errors import UserError
from lambent.materials.document import Lobe, Material
from lambent.materials.recolour import parse_recolours, recoloured

GLOSSY = Material(kd=0.3, kt_d=0.1, lobes=(Lobe(mx=0.3, my=0.3, r0=0.5, k=0.5),))


def test_colours_are_decoded_from_srgb() -> None:
    found = parse_recolours(["a=b=#ff8000", " wall = #000000"])
    assert found["a=b"] == pytest.approx((1.0, 0.21586, 0.0), abs=1e-4) and found["wall"] == (0, 0, 0)


@pytest.mark.parametrize("text", ["wall", "wall=red", "=#ffffff", "wall=#fff", "wall=ffffff", "wall=#gggggg"])
def test_what_is_no_colour_is_refused(text: str) -> None:
    with pytest.raises(UserError, match="MATERIAL=#rrggbb"):
        parse_recolours([text])


def test_a_material_is_named_once_and_there() -> None:
    with pytest.raises(UserError, match="twice"):
        parse_recolours(["wall=#ffffff", "wall=#000000"])
    with pytest.raises(UserError, match="walls"):
        recoloured({"walls": GLOSSY}, {"wals": (0, 0, 0)})


def test_a_pattern_stands_for_all_materials_that_match() -> None:
    """Variants split a material: wall and wall_2 are one paint to a user."""
    both = recoloured({"wall": GLOSSY, "wall_2": GLOSSY, "floor": GLOSSY}, {"wall*": (0.1, 0.2, 0.3)})
    assert {name: one.kd for name, one in both.items()} == {"wall": (0.1, 0.2, 0.3), "wall_2": (0.1, 0.2, 0.3)}
    with pytest.raises(UserError, match=r"roof\*"):
        recoloured({"wall": GLOSSY}, {"roof*": (0, 0, 0)})


def test_a_colour_changes_the_diffuse_reflection_alone() -> None:
    edited = recoloured({"wall": GLOSSY}, {"wall": (0.1, 0.2, 0.3)})["wall"]
    assert edited == GLOSSY.model_copy(update={"kd": (0.1, 0.2, 0.3)})
    found = edited_albedos([GLOSSY], [edited])
    assert found.reflected.tolist() == [[0.1, 0.2, 0.3]] and found.transmitted.tolist() == [[0.1] * 3]


def test_an_edited_lobe_counts_by_the_difference_of_equivalent_albedos() -> None:
    half = GLOSSY.model_copy(update={"lobes": (GLOSSY.lobes[0].model_copy(update={"k": (0.25,) * 3}),)})
    none = GLOSSY.model_copy(update={"lobes": ()})
    whole = 0.3 - edited_albedos([GLOSSY], [none]).reflected
    assert np.all(whole > 0.1) and np.allclose(0.3 - edited_albedos([GLOSSY], [half]).reflected, whole / 2)
    assert np.allclose(edited_albedos([none], [GLOSSY]).reflected - 0.3, whole)
    through = GLOSSY.model_copy(update={"lobes": (*GLOSSY.lobes, Lobe(side="transmission", mx=0.2, my=0.2, k=0.3))})
    both = edited_albedos([GLOSSY], [through])
    assert np.allclose(both.reflected, 0.3) and np.all(both.transmitted > 0.15)


def test_as_baked_is_as_baked_and_edits_stay_below_one() -> None:
    assert edited_albedos([GLOSSY], [GLOSSY]).same_as(albedos_of([GLOSSY]))
    bright = GLOSSY.model_copy(update={"kd": (1.5, 0.2, 1.0)})
    found = edited_albedos([GLOSSY], [bright])
    assert np.allclose((found.reflected + found.transmitted)[0], [MOST_ALBEDO, 0.3, MOST_ALBEDO])
