"""Operators on curves: what each does in its region, that nothing changes outside, smoothness, order, limits."""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from lambent.editing.curves.half_table import looked_up
from lambent.editing.curves.operators import STEEPEST, Kind, Operator, Region, room_for, smooth_step, translation
from lambent.materials.factored.curve import Curve, angles_rad


def layered(curve: Curve, operators: Iterable[Operator]) -> Curve:
    return reduce(lambda before, operator: operator.applied(before), operators, curve)


REGION = Region(a=0.3, b=0.5, c=0.7, d=1.0)
HUMP = Curve.of(lambda x: 1 + np.exp(-(((x - 0.6) / 0.1) ** 2)))
X = angles_rad()
INSIDE, OUTSIDE = REGION.weight(X) == 1, REGION.weight(X) == 0


def test_step_is_smooth_and_symmetric() -> None:
    t = np.linspace(-0.5, 1.5, 20_001)
    step = smooth_step(t)
    assert step[0] == 0
    assert step[-1] == 1
    assert np.allclose(step + step[::-1], 1)
    first = np.gradient(step, t)
    assert first.min() >= 0
    assert first.max() == pytest.approx(STEEPEST, rel=0.003)
    for end in (0.0, 1.0):  # all derivatives vanish at the ends: the step is flatter there than any power
        near = np.abs(smooth_step(end + np.array([0.05, -0.05])) - end)
        assert near.max() < 1e-30


def test_nothing_changes_outside_of_the_region() -> None:
    for kind, size in (("translate_y", 0.7), ("amplify_y", 3.0), ("translate_x", 0.05), ("amplify_x", 1.2)):
        edited = Operator(kind=kind, region=REGION, size=size, base=0.6).applied(HUMP)
        assert np.array_equal(edited.values[OUTSIDE], HUMP.values[OUTSIDE])
        assert not np.allclose(edited.values, HUMP.values)


def test_translate_y_adds_and_amplify_y_multiplies_about_its_base() -> None:
    up = Operator(kind="translate_y", region=REGION, size=0.7).applied(HUMP)
    assert np.allclose(up.values[INSIDE], HUMP.values[INSIDE] + 0.7)
    more = Operator(kind="amplify_y", region=REGION, size=3, base=1).applied(HUMP)
    assert np.allclose(more.values[INSIDE], 1 + 3 * (HUMP.values[INSIDE] - 1))


def test_translate_x_moves_to_larger_angles() -> None:
    moved = Operator(kind="translate_x", region=REGION, size=0.05).applied(HUMP)
    assert X[moved.values[:, 0].argmax()] == pytest.approx(0.65, abs=1e-3)
    assert moved.values.max() == pytest.approx(HUMP.values.max(), rel=1e-5)


def test_amplify_x_stretches_about_its_base() -> None:
    wide = Region(a=0.0, b=0.2, c=1.0, d=1.4)
    wider = Operator(kind="amplify_x", region=wide, size=1.5, base=0.6).applied(HUMP)
    assert np.allclose(wider.at(np.array([0.6, 0.75])), HUMP.at(np.array([0.6, 0.7])), rtol=1e-4)


@pytest.mark.parametrize(("kind", "size"), [("translate_y", 1.0), ("translate_x", 0.08), ("amplify_y", 4.0)])
def test_smoothness_is_kept(kind: Kind, size: float) -> None:
    """Second differences converge as the step shrinks; at a kink they would double with every halving."""
    edited = Operator(kind=kind, region=REGION, size=size).applied(HUMP).values[:, 0]
    second = [np.abs(np.diff(edited[::step], 2)).max() / step**2 for step in (8, 16)]
    assert second[0] < 1.2 * second[1]


def test_layers_in_y_come_first() -> None:
    """The lifted part is the one that moves."""
    operators = translation(REGION, 0.05, 1.0, (0, 1, 2))
    assert [o.kind for o in operators] == ["translate_y", "translate_x"]
    by_hand = operators[1].applied(operators[0].applied(HUMP))
    assert np.array_equal(layered(HUMP, operators).values, by_hand.values)
    assert layered(HUMP, operators).values.max() == pytest.approx(3.0, abs=0.01)


def test_curves_stay_above_zero() -> None:
    assert Operator(kind="translate_y", region=REGION, size=-9).applied(HUMP).values.min() == 0


@given(
    st.floats(-0.5, 1.2), st.floats(0.01, 0.5), st.floats(0, 0.5), st.floats(0.01, 0.5), st.floats(-0.4, 0.4)
)  # fmt: skip
def test_a_drag_with_room_never_folds(a: float, rise: float, flat: float, fall: float, x: float) -> None:
    region = room_for(Region(a=a, b=a + rise, c=a + rise + flat, d=a + rise + flat + fall), x)
    layered(HUMP, translation(region, x, 0.1, (0, 1, 2)))


def test_folds_are_refused() -> None:
    with pytest.raises(ValidationError, match="folds the curve"):
        Operator(kind="translate_x", region=REGION, size=0.15)
    with pytest.raises(ValidationError, match="factor above 0"):
        Operator(kind="amplify_x", region=REGION, size=0)


@pytest.mark.parametrize("ends", [(0, 0, 1, 2), (0, 1, 0.5, 2), (0, 1, 2, 2), (0, 1, 2, float("nan"))])
def test_regions_are_in_order(ends: tuple[float, ...]) -> None:
    with pytest.raises(ValidationError):
        Region(**dict(zip("abcd", ends, strict=True)))


def test_tables_are_looked_up_by_the_nearest_half_float() -> None:
    """-0 and values below 0 are 0, values above the largest half float are that."""
    values = np.array([0.0, -0.0, -3.0, 1.0, 0.1, 1e9], np.float32)
    bits = np.clip(values, 0, 65504).astype(np.float16).view(np.uint16) & 0x7FFF
    table = (np.arange(1 << 15) % 251).astype(np.uint8)
    found = looked_up(values.reshape(1, 2, 3), table)
    assert np.array_equal(found[..., :3].ravel(), table[bits]) and (found[..., 3] == 255).all()
