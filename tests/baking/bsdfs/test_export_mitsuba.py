"""Plain Mitsuba loads the scenes and evaluates what the writer claims; the exact BSDF in the comment is exact."""

from __future__ import annotations

import re

import numpy as np
import pytest

from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.export import mitsuba
from lambent.materials.export.resampling.resampled import pairs_of
from tests.materials.export.export_materials import ALL, BRUSHED, FOIL, GOLD, PAPER
from tests.tools.in_mitsuba import f_cos


def evaluated(bsdf, samples):
    """f (N, 3) of a Mitsuba BSDF at tuples, without the cosine."""
    return f_cos(bsdf, samples.wi, samples.wo) / samples.wi[:, 2:]


@pytest.mark.long
@pytest.mark.parametrize("name", [one.name for one in (BRUSHED, GOLD, FOIL, PAPER)])
def test_mitsuba_evaluates_what_is_claimed(mi, name, tmp_path):
    material = ALL[name]
    path = tmp_path / "scene.xml"
    cost = mitsuba.write(material, path)
    scene = mi.load_file(str(path))
    (ball,) = [shape for shape in scene.shapes() if not shape.is_emitter()]
    pairs = pairs_of(material, 11, seed=5)
    value = evaluated(ball.bsdf(), pairs.samples)
    found, _ = mitsuba.likeness(material)
    claimed = np.broadcast_to(found.eval(pairs, mitsuba.TOOL), value.shape)
    np.testing.assert_allclose(value, claimed, rtol=2e-3, atol=1e-5)
    if not material.transmits:
        assert cost.share["cuberoot"] < 0.08
    if material is FOIL:
        exact = re.search(r'<bsdf type="lambent_material".*?</bsdf>', path.read_text(), re.DOTALL)
        bsdf = mi.load_string(exact[0].replace("<bsdf ", '<bsdf version="3.0.0" ', 1))
        expected = MaterialBSDF(FOIL).eval(pairs.samples.wi, pairs.samples.wo)
        np.testing.assert_allclose(evaluated(bsdf, pairs.samples), expected, rtol=1e-3)
    if material is BRUSHED:
        image = np.array(mi.render(scene, spp=1))
        assert image.shape == (512, 512, 3) and np.isfinite(image).all() and image[200:300, 200:300].mean() > 0.1
