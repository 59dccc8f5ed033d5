"""Published fits of MERL materials: a parser of .fit files, and the three models their parameters belong to.

A .fit file is text, one material per line:

    chrome = Aggregate(Lambertian(albedo = [r, g, b]), NganWard(albedo = [r, g, b], roughness = m))

The models, with h the half vector, D0 = exp(-tan^2 theta_h / m^2) / (m^2 cos^4 theta_h), and Torrance and Sparrow's
G = min(1, 2 h.z wi.z / wi.h, 2 h.z wo.z / wo.h):

- `Lambertian`: albedo / pi.
- `NganWard` (Ngan, Durand & Matusik 2005): albedo exp(-tan^2 theta_h / m^2) / (4 pi m^2 sqrt(wi.z wo.z)) (Ward 1992).
- `NganCookTorrance` (the same paper): albedo F (D0 / pi) G / (pi wi.z wo.z); F is Schlick's, and `eta`, despite its
  name, the reflectance at normal incidence.
- `LowCookTorrance` (Low, Kronander, Ynnerman & Unger 2012): albedo F D0 G / (pi wi.z wo.z), pi times the above; F is
  that of a dielectric with the real index of refraction `eta`.

Ngan's coefficients were fitted to MERL's values without the scales of green and blue; see `MERL_CHANNELS`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from lambent.core.ceilings import FITS_BYTES
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats, half_vector
from lambent.core.inputs import read_bytes
from lambent.core.plain import Triple, triple
from lambent.materials.fresnel import conductor, schlick_weight

MERL_CHANNELS = np.array([1.0, 1.15, 1.66])
"""Factors that convert Ngan's coefficients to f as read by MERL's readers."""
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RGB = rf"\[\s*({_NUMBER})\s*,\s*({_NUMBER})\s*,\s*({_NUMBER})\s*\]"
_LINE = re.compile(
    rf"([^\s=]+)\s*=\s*Aggregate\(\s*Lambertian\(\s*albedo\s*=\s*{_RGB}\s*\)\s*,\s*(\w+)\((.*)\)\s*\)\s*"
)
_FIELD = re.compile(rf"\s*(\w+)\s*=\s*({_RGB}|{_NUMBER})\s*(?:,|$)")


@dataclass(frozen=True)
class Published:
    """One published material: a Lambertian term and one lobe.

    Attributes
    ----------
    name, model : str
        The material's name in the file, and the lobe's model.
    kd, ks : (3,) tuples
        Albedo of the Lambertian term and coefficient of the lobe, as the file gives them.
    roughness : float
        Slope m.
    eta : float, optional
        Parameter of the two Cook-Torrance models; its meaning differs, see above.
    """

    name: str
    model: str
    kd: Triple
    ks: Triple
    roughness: float
    eta: float | None = None

    MODELS: ClassVar = {"NganWard": (), "NganCookTorrance": ("eta",), "LowCookTorrance": ("eta",)}  # more fields

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., 3) in 1/sr without the cosine, comparable with MERL's values; 0 below the surface."""
        wi, wo = np.broadcast_arrays(np.asarray(wi, float), np.asarray(wo, float))
        above = (wi[..., 2] > 1e-6) & (wo[..., 2] > 1e-6)
        safe_i, safe_o = (np.where(above[..., None], w, (0.0, 0.0, 1.0)) for w in (wi, wo))
        f = np.asarray(self.kd) / np.pi + np.asarray(self.ks) * self._lobe(safe_i, safe_o)[..., None]
        scale = MERL_CHANNELS if self.model.startswith("Ngan") else 1.0
        return np.where(above[..., None], f * scale, 0.0)

    def _lobe(self, wi: Floats, wo: Floats) -> Floats:
        """The lobe without its coefficient, (...)."""
        h = half_vector(wi, wo)
        cos_i, cos_o, m2 = wi[..., 2], wo[..., 2], self.roughness**2
        h_z2 = np.maximum(h[..., 2] ** 2, 1e-12)
        bell = np.exp(-(h[..., 0] ** 2 + h[..., 1] ** 2) / (h_z2 * m2)) / m2
        if self.model == "NganWard":
            return np.asarray(bell / (4 * np.pi * np.sqrt(cos_i * cos_o)))
        cos_d = np.maximum(np.sum(wi * h, axis=-1), 1e-6)
        groove = np.minimum(1, 2 * h[..., 2] * np.minimum(cos_i, cos_o) / cos_d)
        value = bell / h_z2**2 * groove * self._fresnel(cos_d) / (np.pi * cos_i * cos_o)
        return np.asarray(value / np.pi if self.model == "NganCookTorrance" else value)

    def _fresnel(self, cos_d: Floats) -> Floats:
        assert self.eta is not None
        if self.model == "NganCookTorrance":
            return np.asarray(self.eta + (1 - self.eta) * schlick_weight(cos_d))
        return conductor(cos_d, self.eta, 0.0)


