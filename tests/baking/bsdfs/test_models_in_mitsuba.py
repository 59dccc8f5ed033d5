"""Models that Mitsuba has too say what Mitsuba says."""

from __future__ import annotations

import numpy as np

from lambent.core.geometry.directions import direction
from lambent.materials.fresnel import conductor
from lambent.materials.models import model_named
from tests.tools.in_mitsuba import f_cos


def f_of(plugin, wi, wo):
    """f (N, 3) without the cosine."""
    return f_cos(plugin, wi, wo) / wi[:, 2:]


def directions(lowest_cosine, n=5000):
    rng = np.random.default_rng(0)
    return direction(np.arccos(rng.uniform(lowest_cosine, 1, (2, n))), rng.uniform(0, 2 * np.pi, (2, n)))


def rough(distribution, **more):
    return {"type": "roughconductor", "distribution": distribution, "eta": 0.2, "k": 3.9} | more


def test_fresnel_of_a_metal(mi):
    cosine = np.linspace(0.01, 1, 500, dtype=np.float32)
    for n, k in ((0.2, 3.9), (3.1, 3.3), (1.5, 0.0)):
        theirs = np.array(mi.fresnel_conductor(mi.Float(cosine), mi.Complex2f(n, k)))
        np.testing.assert_allclose(conductor(cosine.astype(float), n, k), theirs, rtol=1e-4, atol=1e-6)


def test_cook_torrance_where_nothing_is_shadowed(mi):
    """Mitsuba has Smith's masking; up to 35 degrees from the normal both are 1."""
    rng = np.random.default_rng(1)
    model = model_named("cook-torrance")(m=0.1, n=0.2, k=3.9)
    wo = direction(np.radians(rng.uniform(0, 35, 5000)), rng.uniform(0, 2 * np.pi, 5000))
    wi = model.sample(wo, rng.random((5000, 3)))
    near = wi[:, 2] > 0.8
    ours = model.eval(wi, wo)[near]
    np.testing.assert_allclose(ours, f_of(rough("beckmann", alpha=0.1), wi, wo)[near], rtol=3e-3, atol=1e-4)


def test_ggx_at_normal_viewing(mi):
    """Height-correlated masking and Mitsuba's separable one agree where one direction is the normal; F is 1."""
    wi, _ = directions(0.3)
    wo = np.broadcast_to(direction(0.0, 0.0), wi.shape)
    plugin = {"type": "roughconductor", "distribution": "ggx", "alpha_u": 0.2, "alpha_v": 0.4, "material": "none"}
    ours = model_named("ggx")(f0=1, alpha_x=0.2, alpha_y=0.4).eval(wi, wo)
    np.testing.assert_allclose(ours, f_of(plugin, wi, wo), rtol=2e-3, atol=1e-5)


def test_lambert(mi):
    wi, wo = directions(0.05)
    ours = model_named("lambert")(kd=(0.2, 0.4, 0.6)).eval(wi, wo)
    plugin = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.2, 0.4, 0.6]}}
    np.testing.assert_allclose(ours, f_of(plugin, wi, wo), rtol=1e-4)
