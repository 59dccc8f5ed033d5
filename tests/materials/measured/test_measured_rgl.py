"""RGL: evaluation equals Mitsuba's `measured` plugin, samples agree with it, and azimuths wrap round without a step."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from lambent.core.geometry.directions import direction
from lambent.materials.measured import load
from lambent.materials.measured.rgl import Azimuths, Corners, Warp
from tests.materials.measured.measured_files import Loaded, rgl_fields, tensor_bytes
from tests.tools.in_mitsuba import f_cos

REAL = ("paper_white_rgb", "satin_rosaline_rgb", "cc_ibiza_sunset_rgb")


def _assert_equal_to_plugin(path: Path, wi: np.ndarray, wo: np.ndarray) -> None:
    """f cos within single precision: the plugin works in float32, and its warp divides small differences."""
    mine = load(path).eval(wi, wo) * wo[:, 2:]
    plugin = np.maximum(f_cos({"type": "measured", "filename": str(path)}, wo, wi), 0)
    error = np.abs(mine - plugin) / (np.abs(plugin) + 1e-3)
    assert error.max() < 2e-3 and np.quantile(error, 0.99) < 1e-4 and error.mean() < 1e-5


@pytest.mark.parametrize("name", REAL)
def test_real_files_equal_the_plugin(shared_data: Path, mi: object, hemisphere, name: str) -> None:
    wi, wo = hemisphere(20000, 1, 88), hemisphere(20000, 2, 88)
    near = wi[::2] * (-1, -1, 1) + np.random.default_rng(0).normal(0, 0.05, (10000, 3))
    wo[::2] = near / np.linalg.norm(near, axis=1, keepdims=True)
    wo[:, 2] = np.abs(wo[:, 2]).clip(1e-3)
    _assert_equal_to_plugin(shared_data / "measured" / "rgl" / f"{name}.bsdf", wi, wo)


@pytest.mark.parametrize(
    "phi_i",
    [np.zeros(1), np.linspace(-np.pi, -np.pi / 2, 4), np.linspace(-np.pi, 0, 4), np.linspace(-np.pi, np.pi, 6)],
    ids=["isotropic", "quarter", "half", "whole"],
)
def test_made_up_files_equal_the_plugin(tmp_path: Path, mi: object, hemisphere, phi_i: np.ndarray) -> None:
    path = tmp_path / "a.bsdf"
    path.write_bytes(tensor_bytes(rgl_fields(phi_i)))
    assert load(path).info.isotropic == (len(phi_i) == 1)
    # The plugin's float32 phi is ambiguous at the seam of a turn: directions there are left out.
    wi, wo = hemisphere(20000, 3), hemisphere(20000, 4)
    m = wi + wo
    seam = np.pi - np.abs(np.arctan2(m[:, 1], m[:, 0]) - (np.arctan2(wi[:, 1], wi[:, 0]) if len(phi_i) == 1 else 0))
    keep = np.abs(seam) > 1e-3
    _assert_equal_to_plugin(path, wi[keep], wo[keep])


@pytest.mark.parametrize("name", REAL)
def test_samples_are_the_nodes(shared_data: Path, name: str) -> None:
    table = load(shared_data / "measured" / "rgl" / f"{name}.bsdf")
    samples = table.samples()
    np.testing.assert_allclose(table.eval(samples.wi, samples.wo), np.maximum(samples.f, 0), rtol=1e-4, atol=1e-6)
    assert samples.below_zero == (456 if name.startswith("cc_") else 0)
    assert (table.info.notes != ()) == name.startswith("cc_")


def test_without_jacobian_and_spectral(tmp_path: Path, hemisphere) -> None:
    fields = rgl_fields(np.zeros(1))
    fields["jacobian"] = np.array([0], dtype=np.uint8)
    fields["rgb"] = np.full_like(fields["rgb"], 0.5)
    path = tmp_path / "a"
    path.write_bytes(tensor_bytes(fields))
    wi, wo = hemisphere(100, 5), hemisphere(100, 6)
    np.testing.assert_allclose(load(path).eval(wi, wo) * wo[:, 2:], 0.5, rtol=1e-6)
    grey = load(path).eval(wi, wo)
    fields["spectra"] = np.repeat(fields.pop("rgb")[:, :, :1], 7, axis=2)
    fields["wavelengths"] = np.linspace(400, 700, 7, dtype=np.float32)
    path.write_bytes(tensor_bytes(fields))
    np.testing.assert_allclose(load(path).eval(wi, wo), grey, rtol=1e-5)


@settings(max_examples=30)
@given(st.integers(0, 10**6), st.floats(0, 1), st.floats(0, 1))
def test_warp_inverts_itself(seed: int, u: float, v: float) -> None:
    random = np.random.default_rng(seed)
    warp = Warp(random.uniform(0.05, 1, (6, 4, 5)))
    nodes = (np.array([0.0, 1.0]), np.array([0.0, 0.5, 1.0]))
    uv = random.uniform(0.001, 0.999, (50, 2))
    corners = Corners(nodes, (np.full(50, u), np.full(50, v)))
    point, density = warp.sample(corners, uv)
    back, again = warp.invert(corners, point)
    np.testing.assert_allclose(back, uv, atol=1e-9)
    np.testing.assert_allclose(again, density, rtol=1e-6)


def _flat(phi_i: np.ndarray, ndf: float = 1.0, nodes: int = 9) -> dict[str, np.ndarray]:
    """Tensors of an even warp, u_m = u whatever the density that is stored, sigma 1 and values 1."""
    theta_i = np.array([0.0, 0.4, 0.8], np.float32)
    square = (len(phi_i), len(theta_i), nodes, nodes)
    shapes = {"ndf": (2, 2), "sigma": (2, 2), "vndf": (*square[:2], 2, 2), "luminance": square}
    shapes |= {"rgb": (*square[:2], 3, nodes, nodes)}
    fields = {"phi_i": phi_i.astype(np.float32), "theta_i": theta_i, "jacobian": np.array([1], np.uint8)}
    fields |= {name: np.ones(shape, np.float32) for name, shape in shapes.items()}
    return fields | {"description": np.frombuffer(b"flat", np.uint8), "ndf": np.full((2, 2), ndf, np.float32)}


@pytest.mark.parametrize("phi_i", [np.zeros(1), np.linspace(-np.pi, np.pi, 5)], ids=["isotropic", "whole"])
@pytest.mark.parametrize("ndf", [1.0, 0.5])
def test_nodes_and_weights_of_an_even_warp(loaded: Loaded, phi_i: np.ndarray, ndf: float) -> None:
    """By hand: u = (column, row)/8 is theta_m = u0^2 pi/2 and phi_m = (2 u1 - 1) pi; f cos_o = ndf/4.

    The weight is the node's share of the square, 1/64, half of it at each border, times d_wo/du: sin(theta_m)
    d(theta_m)/du0 d(phi_m)/du1 is 2 pi^2 u0 sin(theta_m), and a turn of the half vector turns wo by 4 (wi.m) more.
    """
    samples = loaded(tensor_bytes(_flat(phi_i, ndf))).samples()
    expected = []
    for phi in phi_i:
        for theta in (0.0, 0.4, 0.8):
            wi = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
            for row, column in np.ndindex(9, 9):
                tilt = (column / 8) ** 2 * np.pi / 2
                turn = (row / 4 - 1) * np.pi + (phi if len(phi_i) == 1 else 0)
                m = np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
                wo = 2 * (wi @ m) * m - wi
                share = (0.5 if row in (0, 8) else 1) * (0.5 if column in (0, 8) else 1) / 64
                weight = share * 2 * np.pi**2 * column / 8 * np.sin(tilt) * 4 * (wi @ m)
                if wo[2] > 0.2 and weight > 1e-9:
                    expected.append([*wi, *wo, ndf / 4 / wo[2], weight])
    found = np.column_stack([samples.wi, samples.wo, samples.f[:, :1], samples.weight])
    found = found[(found[:, 5] > 0.2) & (found[:, 7] > 1e-9)]
    assert len(found) == len(expected) > 100
    off = [cKDTree(some).query(others)[0].max() for some, others in ((found, expected), (expected, found))]
    assert max(off) < 1e-4, "all columns at once, whatever the order"


def test_weights_fill_the_hemisphere_whatever_the_warp(loaded: Loaded) -> None:
    """Projected solid angles from the normal add up to pi sin^2(84 degrees), also where the nodes crowd together."""
    fields = _flat(np.zeros(1), nodes=129)
    fields["vndf"] = np.broadcast_to(np.array([[1.5, 0.3], [0.5, 1.0]], np.float32), (1, 3, 2, 2)).copy()
    samples = loaded(tensor_bytes(fields)).samples()
    normal = samples.wi[:, 2] > 0.999
    total = (samples.wo[normal, 2] * samples.weight[normal]).sum()
    assert total == pytest.approx(np.pi * np.sin(np.radians(84)) ** 2, rel=0.02)


OF_PHI_M = np.array([0.9, 0.3, 0.6, 0.8, 0.9, 0.3, 0.6, 0.8, 0.9])  # at phi_m = -pi to pi; half a turn changes nothing


def file_bytes(phi_i: np.ndarray, factors: np.ndarray) -> bytes:
    """An even warp, D = sigma = 1: f cos_o is a quarter of the factor at phi_i times that at phi_m."""
    fields = _flat(phi_i)
    rgb = fields["rgb"] * factors[:, None, None, None, None] * OF_PHI_M[:, None]
    return tensor_bytes(fields | {"rgb": rgb.astype(np.float32)})


def mirrored_at(m: np.ndarray, wi: np.ndarray) -> np.ndarray:
    return 2 * (wi * m).sum(axis=1, keepdims=True) * m - wi


TURNS = {  # nodes of phi_i, and the period of f over it
    "isotropic": (np.zeros(1), 2 * np.pi),
    "whole, closed": (np.linspace(-np.pi, np.pi, 6), 2 * np.pi),
    "whole": (np.radians(np.arange(-180, 180, 45.0)), 2 * np.pi),
    "whole from 0": (np.radians(np.arange(0, 360, 30.0)), 2 * np.pi),
    "half, closed": (np.linspace(-np.pi, 0, 4), np.pi),
    "half": (np.radians(np.arange(-180, 0, 30.0)), np.pi),
    "half from 0": (np.radians(np.arange(0, 180, 22.5)), np.pi),
    "half, uneven": (np.radians([-180.0, -150.0, -130.0, -100.0, -60.0, -30.0]), np.pi),
}


@pytest.mark.parametrize("kind", TURNS)
def test_round_a_whole_turn(tmp_path: Path, kind: str) -> None:
    """Light and half vector turn round through every seam, with and without the closing node."""
    nodes, period = TURNS[kind]
    factors = np.linspace(0.2, 1.0, len(nodes))
    factors[-1] = factors[0] if "closed" in kind else factors[-1]
    path = tmp_path / "a.bsdf"
    path.write_bytes(file_bytes(nodes, factors))
    phi_i, phi_m = (grid.ravel() for grid in np.meshgrid(np.linspace(-3.5, 6.5, 201), np.linspace(-3.3, 3.3, 67)))
    wi = direction(np.full(len(phi_i), 0.3), phi_i)
    wo = mirrored_at(direction(np.full(len(phi_m), 0.2), phi_m), wi)
    closed = np.append(nodes, nodes[0] + period), np.append(factors, factors[0])
    at_i = np.interp((phi_i - nodes[0]) % period + nodes[0], *closed)
    turned = phi_i if kind == "isotropic" else 0.0
    at_m = np.interp((phi_m - turned + np.pi) % (2 * np.pi), np.linspace(0, 2 * np.pi, 9), OF_PHI_M)
    found = load(path).eval(wi, wo) * wo[:, 2:] * 4
    np.testing.assert_allclose(found, np.repeat((at_i * at_m)[:, None], 3, axis=1), atol=1e-4)


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


@pytest.mark.parametrize(
    ("nodes_deg", "parts"), [((0, 30, 60, 90), 4), ((0, 30, 60, 95), 2), ((0, 60, 120, 180), 2), ((0, 62, 124, 186), 1)]
)
def test_nodes_reach_no_further_than_their_part_of_the_circle(nodes_deg: tuple[int, ...], parts: int) -> None:
    assert Azimuths.of(np.radians(np.array(nodes_deg, float))).parts == parts
