"""Edited materials as material documents: exact where curves still match a document's, otherwise fitted lobes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.plain import triple
from lambent.editing.curves.as_table import EditedTable, part_of
from lambent.editing.session.document import OfDocument, OfModel, OfTable
from lambent.editing.session.session import Session
from lambent.materials.document import Lobe, Material, Provenance, Side
from lambent.materials.export.matching.verdict import Verdict, verdict_of
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_lobes import lobe_terms, of_material, prefixed
from lambent.materials.factored.terms import Editable
from lambent.materials.fitting.account import evaluate
from lambent.materials.fitting.fit import fit
from lambent.materials.measured.inspecting.metrics import errors_and_shares, light_ratios
from lambent.materials.measured.protocol import MeasuredSamples
from lambent.materials.models import model_named
from lambent.materials.models.kurt import Kurt
from lambent.materials.models.lambert import Lambert

SAME = 1e-9  # relative difference up to which curves count as multiples of each other
COMPARED = 60_000  # tuples, at most
METRIC = "cuberoot"  # that lobes are fitted by


@dataclass(frozen=True)
class ExportedMaterial:
    """An edited material as a document, and the loss of the conversion.

    Attributes
    ----------
    material : Material
        With its provenance.
    fitted : tuple of str
        Names of the terms replaced by fitted lobes; empty if the document is exact.
    errors, shares : dict of float
        By metric: E between the edited curves and the document, and E relative to the curves' own size.
    light : dict of float
        By side: scattered light, document over curves.
    verdict : Verdict
        faithful, approximate or unusable, as for exports.
    warnings : tuple of str
        Of the fit.
    """

    material: Material
    fitted: tuple[str, ...]
    errors: dict[str, float]
    shares: dict[str, float]
    light: dict[Side, float]
    verdict: Verdict
    warnings: tuple[str, ...] = ()


def export(
    session: Session,
    name: str,
    *,
    lobes: int | Literal["auto"] = "auto",
    distribution: Literal["beckmann", "ggx", "best"] = "best",
) -> ExportedMaterial:
    """Convert a material of a session, as edited now, to a document.

    Diffuse terms and lobes whose curves are a document's, or multiples of them, are kept. Lobes and a diffuse term are
    fitted to the sum of the others; `lobes` and `distribution` are as in `fitting.fit`.
    """
    edited, start = session.editable(name), session.original(name)
    document = _document(session.document.materials[name].source)
    kept, rest = (Material(), {term.name for term in edited.terms})
    if document is not None:
        kept, rest = _kept(document, start, edited)
    warnings: tuple[str, ...] = ()
    if rest:
        table = EditedTable(part_of(edited, rest), name)
        samples = table.samples()
        if samples.f.any():
            found = fit(samples, lobes=lobes, metric=METRIC, distribution=distribution, coupled=kept.kd_coupled)
            kept, warnings = _sum(kept, found.material), found.warnings
    fitted = tuple(term.name for term in edited.terms if term.name in rest)
    samples = EditedTable(edited, name).samples(COMPARED)
    model = evaluate(kept, samples)
    errors, shares = errors_and_shares(samples, model)
    light = light_ratios(samples, model)
    verdict = verdict_of(shares, light)
    provenance = _provenance(session, name, fitted, errors, samples, (str(verdict), *warnings))
    material = kept.model_copy(update={"name": name, "provenance": provenance})
    return ExportedMaterial(material, fitted, errors, shares, light, verdict, warnings)


def _document(source: OfDocument | OfModel | OfTable) -> Material | None:
    """The document that a material started as; None if it started as curves that no document represents."""
    if isinstance(source, OfDocument):
        return source.material
    if isinstance(source, OfModel):
        model = model_named(source.model)(**source.parameters)
        if isinstance(model, Kurt):
            return Material(lobes=(model.lobe,))
        if isinstance(model, Lambert):
            return Material(kd=triple(model.rgb("kd")))
    return None


def _kept(document: Material, start: Editable, edited: Editable) -> tuple[Material, set[str]]:
    """The part of a document that edits left unchanged or multiplied by a colour, and the names of the other terms."""
    assert {term.name for term in of_material(document).terms} == {term.name for term in start.terms}
    multiples = _multiples(start, edited)
    lobes: list[Lobe] = []
    rest: set[str] = set()
    for prefix, lobe in prefixed(document.lobes):
        names = [term.name for term in lobe_terms(lobe, prefix)[0]]
        by = _common([multiples[name] for name in names])
        if by is None:
            rest |= set(names)
        else:
            lobes.append(lobe.model_copy(update={"k": triple(np.multiply(lobe.k, by))}))
    changes: dict[str, object] = {"lobes": tuple(lobes), "provenance": None}
    for name, coefficient in (("diffuse", "kd"), ("diffuse through", "kt_d")):
        by = multiples.get(name, np.ones(3))
        if by is None:
            rest.add(name)
        changes[coefficient] = triple(np.multiply(getattr(document, coefficient), 0.0 if by is None else by))
    return document.model_copy(update=changes), rest


def _multiples(start: Editable, edited: Editable) -> dict[str, Floats | None]:
    """By term, the colour (3,) by which edits multiplied it; None for any other edit."""
    found: dict[str, Floats | None] = {}
    for before, after in zip(start.terms, edited.terms, strict=True):
        scale = np.divide(after.scale, before.scale, out=np.ones(3), where=np.array(before.scale) != 0)
        factors = [_multiple(start.curves[name], edited.curves[name]) for name in before.curves]
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
    return one.model_copy(update={"kd": kd, "kt_d": kt_d, "lobes": (*one.lobes, *other.lobes)})


def _provenance(
    session: Session,
    name: str,
    fitted: tuple[str, ...],
    errors: dict[str, float],
    samples: MeasuredSamples,
    notes: tuple[str, ...],
) -> Provenance:
    one = session.document.materials[name]
    edits = [f"{curve} drawn" if edit.drawn else curve for curve, edit in one.curves.items()]
    edits += [f"colour of {term}" for term in one.tints]
    method = "edited: " + (", ".join(edits) or "nothing") + "; "
    method += f"lobes fitted to {', '.join(fitted)}" if fitted else "exact"
    before = one.source.material.provenance if isinstance(one.source, OfDocument) else None
    source, sha256, kind = _origin(one.source)
    return Provenance(
        source=before.source if before and before.source else source,
        source_sha256=before.source_sha256 if before and before.source else sha256,
        source_format=before.source_format if before and before.source else kind,
        method=method,
        metric=METRIC if fitted else None,
        errors=errors,
        samples=samples.counts,
        notes=notes + (tuple(f"before the edits: {note}" for note in before.notes) if before else ()),
    )


def _origin(source: OfDocument | OfModel | OfTable) -> tuple[str, str | None, str]:
    """Name, hash and format of the source of a material."""
    if isinstance(source, OfDocument):
        return source.material.name, None, "material document"
    if isinstance(source, OfModel):
        return source.model, None, "model"
    return source.file.rpartition("/")[2], source.sha256, "measured table"
