"""Fresnel terms: exact values known by hand, and agreement of their several forms."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.materials import lobes
from lambent.materials.fresnel import conductor, ior_of, r0_of, schlick

COSINE = np.linspace(0, 1, 101)


def test_the_lobes_schlick_term_is_the_same():
    r0 = np.array([0.04, 0.5, 1.0])
    expected = np.stack([lobes.fresnel(COSINE, value) for value in r0], axis=-1)
    np.testing.assert_allclose(schlick(COSINE, r0), expected, rtol=1e-14)


def test_normal_and_grazing_incidence():
    assert conductor(np.array(1.0), 1.5, 0.0) == pytest.approx(r0_of(1.5)) == pytest.approx(0.04)
    assert conductor(np.array(1.0), 1.0, 2.0) == pytest.approx(0.5)  # k^2 / ((n + 1)^2 + k^2) for n = 1
    assert [conductor(np.array(0.0), *nk) for nk in ((1.5, 0.0), (1.0, 2.0))] == pytest.approx([1, 1])


def test_index_and_reflectance_are_inverse():
    assert [ior_of(r0_of(ior)) for ior in (1.0, 1.33, 2.4)] == pytest.approx([1.0, 1.33, 2.4])
