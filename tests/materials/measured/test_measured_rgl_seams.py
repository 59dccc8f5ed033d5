"""RGL files where an azimuth wraps round: what is looked up there is known by hand and has no step."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.geometry.directions import direction, half_vector
from lambent.materials.measured import load
from lambent.materials.measured.parts.azimuths import Azimuths
from tests.materials.measured.measured_files import tensor_bytes

OF_PHI_I = {  # nodes of phi_i, and the factor at each; the ends of a period are one direction
    "isotropic": (np.zeros(1), np.ones(1)),
    "half": (np.linspace(-np.pi, 0, 4), np.array([1.0, 0.4, 0.7, 1.0])),
    "whole": (np.linspace(-np.pi, np.pi, 6), np.array([1.0, 0.4, 0.7, 0.2, 0.5, 1.0])),
}
OF_PHI_M = np.array([0.9, 0.3, 0.6, 0.8, 0.9, 0.3, 0.6, 0.8, 0.9])  # at phi_m = -pi to pi; half a turn changes nothing


def file_bytes(phi_i: np.ndarray, factors: np.ndarray) -> bytes:
    """An even warp, D = sigma = 1: f cos_o is a quarter of the factor at phi_i times that at phi_m."""
    theta_i = np.array([0.0, 0.8, 1.5], np.float32)
    incident = (len(phi_i), len(theta_i))
    rgb = factors[:, None, None, None, None] * OF_PHI_M[:, None] * np.ones((*incident, 3, 9, 9))
    ones = {"ndf": (2, 2), "sigma": (2, 2), "vndf": (*incident, 2, 2), "luminance": (*incident, 9, 9)}
    return tensor_bytes(
        {
            "description": np.frombuffer(b"seams", dtype=np.uint8),
            "phi_i": phi_i.astype(np.float32),
            "theta_i": theta_i,
            "rgb": rgb.astype(np.float32),
            "jacobian": np.array([1], dtype=np.uint8),
            **{name: np.ones(shape, np.float32) for name, shape in ones.items()},
        }
    )


def mirrored_at(m: np.ndarray, wi: np.ndarray) -> np.ndarray:
    return 2 * (wi * m).sum(axis=1, keepdims=True) * m - wi


@pytest.mark.parametrize("kind", OF_PHI_I)
def test_round_a_whole_turn(tmp_path: Path, kind: str) -> None:
    """Light and half vector turn round independently, through every seam; every value is interpolated by hand."""
    nodes, factors = OF_PHI_I[kind]
    path = tmp_path / "a.bsdf"
    path.write_bytes(file_bytes(nodes, factors))
    phi_i, phi_m = (grid.ravel() for grid in np.meshgrid(np.linspace(-3.5, 3.5, 141), np.linspace(-3.3, 3.3, 67)))
    wi = direction(np.full(len(phi_i), 0.3), phi_i)
    wo = mirrored_at(direction(np.full(len(phi_m), 0.2), phi_m), wi)
    turn = {"isotropic": 2 * np.pi, "half": np.pi, "whole": 2 * np.pi}[kind]
    turned = phi_i if kind == "isotropic" else 0.0
    at_i = np.interp((phi_i + np.pi) % turn - np.pi, nodes, factors)
    at_m = np.interp((phi_m - turned + np.pi) % (2 * np.pi), np.linspace(0, 2 * np.pi, 9), OF_PHI_M)
    found = load(path).eval(wi, wo) * wo[:, 2:] * 4
    np.testing.assert_allclose(found, np.repeat((at_i * at_m)[:, None], 3, axis=1), atol=2e-5)


@pytest.mark.parametrize("kind", ["half", "whole"])
@pytest.mark.parametrize("seam", [np.pi, 0.0, -np.pi])
def test_no_step_where_phi_i_wraps_round(tmp_path: Path, kind: str, seam: float) -> None:
    path = tmp_path / "a.bsdf"
    path.write_bytes(file_bytes(*OF_PHI_I[kind]))
    phi_i = seam + np.array([-1e-4, 1e-4])
    wi, m = direction(np.full(2, 0.5), phi_i), direction(np.full(2, 0.2), np.full(2, 1.1))
    wo = mirrored_at(m, wi)
    np.testing.assert_allclose(half_vector(wi, wo), m, atol=1e-12)
    one, other = load(path).eval(wi, wo) * wo[:, 2:]
    np.testing.assert_allclose(one, other, rtol=1e-3)


OPEN = {  # nodes without the closing one; factors at them and at their images
    "whole": (np.radians(np.arange(-180, 180, 45.0)), 2 * np.pi),
    "whole from 0": (np.radians(np.arange(0, 360, 30.0)), 2 * np.pi),
    "half": (np.radians(np.arange(-180, 0, 30.0)), np.pi),
    "half from 0": (np.radians(np.arange(0, 180, 22.5)), np.pi),
    "half, uneven": (np.radians([-180.0, -150.0, -130.0, -100.0, -60.0, -30.0]), np.pi),
}


@pytest.mark.parametrize("kind", OPEN)
def test_the_closing_node_may_be_left_out(tmp_path: Path, kind: str) -> None:
    """f goes from the last node to the image of the first in a straight line, as with the node it does."""
    nodes, period = OPEN[kind]
    factors = np.linspace(0.2, 1.0, len(nodes))
    path = tmp_path / "a.bsdf"
    path.write_bytes(file_bytes(nodes, factors))
    phi_i = np.linspace(-3.5, 6.5, 401)
    wi, m = direction(np.full(401, 0.5), phi_i), direction(np.full(401, 0.2), np.full(401, 1.1))
    wo = mirrored_at(m, wi)
    closed = np.append(nodes, nodes[0] + period), np.append(factors, factors[0])
    at_i = np.interp((phi_i - nodes[0]) % period + nodes[0], *closed)
    at_m = np.interp(1.1 + np.pi, np.linspace(0, 2 * np.pi, 9), OF_PHI_M)
    found = load(path).eval(wi, wo)[:, 0] * wo[:, 2] * 4
    np.testing.assert_allclose(found, at_i * at_m, atol=1e-4)


@pytest.mark.parametrize("begin", [-180, -90, 0, 90, 270])
def test_a_quarter_is_mirrored_with_and_without_its_ends(begin: float) -> None:
    """A function of |cos| is mirrored in x and y; between a node and its image it is that of the node."""
    wi = direction(np.full(721, 0.7), np.linspace(-np.pi, np.pi, 721))
    for nodes_deg in ([0, 30, 60, 90], [0, 30, 60], [15, 45, 75]):
        nodes = np.radians(begin + np.array(nodes_deg, float))
        azimuths = Azimuths.of(nodes)
        assert azimuths.parts == 4
        folded, _, phi = azimuths.folded(wi, wi)
        np.testing.assert_allclose(direction(np.full(721, 0.7), phi), folded, atol=1e-12)
        np.testing.assert_allclose(np.abs(folded), np.abs(wi))
        value, (flip, there, share) = np.interp(phi, nodes, np.cos(nodes) ** 2), azimuths.beyond(phi)
        np.testing.assert_allclose(
            direction(np.full(721, 0.7), there)[share > 0], (folded * flip)[share > 0], atol=1e-12
        )
        found = value + share * (np.interp(there, nodes, np.cos(nodes) ** 2) - value)
        assert share.max() <= 0.5 + 1e-9 and np.abs(np.diff(found)).max() < 0.02, "no step"
