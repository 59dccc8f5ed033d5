"""Materials, as documents and as BSDFs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from lambent.api.progress import Wanted, progress_of
from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Material as Document
from lambent.materials.document import load_material

ALBEDO_AT_DEG = (0, 30, 60)


class Material:
    """A material: a document of numbers, and the BSDF that they are.

    Directions are unit vectors (..., 3) in the local frame with n = +z, away from the surface: wi to the light, wo to
    the viewer. The sides are equal (a thin sheet): wi.z wo.z > 0 is reflection, < 0 transmission. f is in 1/sr, linear
    RGB with Rec.709 primaries, without the cosine.
    """

    def __init__(self, document: Document) -> None:
        self.document = document
        self._bsdf = MaterialBSDF(document)

    @classmethod
    def read(cls, file: str | Path) -> Material:
        """Read a material document; raises `UserError` if it cannot be used."""
        return cls(load_material(Path(file)))

    @property
    def name(self) -> str:
        return self.document.name

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., 3)."""
        return self._bsdf.eval(np.asarray(wi, float), np.asarray(wo, float))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        """Density (...) in 1/sr with which `sample` gives wi for wo."""
        return self._bsdf.pdf(np.asarray(wi, float), np.asarray(wo, float))

    def sample(self, wo: Floats, u: Floats) -> Floats:
        """wi (..., 3) from wo (..., 3) and u (..., 3), uniform in [0, 1); wi.z = 0 where pdf and value are 0."""
        return self._bsdf.sample(np.asarray(wo, float), np.asarray(u, float))

    def albedo(self, wo: Floats, samples: int = 4096) -> Floats:
        """Directional albedo (..., 3) of wo (..., 3): the integral of f |cos| over all wi, by importance sampling."""
        return self._bsdf.albedo(np.asarray(wo, float), samples)

    def normalised(self, seed: int = 0, progress: Wanted = None) -> Material:
        """An energy-conserving version, with lower alpha, then lower k; itself where no albedo exceeds 1."""
        from lambent.materials.checking.normalise import normalisation

        with progress_of(progress) as bar:
            return Material(normalisation(self.document, seed, bar).after)

    @property
    def curves(self) -> dict[str, tuple[Floats, Floats]]:
        """By title, each curve that can be pulled: angles (K,) in degrees, and values (K, C) there.

        "highlight": brightness over theta_h, the angle of the half vector; "reflectance by angle": over theta_d, of
        three channels; "diffuse by angle": over theta of either direction. Those of several lobes are numbered.
        """
        from lambent.editing.curves import nodes

        one = self.document
        return {name: (nodes.angles_deg(one, of), nodes.values_of(one, of)) for name, of in nodes.titled(one).items()}

    def with_curve(self, title: str, values: Floats) -> Material:
        """The material with other values (K, C) >= 0 of one of its `curves`; light at unchanged nodes stays.

        Raises
        ------
        UserError
            If there is no such curve, or the values are of another shape, negative, infinite or all 0.
        """
        from lambent.editing.curves import nodes

        found = nodes.titled(self.document)
        which, values = found[known("curve", title, found)], np.asarray(values, float)
        shape = self.curves[title][1].shape
        if values.shape != shape or not (np.isfinite(values).all() and (values >= 0).all() and values.any()):
            expected = f"{shape} finite numbers from 0, not all 0"
            raise UserError("cannot be taken", field=title, got=f"values of shape {values.shape}", expected=expected)
        return Material(nodes.with_values(self.document, which, values))

    def save(self, file: str | Path) -> None:
        """Write the document (.json)."""
        self.document.save(Path(file))

    def facts(self) -> dict[str, Any]:
        """Numbers, albedo and source, by name."""
        one = self.document
        albedo = self.albedo(direction(np.radians(ALBEDO_AT_DEG), 0.0))
        provenance = one.provenance.model_dump(mode="json") if one.provenance else {}
        return {
            "is": "material",
            "name": one.name,
            "kd": one.kd,
            "kt_d": one.kt_d,
            **{f"lobe {number}": lobe.model_dump() for number, lobe in enumerate(one.lobes, 1)},
            "albedo": {f"{angle} deg": float(rgb.mean()) for angle, rgb in zip(ALBEDO_AT_DEG, albedo, strict=True)},
            "source": {key: value for key, value in provenance.items() if value and not isinstance(value, dict | list)},
            "errors": provenance.get("errors"),
            "notes": provenance.get("notes"),
        }

    def plot(self, file: str | Path, title: str = "") -> None:
        """Draw f in the plane of incidence (.png, .pdf, .svg)."""
        from lambent.materials.plots import plot_plane_of_incidence

        transmits = self.document.transmits
        plot_plane_of_incidence(Path(file), self.eval, self.name, title=title or self.name, transmits=transmits)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Material) and self.document == other.document

    __hash__ = None  # type: ignore[assignment]  # of a document with errors by metric

    def __repr__(self) -> str:
        albedo = self.albedo(np.array([0.0, 0.0, 1.0]), 1024).mean()
        return f"Material({self.name!r}, {len(self.document.lobes)} lobe(s), albedo {albedo:.2f} at normal incidence)"

    def _repr_png_(self) -> bytes:
        """The material on a ball."""
        from lambent.api.pictures import png_of
        from lambent.viewer.modes.walk.session.thumbnails import ball

        return png_of(ball(self.document, 192))
