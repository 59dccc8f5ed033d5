"""Models as terms and curves (Ben-Artzi 2007, chapter 3): changing a parameter makes new curves.

To add a model, register its function: `@editable.register`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import singledispatch

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.plain import triple
from lambent.materials.factored import quotients as q
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_lobes import beckmann, ggx, lobe_terms
from lambent.materials.factored.terms import Editable, Factor, Term
from lambent.materials.fresnel import conductor, schlick
from lambent.materials.models.ashikhmin_shirley import AshikhminShirley
from lambent.materials.models.blinn_phong import BlinnPhong
from lambent.materials.models.cook_torrance import CookTorrance
from lambent.materials.models.ggx import Ggx
from lambent.materials.models.kurt import Kurt
from lambent.materials.models.lambert import Lambert
from lambent.materials.models.model import Model
from lambent.materials.models.oren_nayar import OrenNayar
from lambent.materials.models.phong import Phong
from lambent.materials.models.schlick import Schlick
from lambent.materials.models.ward import Ward, WardOriginal

HIGHLIGHT, FRESNEL = Factor("highlight", "theta_h"), Factor("fresnel", "theta_d")
DIFFUSE = Factor("diffuse", "theta_i")


@singledispatch
def editable(model: Model) -> Editable:
    """The terms and curves of a model with its current parameters.

    Raises
    ------
    UserError
        If no decomposition of the model is known.
    """
    raise UserError("model has no curves to edit", field=model.name, hint="fit it with lobes first")


def same_quotients(one: Editable, other: Editable) -> bool:
    """Whether `other` differs from `one` in curves and scales only, so that one transport serves both."""
    return [(t.quotient, t.factors, t.side) for t in one.terms] == [
        (t.quotient, t.factors, t.side) for t in other.terms
    ]


@editable.register
def _(model: Lambert) -> Editable:
    term = Term("diffuse", q.One(), triple(model.rgb("kd") / np.pi), (DIFFUSE,))
    return Editable(model.title, (term,), {"diffuse": Curve.constant()})


@editable.register
def _(model: Phong) -> Editable:
    e = model.number("exponent")
    scale = triple(model.rgb("ks") * (e + 2) / (2 * np.pi))
    term = Term("specular", q.One(), scale, (Factor("highlight", "theta_r"),))
    return Editable(model.title, (term,), {"highlight": _cosine_power(e)})


@editable.register
def _(model: BlinnPhong) -> Editable:
    e = model.number("exponent")
    scale = triple(model.rgb("ks") * (e + 2) * (e + 4) / (8 * np.pi * (2 ** (-e / 2) + e)))
    term = Term("specular", q.One(), scale, (HIGHLIGHT, FRESNEL))
    return Editable(model.title, (term,), {"highlight": _cosine_power(e), "fresnel": Curve.constant()})


@editable.register
def _(model: CookTorrance) -> Editable:
    m, n, k = model.number("m"), model.rgb("n"), model.rgb("k")
    highlight = beckmann(m, m)
    fresnel = Curve.of(lambda x: conductor(np.cos(x)[:, None], n, k))
    term = Term("specular", q.Grooves(), factors=(*highlight.factors, FRESNEL))
    return Editable(model.title, (term,), {**highlight.curves, "fresnel": fresnel})


@editable.register
def _(model: AshikhminShirley) -> Editable:
    """Two terms that share their curves and blend by Schlick's Fresnel factor (3.12)."""
    rd, rs, ex, ey = model.rgb("rd"), model.rgb("rs"), model.number("ex"), model.number("ey")
    scale, factors = (
        np.sqrt((ex + 1) * (ey + 1)) / (2 * np.pi),
        (Factor("along", "gamma_t"), Factor("across", "gamma_b")),
    )
    terms = (
        Term("diffuse", q.AshikhminDiffuse(), triple(rd * (1 - rs)), (DIFFUSE,)),
        Term("specular", q.AshikhminLobe(), triple(scale * rs), factors),
        Term("grazing", q.AshikhminLobe(schlick=True), triple(scale * (1 - rs)), factors),
    )
    curves = {"diffuse": Curve.constant(), "along": _cosine_power(ex), "across": _cosine_power(ey)}
    return Editable(model.title, terms, curves)


@editable.register
def _(model: Ward) -> Editable:
    highlight = beckmann(model.number("mx"), model.number("my"))
    return _ward(model, highlight.factors, highlight.curves, q.Microfacets(d=2, h=highlight.cos_h))


@editable.register
def _(model: WardOriginal) -> Editable:
    highlight = beckmann(model.number("mx"), model.number("my"))
    return _ward(model, highlight.factors, highlight.curves, q.Microfacets(d=0, alpha=0.5, h=highlight.cos_h - 4))


def _ward(model: Ward, factors: tuple[Factor, ...], curves: Mapping[str, Curve], quotient: q.Microfacets) -> Editable:
    return Editable(model.title, (Term("specular", quotient, triple(model.rgb("ks")), factors),), curves)


@editable.register
def _(model: Schlick) -> Editable:
    r, p = model.number("r"), model.number("p")
    zenith = Curve.of(lambda x: r / (np.sin(x) ** 2 + r * np.cos(x) ** 2) ** 2)
    fresnel = Curve.of(lambda x: schlick(np.cos(x), model.rgb("c")))
    term = Term("specular", q.SchlickGlossy(r, p), factors=(HIGHLIGHT, FRESNEL))
    return Editable(model.title, (term,), {"highlight": zenith, "fresnel": fresnel}, ("obstruction", "isotropy"))


@editable.register
def _(model: OrenNayar) -> Editable:
    """Its parameters scale four fixed functions; the curves are for freehand editing."""
    sigma2, rho = np.radians(model.number("sigma")) ** 2, model.rgb("rho")
    parts: list[tuple[str, q.One | q.OrenNayarPart, Floats]] = [
        ("diffuse", q.One(), rho * (1 - 0.5 * sigma2 / (sigma2 + 0.33)) / np.pi),
        ("towards the light", q.OrenNayarPart("c2"), rho * 0.45 * sigma2 / (sigma2 + 0.09)),
        ("aside", q.OrenNayarPart("c3"), rho * 0.125 * sigma2 / (sigma2 + 0.09)),
        ("twice", q.OrenNayarPart("twice"), rho**2 * 0.17 * sigma2 / (sigma2 + 0.13)),
    ]
    terms = tuple(Term(name, part, triple(scale), (DIFFUSE,), viewer="viewer") for name, part, scale in parts)
    return Editable(model.title, terms, {"diffuse": Curve.constant(), "viewer": Curve.constant()})


@editable.register
def _(model: Kurt) -> Editable:
    terms, curves = lobe_terms(model.lobe)
    return Editable(model.title, terms, curves)


@editable.register
def _(model: Ggx) -> Editable:
    ax, ay = model.number("alpha_x"), model.number("alpha_y")
    highlight = ggx(ax, ay)
    fresnel = Curve.of(lambda x: schlick(np.cos(x), model.rgb("f0")))
    term = Term("specular", q.SmithGgx(ax, ay, highlight.cos_h), factors=(*highlight.factors, FRESNEL))
    return Editable(model.title, (term,), {**highlight.curves, "fresnel": fresnel}, ("masking",))


def _cosine_power(exponent: float) -> Curve:
    power: Callable[[Floats], Floats] = lambda x: np.maximum(np.cos(x), 0.0) ** exponent  # noqa: E731
    return Curve.of(power)
