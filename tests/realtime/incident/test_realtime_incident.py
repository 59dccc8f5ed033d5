"""Look-ups of incident light: found by name, the same in numpy, and a new one is one file and its shader."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from lambent.baked.probes import lookups as probe_lookups
from lambent.core.errors import UserError
from lambent.core.geometry.directions import normalize
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.incident import look_up_of, look_ups, shader_of
from lambent.realtime.light.baked import Probe
from tests.tools.shader_parity import assert_parity, run_wgsl

ROOM = np.array([2.0, 1.5, 2.5])  # half sizes
PLANES = np.array([[*-sign * axis, axis @ ROOM] for axis in np.eye(3) for sign in (1, -1)], np.float32)
OF_PROBES = ["plain", "planes", "distance"]
DISTANCE = np.ones((6, 4, 4), np.float32)
CUBE = np.ones((6, 4, 4, 3), np.float32)


def test_the_preferred_look_up_that_serves_a_probe() -> None:
    bare = Probe((0.0, 0.0, 0.0), CUBE)
    rich = replace(bare, distance=DISTANCE, planes=PLANES)
    known = look_ups()
    assert list(known)[:3] == OF_PROBES

    def chosen(probe: Probe, wanted: str) -> str:
        return look_up_of(probe, wanted, known).NAME

    assert [chosen(bare, name) for name in ("auto", *known)] == ["plain"] * (1 + len(known))
    assert [chosen(rich, name) for name in ("auto", *OF_PROBES)] == ["planes", "plain", "planes", "distance"]
    assert chosen(replace(bare, distance=DISTANCE), "planes") == "distance"
    assert chosen(replace(bare, planes=PLANES[:1]), "auto") == "planes"
    with pytest.raises(UserError, match="look-up"):
        look_up_of(bare, "plane", known)


def places(count: int = 4000) -> tuple[np.ndarray, np.ndarray]:
    """Points in the room, about its centre, and unit directions."""
    rng = np.random.default_rng(2)
    return rng.uniform(-0.95, 0.95, (count, 3)) * ROOM, normalize(rng.normal(size=(count, 3)))


def looked_up(name: str, monkeypatch: pytest.MonkeyPatch, x: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Unit directions that numpy's version of a look-up finds for rays about a probe at the origin."""
    monkeypatch.setattr(probe_lookups, "sample", lambda _, w: inverse_depth(w))
    if name == "planes":
        return normalize(probe_lookups.planes_lookup(x, w, PLANES.astype(float)))
    return normalize(probe_lookups.distance_lookup(x, w, probe_lookups.inverse_depth(DISTANCE)))


def inverse_depth(w: np.ndarray) -> np.ndarray:
    """(n, 1): 1/max(|x|, |y|, |z|) of the room's wall that its centre sees in directions w (n, 3)."""
    return ((np.abs(w) / ROOM).max(axis=-1) / np.abs(w).max(axis=-1))[:, None]


def in_shader(name: str, call: str, x: np.ndarray, w: np.ndarray, components: int = 1) -> np.ndarray:
    """A call of the shader, with the planes and the depth of the room in the place of its bindings."""
    source = assemble("incident.wgsl", "look_up.wgsl", given={"look_up.wgsl": shader_of(look_ups()[name])})
    for old, new in (
        ("override PLANES: u32 = 0u;", f"const PLANES = {len(PLANES)}u;"),
        ("@group(2) @binding(3) var<storage, read> planes: array<vec4f>;", ""),
        ("@group(2) @binding(3) var inverse_depth_cube: texture_cube<f32>;", ""),
        (
            "textureSampleLevel(inverse_depth_cube, linear_sampler, w, 0.0).r",
            "max_norm(w / vec3f({}, {}, {})) / max_norm(w)".format(*ROOM),
        ),
    ):
        source = source.replace(old, new)
    tables = {"planes": PLANES} if name == "planes" else {}
    return run_wgsl(source, call, {"x": x, "w": w}, components=components, tables=tables)


def walls_m(x: np.ndarray, w: np.ndarray) -> np.ndarray:
    """(n,) distances to the walls of the room."""
    with np.errstate(divide="ignore"):
        return np.asarray(((np.sign(w) * ROOM - x) / w).min(axis=-1))


@pytest.mark.parametrize("name", ["planes", "distance"])
def test_shaders_look_up_as_the_bake_does(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bake chooses between look-ups by numpy's versions of them."""
    x, w = places()
    got = in_shader(name, "normalize(incident_look_up(x, w).direction)", x, w, 3)
    expected = looked_up(name, monkeypatch, x, w)
    assert_parity(got, expected.astype(np.float32), atol=2e-4)
    error = np.linalg.norm(got - normalize(x + walls_m(x, w)[:, None] * w), axis=-1)
    assert np.quantile(error, 1 if name == "planes" else 0.5) < 2e-3, "steps of the march may skip an edge of the room"


def test_planes_bound_a_ray_and_a_plain_probe_knows_no_wall() -> None:
    x, w = places()
    np.testing.assert_allclose(in_shader("planes", "incident_bound(x, w)", x, w), 1 / walls_m(x, w), rtol=1e-3)
    assert not in_shader("plain", "incident_bound(x, w)", x, w).any()


def test_constants_of_look_ups_stand_in_both() -> None:
    march, planes = (shader_of(look_ups()[name]) for name in ("distance", "planes"))
    assert f"const STEPS = {probe_lookups.STEPS}u;" in march
    bounds = re.findall(r"-1e-9\), ([\d.]+), ([\d.]+)\)", march)
    assert [tuple(map(float, pair)) for pair in bounds] == [*dict.fromkeys(probe_lookups.SECANTS)]
    assert f"i < {len(probe_lookups.SECANTS) - 1}u" in march
    assert f"PLANE_ACTIVE_M = {probe_lookups.PLANE_ACTIVE_M:.0e};".replace("e-0", "e-") in planes
