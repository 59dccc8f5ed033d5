"""Quotients of tables and textures in the path tracer's arrays, against numpy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.baking.engine import engine
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import components
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.opening import of_textures
from lambent.materials.factored.quotients import Grooves
from lambent.materials.factored.tabulated import Grid, Tabulated
from lambent.materials.lobes import NUMPY
from lambent.materials.measured.homomorphic import HomomorphicTable
from lambent.scenes.sky.triangle_lights import environment_triangles
from tests.baking.transport.test_transport import GLOSSY, ball_on_floor, environment, view

RNG = np.random.default_rng(5)


def smooth(grid: Grid) -> np.ndarray:
    h, th, td, pd = grid.angles()
    wave = 1 + 0.3 * np.cos(h) + 0.2 * np.cos(2 * pd) * np.sin(td) * np.sin(th) + th
    return np.stack([wave, 2 * wave, wave**2], axis=-1).reshape(-1, 3)


def quotients() -> dict[str, Any]:
    isotropic, brushed = Grid(90, 45, 36), Grid(32, 16, 12, 12, turns_d=2)
    textures = RNG.random((2, 16, 16, 3))
    return {
        "isotropic": Tabulated(isotropic, smooth(isotropic)),
        "brushed": Tabulated(brushed, smooth(brushed), Grooves()),
        "textures": of_textures(HomomorphicTable(*textures, np.ones(3), "noise")).terms[0].quotient,
    }


@pytest.mark.parametrize("name", quotients())
def test_path_tracer_and_numpy_agree(name: str) -> None:
    engine()
    import mitsuba as mi

    from lambent.baking.tracing.array_ops import array_ops

    wi, wo = (direction(np.arccos(RNG.uniform(0.1, 1, 5000)), RNG.uniform(0, 2 * np.pi, 5000)) for _ in range(2))
    wi[:500] = wo[:500] * [-1, -1, 1] + RNG.normal(0, 1e-3, (500, 3))
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    wi, wo = wi.astype(np.float32).astype(float), wo.astype(np.float32).astype(float)
    quotient = quotients()[name]
    expected = np.stack(quotient.evaluate(components(wi), components(wo), NUMPY), axis=-1)
    pair = [tuple(mi.Float(np.ascontiguousarray(w[:, c], np.float32)) for c in range(3)) for w in (wi, wo)]
    found = np.stack([np.array(v) for v in quotient.evaluate(*pair, array_ops())], axis=-1)
    assert np.abs(found - expected).max() < 2e-3 * expected.max()
    assert expected.std() > 0.01


def test_transport_looks_the_remainder_up() -> None:
    """Ratios of (1, 2, 3) make the channels of the transport one, two and three times as large."""
    outdoors = view(ball_on_floor(), environment_triangles(*environment(), 50))
    plain = of_material(GLOSSY)
    grid = Grid(8, 6, 4)
    ratios = np.tile([1.0, 2.0, 3.0], (8 * 6 * 4, 1))
    terms = tuple(replace(term, quotient=Tabulated(grid, ratios, term.quotient)) for term in plain.terms)
    expected, found = outdoors.picture(plain, 32), outdoors.picture(replace(plain, terms=terms), 32)
    assert expected.max() > 0
    assert np.allclose(found, expected * [1, 2, 3], rtol=1e-4, atol=1e-5)


def test_equal_quotients_are_equal_and_different_ones_are_not() -> None:
    """What keys of stores go by."""
    one, same = (Tabulated(Grid(4, 3, 2), np.ones((24, 3))) for _ in range(2))
    other = Tabulated(Grid(4, 3, 2), np.full((24, 3), 2.0))
    assert one == same and repr(one) == repr(same)
    assert one != other and repr(one) != repr(other)
