"""Every model that discovery finds, by one harness. A declared deficiency is a strict xfail."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.checking import check
from lambent.materials.models import model_named, models
from lambent.materials.models.model import PROPERTIES, Model
from tests.tools.furnace import assert_lossless, assert_passive
from tests.tools.in_mitsuba import interaction
from tests.tools.reciprocity import assert_reciprocal

MODELS = models()


@pytest.fixture(autouse=True)
def few_directions(monkeypatch):
    """Of the furnace: above all near grazing, where models fail; every model is mirror symmetric in phi."""
    monkeypatch.setattr(check, "THETA_DEG", (0, 30, 60, 75, 84, 87, 89))
    monkeypatch.setattr(check, "PHI_DEG", (0.0, 45.0, 90.0))


def corners(kind: type[Model]) -> list[Model]:
    """The model at its defaults, at both ends of every parameter, and with all parameters high."""
    found = [kind(), kind(**{p.name: p.high for p in kind.parameters})]
    for parameter in kind.parameters:
        found += [kind(**{parameter.name: end}) for end in (parameter.low, parameter.high)]
    return found


def assert_sampled(model: Model) -> None:
    for theta_deg in (50.0, 85.0):
        one = check.check_sampler(model, theta_deg, 30.0, samples=1_000_000)
        assert one.p_value > 1e-4, one
        assert abs(one.pdf_integral + one.rejected_share - 1) < check.INTEGRAL_LIMIT, one
        tolerance = 5 * one.albedo_error + check.INTEGRAL_LIMIT * one.albedo_quadrature
        assert abs(one.albedo_sampled - one.albedo_quadrature) < tolerance, one


HARNESS = {
    "reciprocal": lambda kind: [assert_reciprocal(model) for model in corners(kind)],
    "sampled": lambda kind: assert_sampled(kind()),
    "passive": lambda kind: [assert_passive(model) for model in corners(kind)],
    "lossless": lambda kind: assert_lossless(kind(**kind.white)),
}


def cases():
    for name, kind in MODELS.items():
        for prop in PROPERTIES:
            why = kind.known_deficiencies.get(prop)
            marks = [pytest.mark.xfail(strict=True, raises=AssertionError, reason=why)] if why else []
            marks += [pytest.mark.slow] if prop == "sampled" else []
            yield pytest.param(kind, prop, id=f"{name}-{prop}", marks=marks)


@pytest.mark.parametrize(("kind", "prop"), list(cases()))
def test_property(kind, prop):
    HARNESS[prop](kind)


@pytest.mark.parametrize("kind", MODELS.values(), ids=MODELS)
def test_corners_are_finite_and_not_negative(kind):
    rng = np.random.default_rng(0)
    z, phi = rng.uniform(-1, 1, (2, 2000)), rng.uniform(0, 2 * np.pi, (2, 2000))
    wi, wo = direction(np.arccos(z), phi)
    wo[:10] = [0, 0, 1]
    for model in corners(kind):
        sampled = model.sample(wo, rng.random((2000, 3)))
        for w in (wi, sampled):
            value, density = model.eval(w, wo), model.pdf(w, wo)
            assert value.shape == (2000, 3) and density.shape == (2000,) and sampled.shape == (2000, 3)
            assert np.isfinite(value).all() and np.isfinite(density).all() and np.isfinite(sampled).all()
            assert value.min() >= 0 and density.min() >= 0


@pytest.mark.parametrize("kind", MODELS.values(), ids=MODELS)
def test_metadata(kind):
    assert kind.title and kind.source and kind.parameters
    for p in kind.parameters:
        assert p.meaning and p.low <= p.default <= p.high
        assert p.scale == "linear" or p.low > 0
        with pytest.raises(UserError, match=p.name):
            kind(**{p.name: p.high + 1})
        with pytest.raises(UserError, match=p.name):
            kind(**{p.name: float("nan")})
    first = kind.parameters[0].name
    with pytest.raises(UserError, match="did you mean"):
        kind(**{first + "x": 0.1})


def test_ggx_density_is_mitsubas(mi):
    """Mitsuba's rough conductor samples the same visible normals."""
    plugin = mi.load_dict({"type": "roughconductor", "distribution": "ggx", "alpha_u": 0.1, "alpha_v": 0.4})
    rng = np.random.default_rng(0)
    z, phi = rng.uniform(0.05, 1, (2, 5000)), rng.uniform(0, 2 * np.pi, (2, 5000))
    wi, wo = direction(np.arccos(z), phi).astype(np.float32)
    theirs = np.array(plugin.pdf(mi.BSDFContext(), interaction(wo), mi.Vector3f(wi.T)))
    ours = MODELS["ggx"](alpha_x=0.1, alpha_y=0.4).pdf(wi.astype(float), wo.astype(float))
    np.testing.assert_allclose(theirs, ours, rtol=1e-3, atol=1e-6)


def test_an_unknown_model_names_the_nearest():
    with pytest.raises(UserError, match="did you mean 'lambert'"):
        model_named("lambret")
