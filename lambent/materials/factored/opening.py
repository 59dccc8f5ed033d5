"""Load any description of a material as terms and curves, with the error of the factorisation.

Homomorphic factors are curves themselves (Ben-Artzi 2007, eq. 3.16), P(theta_i) Q(theta_h) P(theta_o): the textures'
means over azimuth. The rest of each texture stays in the quotient.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import FLIP_Z
from lambent.core.inputs import read_head
from lambent.core.plain import triple
from lambent.core.progress import Progress, silent
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Material, is_document, load_material
from lambent.materials.factored.curve import END_RAD, KNOTS, Curve, angles_rad
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import editable
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.quotients import One
from lambent.materials.factored.tabulated import MOST, Grid, digest_of
from lambent.materials.factored.terms import Editable, Factor, Term
from lambent.materials.fitting.factors import Factored, factorise, judged
from lambent.materials.lobes import NUMPY, Vector, half_vector
from lambent.materials.measured.homomorphic import HomomorphicTable, ParabolicMap, radial_means
from lambent.materials.measured.protocol import GRAZING_DEG, LeftOut, MeasuredSamples, MeasuredTable, TableInfo
from lambent.materials.measured.registry import load
from lambent.materials.models.model import Model


@dataclass(frozen=True)
class Azimuths:
    """p(wi) q(h) p(wo), RGB: the textures over their means at the same angle, each clamped to [0, MOST].

    Ratios are formed at look-up, not per texel: means bend more than bilinear ratios can follow.
    """

    p: ParabolicMap = field(repr=False, compare=False)
    q: ParabolicMap = field(repr=False, compare=False)
    means: tuple[Floats, Floats] = field(repr=False, compare=False)  # of p and q, as the curves' values, flat
    digest: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "digest", digest_of(self.p.texels, self.q.texels, *self.means))

    def evaluate(self, wi: Vector, wo: Vector, ops: Any = NUMPY) -> Vector:
        h = half_vector(wi, wo, ops)
        looked_up = ((self.p, 0, "theta_i", wi), (self.q, 1, "theta_h", h), (self.p, 0, "theta_o", wo))
        value: list[Any] = [1.0, 1.0, 1.0]
        for texture, which, angle, w in looked_up:
            texel, mean = texture.at(w, ops), _at(self.means[which], angle_of(angle, wi, wo, ops=ops), ops)
            for c in range(3):
                ratio = ops.minimum(texel[c] / ops.maximum(mean[c], 1e-12), MOST)
                value[c] = value[c] * ops.select(mean[c] > 0, ratio, 1.0)
        return value[0], value[1], value[2]


def of_textures(table: HomomorphicTable) -> Editable:
    """One term with the curves `P`, over theta_i and theta_o, and `Q`, over theta_h."""
    curves = {name: Curve(radial_means(texture, angles_rad())) for name, texture in (("P", table.p), ("Q", table.q))}
    flat = [np.ascontiguousarray(curves[name].values, np.float32).ravel() for name in ("P", "Q")]
    factors = (Factor("P", "theta_i"), Factor("Q", "theta_h"))
    quotient = Azimuths(table.p, table.q, (flat[0], flat[1]))
    term = Term("factors", quotient, triple(table.alpha), factors, viewer="P")
    return Editable(table.info.file, (term,), curves, ("azimuths",))


def _at(curve: Floats, angle_rad: Any, ops: Any) -> Vector:
    """RGB of a curve's flat values at angles up to END_RAD."""
    place = ops.minimum(angle_rad * (KNOTS / END_RAD), float(KNOTS))
    low = ops.minimum(ops.floor(place), KNOTS - 1.0)
    first, share = 3 * ops.whole(low), place - low
    red, green, blue = (
        ops.gather(curve, first + c) * (1 - share) + ops.gather(curve, first + 3 + c) * share for c in range(3)
    )
    return red, green, blue


_JUDGED = Grid(40, 12, 8, 4, turns_d=2)


def editable_of(subject: Path | str | Material | Model | MeasuredTable, progress: Progress = silent) -> Factored:
    """Terms and curves of a material document, a model, a measured table or homomorphic factors.

    Parameters
    ----------
    subject
        The object, or the path of a measured file or a material document; the content decides which.

    Returns
    -------
    Factored
        The editable, and its errors by metric relative to a black surface: at the tuples of a table; for a document or
        a model, which have exact curves, at half and difference angles.

    Raises
    ------
    UserError
        If the file is missing, of no known kind or broken, or the model has no decomposition.
    """
    if isinstance(subject, Path | str):
        path = Path(subject)
        is_json = path.is_file() and is_document(read_head(path, 64))
        return editable_of(load_material(path) if is_json else load(path), progress)
    if isinstance(subject, Material):
        return _judged_everywhere(of_material(subject), MaterialBSDF(subject).eval)
    if isinstance(subject, Model):
        return _judged_everywhere(editable(subject), subject.eval)
    if isinstance(subject, HomomorphicTable):
        found = of_textures(subject)
        plain = replace(found, terms=tuple(replace(term, quotient=One()) for term in found.terms))
        return judged(found, subject.samples(), plain)
    return factorise(subject, progress)


def _judged_everywhere(found: Editable, evaluate: Callable[[Floats, Floats], Floats]) -> Factored:
    """Errors against a formula, at half and difference angles."""
    wi, wo = (w.reshape(-1, 3) for w in _JUDGED.directions())
    above = np.minimum(wi[:, 2], wo[:, 2]) > np.cos(np.radians(GRAZING_DEG))
    wi, wo, weight = wi[above], wo[above], _JUDGED.solid_angles()[above]
    across = any(term.side == "transmission" for term in found.terms)
    if across:
        wi, wo, weight = np.concatenate([wi, wi]), np.concatenate([wo, wo * FLIP_Z]), np.concatenate([weight, weight])
    info = TableInfo(found.name, "formula", False, across, 3, "f")
    return judged(found, MeasuredSamples(wi, wo, evaluate(wi, wo), weight, LeftOut(), info))
