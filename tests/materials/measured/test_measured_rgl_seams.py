"""RGL files where an azimuth wraps round: what is looked up there is known by hand and has no step."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.directions import direction, half_vector
from lambent.materials.measured import load
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
