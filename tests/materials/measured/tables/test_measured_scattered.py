"""Scattered tables: no value outside the range of the nearest measurements, and a word where nothing was measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.geometry.directions import direction, normalize
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.faults import extrapolation
from lambent.materials.measured.inspecting.inspection import inspect_table
from lambent.materials.measured.tables.scattered import NEIGHBOURS, ScatteredTable, _place
from lambent.materials.measured.tables.table import isotropic_brdf

SHARP = Lobe(k=(0.5,) * 3, mx=0.06, my=0.06, r0=(0.05,) * 3, distribution="ggx")
ROUGH = SHARP.model_copy(update={"mx": 0.3, "my": 0.3})
MATERIALS = {
    "flat": Material(kd=(0.5, 0.3, 0.1)),
    "rough": Material(kd=(0.3, 0.2, 0.1), lobes=(ROUGH,)),
    "sharp": Material(kd=(0.3, 0.2, 0.1), lobes=(SHARP,)),
    "metal": Material(kd=0.0, lobes=(ROUGH.model_copy(update={"r0": (0.9,) * 3, "mx": 0.2, "my": 0.2}),)),
    "brushed": Material(kd=0.2, lobes=(ROUGH.model_copy(update={"mx": 0.1}),)),
}


def retro(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    apart = np.arccos(np.sum(wi * wo, axis=-1).clip(-1, 1))
    return (0.1 + 3 * np.exp(-((apart / 0.15) ** 2)))[..., None] * np.ones(3)


TRUTHS = {**{name: MaterialBSDF(material).eval for name, material in MATERIALS.items()}, "retro": retro}


def scan(hemisphere, about_light_deg: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Five incident directions, with viewers all over and closer about the mirror direction, none about the light."""
    random, wi, wo = np.random.default_rng(0), [], []
    for theta in np.radians((10, 30, 45, 60, 75)):
        light = direction(theta, 0.0)
        near = normalize(light * (-1, -1, 1) + random.normal(0, 0.15, (120, 3)))
        seen = np.concatenate([hemisphere(120, int(100 * theta)), near[near[:, 2] > 0.15]])
        seen = seen[seen @ light < np.cos(np.radians(about_light_deg)) + 1e-12]
        wo.append(seen)
        wi.append(np.broadcast_to(light, seen.shape))
    return np.concatenate(wi), np.concatenate(wo)


def table_of(truth, wi: np.ndarray, wo: np.ndarray, noise: float = 0.02) -> ScatteredTable:
    f = truth(wi, wo)
    f = f * (1 + noise * np.random.default_rng(1).standard_normal(f.shape))
    return ScatteredTable(wi, wo, f, isotropic_brdf(Path("a"), "test", {}, ()))


def outside(table: ScatteredTable, wi: np.ndarray, wo: np.ndarray) -> tuple[float, float]:
    """Largest f over the brightest of the nearest tuples, and smallest over the darkest."""
    near = table._f[table._usable][table._tree.query(_place(wi, wo), k=NEIGHBOURS)[1]]
    f = table.eval(wi, wo)
    lit = near.max(axis=1) > 1e-6
    over, under = f[lit] / near.max(axis=1)[lit], near.min(axis=1)[lit] / np.maximum(f[lit], 1e-12)
    return float(over.max()), float(under.max())


@pytest.mark.parametrize("name", TRUTHS)
def test_no_value_is_outside_the_range_of_the_nearest_tuples(name, hemisphere):
    table = table_of(TRUTHS[name], *scan(hemisphere))
    over, under = outside(table, hemisphere(4000, 5), hemisphere(4000, 6))
    assert over <= 1 + 1e-9
    assert under <= 1 + 1e-9


def test_it_is_exact_at_tuples_continuous_and_reciprocal(hemisphere):
    wi, wo = scan(hemisphere)
    table = table_of(TRUTHS["sharp"], wi, wo)
    np.testing.assert_allclose(table.eval(wi, wo), table._f, rtol=1e-6)
    there, back = hemisphere(2000, 3), hemisphere(2000, 4)
    np.testing.assert_allclose(table.eval(there, back), table.eval(back, there), rtol=1e-5)
    steps = []
    for count in (10001, 100001):
        t = np.linspace(0.4, 0.6, count)
        f = table.eval(direction(1.3 * t, 0.3 + t), direction(1.2 - t, 2 + 3 * t))
        steps.append(float(np.abs(np.diff(np.log(f[:, 0]))).max()))
    assert steps[1] < steps[0] / 5


def test_it_says_where_nothing_was_measured(hemisphere):
    table = table_of(TRUTHS["rough"], *scan(hemisphere, about_light_deg=35))
    light = direction(np.full(200, 0.8), 0.0)
    about_light = normalize(light + np.random.default_rng(2).normal(0, 0.03, light.shape))
    assert table.extrapolates(light, about_light).mean() > 0.9
    assert table.extrapolates(light, direction(np.full(200, 1.5), 2.0)).all()
    assert table.extrapolates(hemisphere(500, 7, 60), hemisphere(500, 8, 60) * (-1, 1, 1)).mean() < 0.2
    (said,) = extrapolation(table)[1]
    assert "of the direction pairs" in said
    assert "within 20 degrees of the light" in said
    assert said in inspect_table(table)["findings"]


def test_a_table_measured_everywhere_extrapolates_nowhere(hemisphere):
    wi, wo = hemisphere(4000, 1, 89), hemisphere(4000, 2, 89)
    assert extrapolation(table_of(TRUTHS["rough"], wi, wo)) == (pytest.approx(0, abs=0.5), [])
