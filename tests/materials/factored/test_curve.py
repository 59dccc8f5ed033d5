"""Curves: exact band means, values at angles."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.materials.factored.curve import END_RAD, KNOTS, Curve, angles_rad


def test_band_means_are_integrals() -> None:
    bands = 128
    edges = np.linspace(0, END_RAD, bands + 1)
    means = Curve.of(np.cos).band_means(bands)
    exact = (np.sin(edges[1:]) - np.sin(edges[:-1])) / (edges[1] - edges[0])
    assert np.allclose(means, exact[:, None], rtol=1e-6)


def test_channels_and_constant_ends() -> None:
    curve = Curve.through(np.array([0.2, 0.4]), np.array([[1, 2, 3], [3, 2, 1.0]]))
    assert np.allclose(curve.at(np.array([0.0, 0.3, 1.0])), [[1, 2, 3], [2, 2, 2], [3, 2, 1]], atol=1e-3)
    assert np.array_equal(curve.at(np.array([1.6])), [[0, 0, 0]])


def test_values_are_checked_and_read_only() -> None:
    with pytest.raises(ValueError, match="finite RGB"):
        Curve(np.zeros((7, 3)))
    with pytest.raises(ValueError, match="finite RGB"):
        Curve.constant(np.nan)
    with pytest.raises(ValueError, match="do not divide"):
        Curve.constant().band_means(100)
    with pytest.raises(ValueError, match="read-only"):
        Curve.constant().values[0] = 2
    assert len(angles_rad()) == KNOTS + 1


@pytest.mark.parametrize(("nodes", "polar"), [(16, 2), (128, 1)])
@pytest.mark.parametrize("width", [0.003, 0.02, 0.05, 0.1, 0.4])
def test_peaks_about_an_axis_keep_their_light(nodes: int, polar: int, width: float) -> None:
    """To 3 %, however narrow; with means over bands, the narrowest is 31 times as bright."""
    curve = Curve.of(lambda x: np.exp(-((np.tan(np.minimum(x, 1.5)) / width) ** 2)))
    at = (np.arange(nodes) + 0.5) * END_RAD / nodes
    rings = np.sin(polar * angles_rad())
    light, expected = (rings @ c.values for c in (Curve.through(at, curve.node_values(nodes, polar)), curve))
    assert np.allclose(light, expected, rtol=0.03)
    assert (curve.node_values(nodes, polar) >= 0).all()
    level = Curve.constant(0.7)
    assert np.allclose(level.node_values(nodes, polar), 0.7) and np.allclose(level.band_means(nodes, polar), 0.7)


def test_node_values_keep_the_sum_and_never_overshoot() -> None:
    """Of steps and of peaks narrower than a band, too, wherever these are."""
    rng = np.random.default_rng(0)
    for curve in (
        Curve.of(lambda x: (x > 0.7).astype(float)),
        Curve.of(lambda x: np.exp(-(((x - 0.5) / 0.004) ** 2))),
        Curve(rng.random((KNOTS + 1, 3))),
    ):
        for nodes in (1, 2, 16, 128, KNOTS):
            values = curve.node_values(nodes)
            assert np.allclose(values.sum(axis=0), curve.band_means(nodes).sum(axis=0))
            assert (values >= curve.values.min(axis=0) - 1e-12).all()
            assert (values <= curve.values.max(axis=0) + 1e-12).all()