def read_fits(path: Path) -> dict[str, Published]:
    """All materials of a .fit file, by name.

    Raises
    ------
    UserError
        If a line is not a material of this form, names an unknown model or field, or has an impossible number.
    """
    try:
        text = read_bytes(path, FITS_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UserError("not a text file of published fits", file=path) from error
    found: dict[str, Published] = {}
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        one = _published(line.strip(), path, number)
        if one.name in found:
            raise UserError(f"two materials have the same name, the second in line {number}", file=path, got=one.name)
        found[one.name] = one
    if not found:
        raise UserError("has no material", file=path, expected="lines such as NAME = Aggregate(Lambertian(...), ...)")
    return found


def _published(line: str, path: Path, number: int) -> Published:
    match = _LINE.fullmatch(line)
    where = f"line {number}"
    if match is None:
        expected = "NAME = Aggregate(Lambertian(albedo = [r, g, b]), MODEL(albedo = [r, g, b], roughness = m, ...))"
        raise UserError("not a published fit", file=path, field=where, got=line[:60], expected=expected)
    name, *kd, model, inner = match.groups()
    known("model", model, Published.MODELS, file=path, field=where)
    fields, end = {}, 0
    while (part := _FIELD.match(inner, end)) is not None and end < len(inner):
        fields[part[1]] = part[2]
        end = part.end()
    wanted = {"albedo", "roughness", *Published.MODELS[model]}
    if end != len(inner) or fields.keys() != wanted:
        raise UserError(f"wrong fields of {model}", file=path, field=where, got=inner[:60], expected=sorted(wanted))
    ks = re.fullmatch(_RGB, fields.pop("albedo"))
    numbers = {key: float(value) for key, value in fields.items() if re.fullmatch(_NUMBER, value)}
    if ks is None or numbers.keys() != fields.keys():
        raise UserError("albedo is [r, g, b], the others are numbers", file=path, field=where, got=inner[:60])
    one = Published(name, model, triple(kd), triple(ks.groups()), **numbers)
    schlick, eta = model == "NganCookTorrance", 1.0 if one.eta is None else one.eta
    checks = {
        "Lambertian albedo": (min(one.kd) >= 0 and max(one.kd) < 1e3, one.kd, "at least 0"),
        "albedo": (min(one.ks) >= 0 and max(one.ks) < 1e6, one.ks, "at least 0"),
        "roughness": (1e-4 <= one.roughness <= 10, one.roughness, "a slope from 1e-4 to 10"),
        "eta": (0 <= eta <= 1 if schlick else 1 <= eta <= 1e3, eta, "0 to 1" if schlick else "at least 1"),
    }
    for field, (holds, got, expected) in checks.items():
        if not holds:
            raise UserError(f"impossible {field}", file=path, field=f"{where}, {one.name}", got=got, expected=expected)
    return one
