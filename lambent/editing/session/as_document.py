"""Materials with edited curves as documents: curve lobes, exact where curves still match a document's, or fitted lobes.

Lobes are fitted to edited curves as a measured table, as to any measurement. Its tuples lie on a grid of half vectors
that is fine where the highlight's curves are steep: it resolves a highlight of any width, and any ring drawn by hand.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import FLIP_Z, direction
from lambent.core.plain import triple
from lambent.materials.document import Lobe, Material, Provenance
from lambent.materials.factored.curve import END_RAD, Curve, angles_rad
from lambent.materials.factored.of_lobes import as_curve_lobe, as_kd_curve, lobe_terms, of_material, prefixed
from lambent.materials.factored.terms import Editable
from lambent.materials.fitting.account import evaluate
from lambent.materials.fitting.fit import fit
from lambent.materials.measured.inspecting.metrics import errors_and_shares
from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable, TableInfo, collect

SAME = 1e-9  # relative difference up to which curves count as multiples of each other
COMPARED = 60_000  # tuples, at most
FITTED = 8_000  # tuples, at most: four times as many take four times as long, and change errors by 3 %
METRIC = "cuberoot"  # that lobes are fitted by
FORMAT = "edited curves"
THETA_I_DEG = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)
PHI_I_DEG = (0.0, 30.0, 60.0, 90.0, 120.0, 150.0)  # of an anisotropic material
RINGS, SECTORS = 96, 24  # of half vectors
PER_HALF_VECTOR = {"theta_h": 1.0, "slope_t": 1.0, "slope_b": 1.0, "gamma_t": 1.0, "gamma_b": 1.0, "theta_r": 0.5}


def as_document(name: str, document: Material | None, start: Editable, edited: Editable) -> Material:
    """Convert a material with edited curves to a document, whose provenance has the error.

    Diffuse terms and lobes whose curves are those of the `document` that it started as, or multiples of them, are kept;
    others become curve lobes where their curves are such. Lobes and a diffuse term are fitted to the sum of the rest.
    """
    kept, rest = (Material(), {term.name for term in edited.terms})
    if document is not None:
        kept, rest = _kept(document, start, edited)
    if rest:
        samples = EditedTable(part_of(edited, rest), name).samples(FITTED)
        if samples.f.any():
            found = fit(samples, lobes="auto", metric=METRIC, coupled=kept.kd_coupled, bends_kd=not any(kept.kd))
            kept = _sum(kept, found.material)
    errors, _ = errors_and_shares(samples := EditedTable(edited, name).samples(COMPARED), evaluate(kept, samples))
    fitted = [term.name for term in edited.terms if term.name in rest]
    before = document.provenance or Provenance() if document is not None else Provenance()
    account = {
        "method": f"edited curves; lobes fitted to {', '.join(fitted)}" if fitted else "edited curves",
        "metric": METRIC if fitted else before.metric,
        "errors": errors,
        "samples": samples.counts,
    }
    return kept.model_copy(update={"name": name, "provenance": before.model_copy(update=account)})


def _kept(document: Material, start: Editable, edited: Editable) -> tuple[Material, set[str]]:
    """The part of a document that edits left unchanged or multiplied by a colour, and the names of the other terms."""
    assert {term.name for term in of_material(document).terms} == {term.name for term in start.terms}
    multiples = _multiples(start, edited)
    lobes: list[Lobe] = []
    rest: set[str] = set()
    for prefix, lobe in prefixed(document.lobes):
        names = [term.name for term in lobe_terms(lobe, prefix)[0]]
        by = _common([multiples[name] for name in names])
        if by is not None:
            lobes.append(lobe.model_copy(update={"k": triple(np.multiply(lobe.k, by))}))
            continue
        term = next(term for term in edited.terms if term.name == names[0])
        bent = as_curve_lobe(lobe, edited.curves, np.array(term.scale), prefix) if len(names) == 1 else None
        if bent is None:
            rest |= set(names)
        else:
            lobes.append(bent)
    changes: dict[str, object] = {"lobes": tuple(lobes), "provenance": None}
    for name, coefficient in (("diffuse", "kd"), ("diffuse through", "kt_d")):
        by = multiples.get(name, np.ones(3))
        of_kd = next((term for term in edited.terms if term.name == name and term.viewer), None)
        if by is None and of_kd is not None and (nodes := as_kd_curve(edited.curves[name], document.kd_coupled)):
            changes |= {"kd_curve": nodes[0], "kd_coupled": False}
            unit = 1.0 if document.kd_coupled else np.pi
            by = nodes[1] * unit * np.array(of_kd.scale) / np.maximum(document.kd, 1e-30)
        if by is None:
            rest.add(name)
        changes[coefficient] = triple(np.multiply(getattr(document, coefficient), 0.0 if by is None else by))
    return document.model_copy(update=changes), rest


def _multiples(start: Editable, edited: Editable) -> dict[str, Floats | None]:
    """By term, the colour (3,) by which edits multiplied it; None for any other edit."""
    found: dict[str, Floats | None] = {}
    for before, after in zip(start.terms, edited.terms, strict=True):
        scale = np.divide(after.scale, before.scale, out=np.ones(3), where=np.array(before.scale) != 0)
        used = [*(factor.curve for factor in before.factors), *([before.viewer] if before.viewer else [])]
        factors = [_multiple(start.curves[name], edited.curves[name]) for name in used]
        known = [factor for factor in factors if factor is not None]
        found[before.name] = scale * np.prod([np.ones(3), *known], axis=0) if len(known) == len(factors) else None
    return found


def _multiple(before: Curve, after: Curve) -> Floats | None:
    """The colour (3,) with `after` = colour x `before`, or None."""
    if before is after:
        return np.ones(3)
    peak = before.values.argmax(axis=0), np.arange(3)
    top = before.values[peak]
    by = np.divide(after.values[peak], top, out=np.ones(3), where=top > 0)
    rest = np.abs(after.values - by * before.values)
    return by if (rest <= SAME * np.maximum(by * before.values, 1e-30)).all() else None


def _common(multiples: list[Floats | None]) -> Floats | None:
    """The multiple that all terms of a lobe share, or None."""
    first = multiples[0]
    same = [by is not None and first is not None and np.allclose(by, first, rtol=SAME) for by in multiples]
    return first if all(same) else None


def _sum(one: Material, other: Material) -> Material:
    """The sum of two documents; the diffuse terms of both are coupled, or neither is."""
    kd, kt_d = (triple(np.add(getattr(one, name), getattr(other, name))) for name in ("kd", "kt_d"))
    lobes, kd_curve = (*one.lobes, *other.lobes), one.kd_curve if any(one.kd) else other.kd_curve
    return one.model_copy(update={"kd": kd, "kt_d": kt_d, "kd_curve": kd_curve, "lobes": lobes})


class EditedTable(MeasuredTable):
    """The table that a gonio-photometer would measure, without noise, from a material made of curves."""

    def __init__(self, material: Editable, name: str) -> None:
        self.material = material
        isotropic = _is_isotropic(material)
        transmits = any(term.side == "transmission" for term in material.terms)
        sizes = {"theta_i": len(THETA_I_DEG), "phi_i": 1 if isotropic else len(PHI_I_DEG)}
        self.info = TableInfo(name, FORMAT, isotropic, transmits, 3, "f", sizes)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        return np.maximum(self.material.eval(wi, wo), 0.0)

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        phi_i = (0.0,) if self.info.isotropic else PHI_I_DEG
        theta_h, phi_h, solid_angle = _half_vectors(self.material, SECTORS if self.info.isotropic else SECTORS // 2)
        h = direction(theta_h, phi_h)
        parts = []
        for theta in THETA_I_DEG:
            for phi in phi_i:
                wi = np.broadcast_to(direction(np.radians(theta), np.radians(phi)), h.shape)
                cos_d = np.sum(wi * h, axis=-1)
                wo = 2 * cos_d[..., None] * h - wi
                here = (cos_d > 0) & (wo[..., 2] > 0)
                parts.append((wi[here], wo[here], (4 * cos_d * solid_angle)[here]))
        wi, wo, weight = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        if self.info.transmits:
            wi, weight = np.tile(wi, (2, 1)), np.tile(weight, 2)
            wo = np.concatenate([wo, wo * FLIP_Z])
        return collect(wi, wo, self.eval(wi, wo), weight, self.info, np.zeros(len(wi), bool), max_count)


def _half_vectors(material: Editable, sectors: int) -> tuple[Floats, Floats, Floats]:
    """theta_h (R, 1), phi_h (1, S) in radians, and solid angles (R, 1) of a grid of half vectors."""
    edges = _edges(material)
    middle = (edges[:-1] + edges[1:]) / 2
    phi = (np.arange(2 * sectors) + 0.5) * (np.pi / sectors)
    solid_angle = (np.cos(edges[:-1]) - np.cos(edges[1:])) * (np.pi / sectors)
    return middle[:, None], phi[None, :], solid_angle[:, None]


def _edges(material: Editable) -> Floats:
    """(RINGS + 1,) edges of rings of theta_h in radians: half of them where curves change, half denser towards 0."""
    theta = angles_rad()
    rise = np.zeros(len(theta))
    for term in material.terms:
        for factor in term.factors:
            if (per_half := PER_HALF_VECTOR.get(factor.over)) is not None:
                values = material.curves[factor.curve].at(theta / per_half).sum(axis=1)
                rise += np.abs(np.gradient(values)) / max(np.abs(np.diff(values)).sum(), 1e-30)
    changed = np.cumsum(rise) / max(rise.sum(), 1e-30)
    share = np.linspace(0, 1, RINGS + 1)
    even = np.sqrt(theta / END_RAD)
    mixed = (changed + even) / 2 if rise.any() else even
    mixed = (mixed - mixed[0]) / (mixed[-1] - mixed[0])
    edges = np.interp(share, mixed, theta)
    edges[0], edges[-1] = 0.0, END_RAD
    return np.asarray(edges)


def _is_isotropic(material: Editable) -> bool:
    """Whether f is unchanged when both directions turn about the normal."""
    rng = np.random.default_rng(0)
    theta, phi = np.arccos(rng.uniform(0.1, 1, (2, 500))), rng.uniform(0, 2 * np.pi, (2, 500))
    theta[1, :250], phi[1, :250] = theta[0, :250] + 0.05, phi[0, :250] + np.pi  # near the mirror direction
    theta = np.minimum(theta, 1.5)
    for side in (1.0, FLIP_Z):
        one, other = (
            material.eval(direction(theta[0], phi[0] + a), direction(theta[1], phi[1] + a) * side) for a in (0, 0.7)
        )
        if not np.allclose(one, other, rtol=1e-6, atol=1e-9 * np.abs(one).max()):
            return False
    return True


def part_of(material: Editable, names: set[str]) -> Editable:
    """The terms of these names, with their curves."""
    terms = tuple(term for term in material.terms if term.name in names)
    used = {curve for term in terms for curve in term.curves}
    return replace(material, terms=terms, curves={n: c for n, c in material.curves.items() if n in used})
