"""Highlights alone, by transport over two curves, against their formula: as baked and after edits of both curves."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.materials.document import Lobe, Material
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_lobes import beckmann, of_material
from lambent.materials.fresnel import schlick
from lambent.scenes.sky.triangle_lights import environment_triangles
from tests.baking.transport.test_transport import View, ball_on_floor, environment, view

GLAZE = of_material(Material(lobes=(Lobe(mx=0.06, my=0.06, r0=0.05),)))
EDITS = {
    "as baked": GLAZE,
    "sharper": GLAZE.with_curve("highlight", beckmann(0.04, 0.04).curves["highlight"]),
    "rougher, lifted": GLAZE.with_curve("highlight", beckmann(0.12, 0.12).curves["highlight"]).with_curve(
        "fresnel", Curve.of(lambda x: schlick(np.cos(x), 0.4))
    ),
    "darker when grazing": GLAZE.with_curve("fresnel", Curve.of(lambda x: np.cos(x) ** 2)),
}


@pytest.fixture(scope="module")
def outdoors() -> View:
    return view(ball_on_floor(), environment_triangles(*environment(), 150), (6, 5))


@pytest.mark.long
@pytest.mark.parametrize("edit", EDITS)
def test_highlights_are_those_of_whole_curves(outdoors: View, edit: str) -> None:
    """To .6 %, with 128 x 16 nodes; steps of as many bands, in which the angles are independent, err by 1 to 2 %."""
    found, expected = outdoors.picture(EDITS[edit], 128, 16), outdoors.brute_force(EDITS[edit], 14)
    assert np.abs(found - expected).mean() < 6e-3 * expected.mean()
    assert np.abs(found - expected).max() < 2e-2 * expected.max()
