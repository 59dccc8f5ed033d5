from __future__ import annotations

import numpy as np
import pytest

from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.diffuse import diffuse_mode
from tests.materials.fitting.known_answers import FEW, grey


def mode_of(material: Material) -> float:
    samples = grey(material, FEW)
    return diffuse_mode(samples.f[:, 0], samples.weight * samples.wo[:, 2])


@pytest.mark.parametrize("m", [0.05, 0.1, 0.2])
@pytest.mark.parametrize("kd", [0.01, 0.1, 0.76])
def test_diffuse_under_a_lobe_and_noise(kd, m):
    assert mode_of(Material(kd=kd, lobes=(Lobe(k=0.5, mx=m, my=m, r0=0.1, alpha=0.4),))) == pytest.approx(kd, rel=0.03)


@pytest.mark.parametrize("m", [0.05, 0.2, 0.5])
def test_a_lobe_alone_has_no_diffuse_term(m):
    assert mode_of(Material(lobes=(Lobe(k=0.9, mx=m, my=m, r0=0.9, alpha=0.4),))) < 1e-3


def test_clipped_zeros_do_not_hide_the_mode():
    f = np.where(np.arange(1000) % 10 == 0, 0.0, 0.1 * (1 + 0.02 * np.sin(np.arange(1000))))
    assert diffuse_mode(f, np.ones(1000)) == pytest.approx(0.1 * np.pi, rel=0.02)
    assert diffuse_mode(np.where(np.arange(1000) % 2 == 0, 0.0, f), np.ones(1000)) == 0
    assert diffuse_mode(np.zeros(0), np.zeros(0)) == 0
