"""MERL: bins, scales, holes, reciprocity, weights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.materials.measured import load
from lambent.materials.measured.merl import directions_of, half_difference_angles
from tests.materials.measured.measured_files import Loaded, merl_bytes

SHAPE = (30, 20, 24)


def _saved(path: Path, f: np.ndarray) -> Path:
    path.write_bytes(merl_bytes(f))
    return path


def _centres() -> tuple[np.ndarray, ...]:
    i, j, k = np.meshgrid(*map(np.arange, SHAPE), indexing="ij")
    return ((i + 0.5) / 30) ** 2 * np.pi / 2, (j + 0.5) / 20 * np.pi / 2, (k + 0.5) / 24 * np.pi


def test_values_stand_at_bin_centres(tmp_path: Path) -> None:
    f = np.random.default_rng(0).uniform(0.1, 2, (*SHAPE, 3))
    table = load(_saved(tmp_path / "a", f))
    wi, wo = directions_of(*_centres())
    seen = (wi[..., 2] > 0.01) & (wo[..., 2] > 0.01)
    np.testing.assert_allclose(table.eval(wi, wo)[seen], f[seen], rtol=1e-5)


def test_the_last_bin_of_phi_d_is_followed_by_the_first(tmp_path: Path) -> None:
    """phi_d and phi_d + pi are one pair of directions, exchanged: at 0 f lies between the last bin and the first."""
    f = np.random.default_rng(2).uniform(0.1, 2, (*SHAPE, 3))
    table = load(_saved(tmp_path / "a", f))
    theta_h, theta_d, _ = (grid[4:8, 3:6, 0] for grid in _centres())
    wi, wo = directions_of(theta_h, theta_d, np.full(theta_h.shape, 1e-9))
    np.testing.assert_allclose(table.eval(wi, wo), f[4:8, 3:6, [0, -1]].mean(axis=2), rtol=1e-5)


def test_angles_round_trip_and_reciprocity(hemisphere, tmp_path: Path) -> None:
    theta_h, theta_d, phi_d = (a.ravel() for a in _centres())
    for value, expected in zip(
        half_difference_angles(*directions_of(theta_h, theta_d, phi_d)), (theta_h, theta_d, phi_d), strict=True
    ):
        np.testing.assert_allclose(value, expected, atol=1e-7)
    f = np.random.default_rng(1).uniform(0, 1, (*SHAPE, 3))
    table = load(_saved(tmp_path / "a", f))
    wi, wo = hemisphere(500, 3), hemisphere(500, 4)
    np.testing.assert_allclose(table.eval(wi, wo), table.eval(wo, wi), rtol=1e-4)


def test_white_lambert_has_albedo_one(tmp_path: Path) -> None:
    table = load(_saved(tmp_path / "a", np.full((*SHAPE, 3), 1 / np.pi)))
    wi = np.array([[0, 0, 1], [0.6, 0, 0.8], [0.96, 0, 0.28]])
    np.testing.assert_allclose(table.albedo(wi), 1, rtol=5e-3)
    cap = 2 * np.pi * (1 - np.cos(np.radians(84)))  # solid angle of the directions that are not grazing
    assert table.samples().weight.sum() == pytest.approx(cap**2, rel=0.02)


def test_holes_in_any_channel_are_counted_and_filled(loaded: Loaded) -> None:
    f = np.full((*SHAPE, 3), 0.5)
    f[3, 4, 5, 1] = np.nan
    raw = bytearray(merl_bytes(f))
    raw[12 + 8 * 7 : 12 + 8 * 8] = np.array([np.nan]).tobytes()
    table = loaded(raw)
    left_out = table.samples().left_out
    assert (left_out.shadowed, left_out.not_finite) == (1, 1)
    wi, wo = directions_of(*(a[3, 4, 5] for a in _centres()))
    np.testing.assert_allclose(table.eval(wi, wo), 0.5, rtol=1e-5)


def test_broken_files(loaded: Loaded) -> None:
    good = merl_bytes(np.full((90, 90, 180, 3), 0.1))
    for content, expected in (
        (good[:-8], "size does not match"),
        (good[:5000], "size does not match"),
        (np.array([90, 90, 180], ">i4").tobytes() + bytes(100), "big-endian"),
        (merl_bytes(np.full((4, 4, 4, 3), np.nan)), "no measured value"),
        (np.array([4, 4, 4], "<i4").tobytes() + np.full(192, np.nan).tobytes(), "no measured value"),
    ):
        with pytest.raises(UserError, match=expected):
            loaded(content)
