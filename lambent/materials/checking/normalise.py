"""Normalise a material that returns more light than arrives, and report the size of the change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.geometry.sequences import cosine_hemisphere
from lambent.core.plain import Triple, triple
from lambent.core.progress import Progress, silent
from lambent.materials.bsdf import MaterialBSDF, specular_only
from lambent.materials.checking.check import furnace
from lambent.materials.document import Material
from lambent.materials.export.resampling.resampled import CHECK_LOG2, pairs_of
from lambent.materials.measured.inspecting.metrics import errors_and_shares

MARGIN = 0.999  # allowance for the furnace's own error
HALVINGS = 6  # of the interval that contains alpha's factor
ROUGHLY = 1 << 11  # samples of the furnace during the search; `with_less_k` is exact
PAIRS = 20_000
NOTE = "normalised so that no direction returns more than arrives; the errors are those of before"


@dataclass(frozen=True)
class Normalisation:
    """A material before and after `normalised`, and the difference.

    Attributes
    ----------
    before, after : Material
        The same object where nothing exceeded 1.
    highest : tuple of (albedo, theta_deg, phi_deg)
        Largest directional albedo before and after, with its direction.
    changed : dict
        Parameter -> its values before and after.
    errors, share : dict of float
        Metric name -> E between both, in the metric's unit, and as a share of E between `before` and black.
    """

    before: Material
    after: Material
    highest: tuple[Triple, Triple]
    changed: dict[str, tuple[Any, Any]]
    errors: dict[str, float]
    share: dict[str, float]

    @property
    def needed(self) -> bool:
        return self.after is not self.before

    def to_json(self) -> dict[str, Any]:
        """Plain numbers, strings and lists; the materials as documents."""
        documents = {name: getattr(self, name).model_dump(mode="json") for name in ("before", "after")}
        figures = {name: getattr(self, name) for name in ("changed", "errors", "share")}
        keys = ("albedo", "theta_deg", "phi_deg")
        return documents | figures | {"highest": [dict(zip(keys, one, strict=True)) for one in self.highest]}


def normalisation(material: Material, seed: int = 0, progress: Progress = silent) -> Normalisation:
    """`normalised` with a report of the changes; takes seconds to a minute, deterministic for a seed.

    Raises
    ------
    UserError
        If the diffuse terms alone exceed 1.
    """
    after = normalised(material, seed, progress)
    before = furnace(material, seed=seed).highest
    if after is material:
        return Normalisation(material, material, (before, before), {}, {}, {})
    samples = pairs_of(material, CHECK_LOG2, seed).samples
    f = MaterialBSDF(after).eval(samples.wi, samples.wo)[:, : samples.f.shape[1]]
    errors, share = errors_and_shares(samples, f)
    if after.provenance is not None:
        notes = (*after.provenance.notes, NOTE)
        after = after.model_copy(update={"provenance": after.provenance.model_copy(update={"notes": notes})})
    highest = before, furnace(after, seed=seed).highest
    return Normalisation(material, after, highest, _changed(material, after), errors, share)


def _changed(before: Material, after: Material) -> dict[str, tuple[Any, Any]]:
    return {
        f"lobes[{i}].{name}": (was, now)
        for i, (old, new) in enumerate(zip(before.lobes, after.lobes, strict=True))
        for name, was in old.model_dump().items()
        if was != (now := getattr(new, name))
    }


def normalised(material: Material, seed: int = 0, progress: Progress = silent) -> Material:
    """The material changed so that no furnace angle (theta up to 89 degrees) exceeds 1.

    Two remedies are compared, and the one with the smaller change of appearance (`change`) is used: scale all k, per
    channel; or first scale all alpha, which makes lobes exceed 1 towards grazing, then k. Diffuse terms and slopes
    stay. A material that does not exceed 1 is returned unchanged.

    Raises
    ------
    UserError
        If the diffuse terms alone exceed 1.
    """
    diffuse = np.add(material.kd, material.kt_d)
    if diffuse.max() > 1:
        raise UserError("diffuse terms exceed 1 without any lobe", field="kd + kt_d", got=diffuse.tolist())
    progress(0, HALVINGS + 2, "normalising")
    if not _excess(material, seed).any():
        return material
    flatter = with_less_alpha(material, seed, progress)
    remedies = with_less_k(material, seed), with_less_k(flatter, seed)
    progress(HALVINGS + 2, HALVINGS + 2, "normalised")
    return min(remedies, key=lambda remedy: change(material, remedy, seed))


def with_less_k(material: Material, seed: int = 0) -> Material:
    """The material with all k scaled, per channel, until nothing exceeds 1."""
    highest, room = _highest(material, seed), 1 - np.add(material.kd, material.kt_d)
    scale = np.where(highest > room, MARGIN * room / np.maximum(highest, 1e-12), 1.0)
    lobes = tuple(lobe.model_copy(update={"k": triple(np.asarray(lobe.k) * scale)}) for lobe in material.lobes)
    return material.model_copy(update={"lobes": lobes})


def with_less_alpha(material: Material, seed: int = 0, progress: Progress = silent) -> Material:
    """The material with all alpha scaled by the largest factor for which nothing exceeds 1; 0 if there is none."""
    low, high = 0.0, 1.0
    for halving in range(HALVINGS):
        progress(1 + halving, HALVINGS + 2, "normalising")
        middle = (low + high) / 2
        low, high = (low, middle) if _excess(_flatter(material, middle), seed, ROUGHLY).any() else (middle, high)
    return _flatter(material, low)


def change(before: Material, after: Material, seed: int = 0) -> float:
    """RMS over all pairs of the difference between the cube roots of f cos(theta_i), in (1/sr)^(1/3)."""
    rng = np.random.default_rng(seed)
    wo, bsdf = cosine_hemisphere(rng.random((PAIRS, 2))), MaterialBSDF(before)
    wi = bsdf.sample(wo, rng.random((PAIRS, 3)))
    pdf, cos_i = bsdf.pdf(wi, wo), np.abs(wi[:, 2:])
    roots = [np.cbrt(MaterialBSDF(material).eval(wi, wo) * cos_i) for material in (before, after)]
    share = np.divide(1.0, pdf, out=np.zeros_like(pdf), where=pdf > 0)
    return float(np.sqrt((((roots[0] - roots[1]) ** 2).mean(axis=-1) * share).mean()))


def _excess(material: Material, seed: int, samples: int = 1 << 14) -> Floats:
    """Excess (3,) of the lobes' albedo over 1 minus the diffuse terms; 0 without excess."""
    room = 1 - np.add(material.kd, material.kt_d)
    return np.asarray(np.maximum(_highest(material, seed, samples) - room, 0.0))


def _highest(material: Material, seed: int, samples: int = 1 << 14) -> Floats:
    """(3,) largest albedo of the lobes alone."""
    return np.asarray(furnace(specular_only(material), seed=seed, samples=samples).albedo.max(axis=(0, 1)))


def _flatter(material: Material, factor: float) -> Material:
    """The material with each alpha scaled that makes its lobe brighter towards grazing."""
    alphas = (lobe.alpha * (factor if lobe.alpha > 0 else 1.0) for lobe in material.lobes)
    flatter = (lobe.model_copy(update={"alpha": alpha}) for lobe, alpha in zip(material.lobes, alphas, strict=True))
    return material.model_copy(update={"lobes": tuple(flatter)})
