"""The facets agree with the analytic models, and the weights of pairs are solid angles."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.export.resampling.pairs import pairs_of
from tests.materials.export.export_materials import FOIL, PLASTIC


@pytest.mark.parametrize("material", [PLASTIC, FOIL], ids=lambda m: m.name)
def test_weights_integrate_to_the_albedo(material):
    """Mean over theta_i of the albedo, by the pairs and by importance sampling."""
    samples = pairs_of(material, 14, seed=1).samples
    theta = np.radians(np.linspace(0, 84, 43)[:-1] + 1)
    phi = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    wo = np.stack(
        np.broadcast_arrays(
            np.sin(theta)[:, None] * np.cos(phi),
            np.sin(theta)[:, None] * np.sin(phi),
            np.cos(theta)[:, None] + 0 * phi,
        ),
        axis=-1,
    )
    albedo = MaterialBSDF(material).albedo(wo, samples=1024).mean(axis=(0, 1))[: samples.f.shape[1]]
    total = (samples.weight * np.abs(samples.wo[:, 2])) @ samples.f / 2**14
    np.testing.assert_allclose(total, albedo, rtol=0.05)  # the pairs leave out what is beyond 84 degrees
    assert (total < 1.02 * albedo).all()
