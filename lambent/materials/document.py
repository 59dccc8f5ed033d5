"""The material document: the JSON file that every part of Lambent and other tools exchange.

Units: kd, kt_d and k are dimensionless RGB coefficients (linear Rec.709); mx, my are slopes (dimensionless roughness
along t and b); r0 is the Fresnel reflectance at normal incidence; alpha is the exponent of the cosine product.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from lambent.core.errors import UserError, invalid
from lambent.core.files import read_bytes, write_text

FORMAT: Literal["lambent-material"] = "lambent-material"
VERSION: Literal[1] = 1
LIMIT_BYTES = 16 << 20
SCATTERING = {"kd", "kt_d", "lobes"}  # a document names at least one of them
Side = Literal["reflection", "transmission"]
Distribution = Literal["beckmann", "ggx"]
SIDES: tuple[Side, ...] = ("reflection", "transmission")


def _spread(value: object) -> object:
    return (value, value, value) if isinstance(value, int | float) else value


Coefficient = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1)]
RGB = Annotated[tuple[Coefficient, Coefficient, Coefficient], BeforeValidator(_spread)]
Roughness = Annotated[float, Field(ge=0.001, le=4, description="slope roughness, dimensionless")]
BLACK = (0.0, 0.0, 0.0)


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Lobe(_Strict):
    """One directional lobe (Kurt et al. 2010; thesis eqs 3.3-3.5)."""

    side: Side = "reflection"
    distribution: Distribution = "beckmann"
    k: RGB = (1.0, 1.0, 1.0)
    mx: Roughness
    my: Roughness
    r0: Annotated[tuple[Share, Share, Share], BeforeValidator(_spread)] = (0.04, 0.04, 0.04)
    alpha: Share = 0.0


class Provenance(_Strict):
    """Where a material's numbers come from: its measurement, and how it was fitted."""

    source: str | None = None  # file name of the measurement, without folders
    source_sha256: str | None = None
    source_format: str | None = None
    method: str | None = None
    metric: str | None = None
    errors: dict[str, float] = Field(default_factory=dict)  # metric -> error; the unit is the metric's
    samples: dict[str, int] = Field(default_factory=dict)  # used, below_zero of these; left out: shadowed, ...
    notes: tuple[str, ...] = ()


class Material(_Strict):
    """Sum of a diffuse term per side and any number of lobes (thesis eq. 3.6); a thin, two-sided sheet.

    With `kd_coupled` the diffuse reflection falls towards grazing as the Fresnel reflectance rises (`bsdf.coupling`);
    kd is then the diffuse albedo at normal incidence.
    """

    format: Literal["lambent-material"] = FORMAT
    version: Literal[1] = VERSION
    name: str = "material"
    kd: RGB = BLACK
    kd_coupled: bool = False
    kt_d: RGB = BLACK
    lobes: tuple[Lobe, ...] = ()
    provenance: Provenance | None = None

    @property
    def reflection_lobes(self) -> tuple[Lobe, ...]:
        return tuple(lobe for lobe in self.lobes if lobe.side == "reflection")

    @property
    def transmission_lobes(self) -> tuple[Lobe, ...]:
        return tuple(lobe for lobe in self.lobes if lobe.side == "transmission")

    @property
    def transmits(self) -> bool:
        return bool(self.transmission_lobes) or any(self.kt_d)

    def save(self, path: Path) -> None:
        """Write the document, atomically."""
        write_text(path, json.dumps(self.model_dump(mode="json"), indent=2) + "\n")


def load_material(path: Path) -> Material:
    """Read a material document.

    Raises
    ------
    UserError
        The file is not JSON, not a material, of another version, or holds an unknown or impossible field.
    """
    try:
        data = json.loads(read_bytes(path, LIMIT_BYTES).decode("utf-8-sig"))
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise UserError(f"not a JSON document ({error})", file=path) from error
    return material_from(data, path)


def material_from(data: Any, file: Path | str) -> Material:
    """The material of a parsed document; errors name `file`."""
    if not isinstance(data, dict):
        raise UserError("not a material document", file=file, got=type(data).__name__, expected="an object")
    if data.get("version", VERSION) != VERSION:
        raise UserError("unknown version", file=file, field="version", got=data["version"], expected=VERSION)
    try:
        material = Material.model_validate(data)
    except ValidationError as error:
        known = [*Lobe.model_fields, *Material.model_fields, *Provenance.model_fields]
        raise invalid(error, file, known) from error
    if not data.keys() & SCATTERING:
        hint = "a black surface says so: kd = 0"
        raise UserError("has no scattering term", file=file, expected="kd, kt_d or lobes", hint=hint)
    return material
