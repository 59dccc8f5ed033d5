"""Nodes of a document's curves: what they show, and what pulling them changes."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.editing.curves.nodes import (
    Which,
    angles_deg,
    copied,
    curves_of,
    pulled,
    smoothed,
    values_of,
    with_values,
)
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material, material_from
from tests.materials.test_curve_lobes import KD_CURVE, curve_lobe

GLOSSY = Material(
    kd=(0.3, 0.2, 0.1),
    kd_coupled=True,
    lobes=(
        Lobe(mx=0.2, my=0.2, r0=(0.04, 0.5, 0.9), k=0.8),
        Lobe(mx=0.1, my=0.3, side="transmission", distribution="ggx"),
    ),
)
CURVED = Material(kd=0.4, kd_curve=KD_CURVE, lobes=(curve_lobe(mx=0.2, my=0.1),))


@pytest.mark.parametrize("material", [GLOSSY, CURVED])
def test_setting_the_values_that_it_has_changes_nothing(material: Material) -> None:
    """But for what a curve between nodes cannot follow of an analytic lobe: a few per cent."""
    wi, wo = direction(np.full(60, 0.6), 0.1), direction(np.linspace(0, 1.5, 60), 3.0)
    for which in curves_of(material):
        same = with_values(material, which, values_of(material, which))
        material_from(same.model_dump(mode="json"), "m.json")
        for far in (1, -1):
            before, after = (MaterialBSDF(one).eval(wi, wo * (1, 1, far)) for one in (material, same))
            exact = material is CURVED
            np.testing.assert_allclose(
                after, before, rtol=1e-9 if exact else 0.06, atol=1e-9 if exact else 0.02 * before.max()
            )


@pytest.mark.parametrize("which", curves_of(CURVED))
def test_pulling_a_node_leaves_the_others(which: Which) -> None:
    values = values_of(CURVED, which)
    changed = pulled(values, 3, 2.5 * float(values[3, 0]), tuple(range(values.shape[1])), soft=False)
    found = values_of(with_values(CURVED, which, changed), which)
    np.testing.assert_allclose(found, changed, rtol=1e-6)


def test_pulling_a_shape_brightens_that_angle_alone() -> None:
    which = Which("shape")
    values = values_of(CURVED, which)
    changed = with_values(CURVED, which, pulled(values, 10, 3 * float(values[10, 0]), (0,), soft=False))
    theta = np.radians(angles_deg(CURVED, which))
    lobe = CURVED.lobes[0]
    for node, factor in ((10, 3.0), (3, 1.0), (20, 1.0)):
        along = np.arctan(np.tan(theta[node]) * np.sqrt(lobe.mx / lobe.my))  # the node's slope radius, along t
        h = direction(along, 0.0)
        f = [MaterialBSDF(one.model_copy(update={"kd": (0.0,) * 3})).eval(h, h) for one in (CURVED, changed)]
        np.testing.assert_allclose(f[1], factor * f[0], rtol=1e-6)


def test_a_soft_pull_takes_neighbours_along_and_smoothing_calms_them() -> None:
    values = values_of(CURVED, Which("shape"))
    soft = pulled(values, 8, 4 * float(values[8, 0]), (0,), soft=True)
    assert soft[8, 0] == pytest.approx(4 * values[8, 0])
    ratio = soft[:, 0] / values[:, 0]
    assert 1 < ratio[10] < ratio[9] < 4 and ratio[20] == pytest.approx(1, abs=1e-3)
    bumpy = pulled(values, 8, 40 * float(values[8, 0]), (0,), soft=False)
    bends = [np.abs(np.diff(np.log(v[:, 0]), 2)).max() for v in (bumpy, smoothed(bumpy))]
    assert bends[1] < 0.6 * bends[0]


def test_one_channel_of_fresnel_can_be_pulled() -> None:
    which = Which("fresnel")
    values = values_of(CURVED, which)
    found = values_of(with_values(CURVED, which, pulled(values, 2, 0.9, (1,), soft=False)), which)
    assert found[2, 1] == pytest.approx(0.9)
    np.testing.assert_allclose(np.delete(found.ravel(), 2 * 3 + 1), np.delete(values.ravel(), 2 * 3 + 1), rtol=1e-9)


def test_curves_are_copied_from_another_material() -> None:
    taken = copied(GLOSSY, Which("shape"), CURVED)
    assert taken is not None and taken.lobes[0].shape == CURVED.lobes[0].shape and taken.lobes[0].k == GLOSSY.lobes[0].k
    taken = copied(GLOSSY, Which("fresnel"), CURVED)
    assert taken is not None and taken.lobes[0].fresnel == CURVED.lobes[0].fresnel
    assert copied(GLOSSY, Which("shape", 1), CURVED) is None, "it has no lobe of transmission"
    taken = copied(GLOSSY, Which("diffuse"), CURVED)
    assert taken is not None and taken.kd == GLOSSY.kd and not taken.kd_coupled
    np.testing.assert_allclose(np.array(taken.kd_curve) / taken.kd_curve[0], np.array(KD_CURVE) / KD_CURVE[0])


def test_impossible_values_change_nothing() -> None:
    which = Which("shape")
    values = values_of(CURVED, which)
    for wrong in (0 * values, np.full_like(values, np.nan), np.full_like(values, np.inf)):
        assert with_values(CURVED, which, wrong) is CURVED
    far = with_values(CURVED, which, 1e12 * values)
    material_from(far.model_dump(mode="json"), "m.json")
