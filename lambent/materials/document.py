"""The material document: the JSON file that all parts of Lambent and other tools exchange.

Units: kd, kt_d and k are dimensionless RGB coefficients (linear Rec.709); mx, my are slopes (dimensionless roughness
along t and b); r0 is the Fresnel reflectance at normal incidence; alpha is the exponent of the cosine product.

A lobe with `retro` is centred on the direction to the light instead of its mirror image. Its alpha may be negative,
because retro-reflectors lose light towards grazing.

Curves (version 2): a lobe of the distribution "curve" has its `shape`, the relative density of slopes at SHAPE_NODES
radii (`slope_curve`). `fresnel` is the Fresnel reflectance of each channel at COSINE_NODES values of cos_d, and
`kd_curve` a factor of kd in cos_i and in cos_o, both evenly spaced from 0 to 1 and between nodes linear in the fifth
power of 1 - cosine. A document without
curves is written as version 1.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)

from lambent.core.ceilings import LOBES, MATERIAL_BYTES
from lambent.core.errors import UserError, invalid
from lambent.core.files import write_text
from lambent.core.inputs import parse_json, read_bytes

FORMAT: Literal["lambent-material"] = "lambent-material"
VERSIONS = (1, 2)  # version 2 adds curves
SCATTERING = {"kd", "kt_d", "lobes"}  # a document must have at least one
Side = Literal["reflection", "transmission"]
Distribution = Literal["beckmann", "ggx", "curve"]
Kind = Literal["reflection", "transmission", "retro"]
SIDES: tuple[Side, ...] = ("reflection", "transmission")
KINDS: tuple[Kind, ...] = (*SIDES, "retro")


def _spread(value: object) -> object:
    return (value, value, value) if isinstance(value, int | float) else value


COEFFICIENT_MAX = 1e6  # published lobes reach a few hundred; sums and squares of this limit do not overflow
Coefficient = Annotated[float, Field(ge=0, le=COEFFICIENT_MAX, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1)]
RGB = Annotated[tuple[Coefficient, Coefficient, Coefficient], BeforeValidator(_spread)]
SHAPE_NODES, COSINE_NODES = 32, 8
Density = Annotated[float, Field(ge=0, le=1e30, allow_inf_nan=False)]
Shape = Annotated[tuple[Density, ...], Field(min_length=SHAPE_NODES, max_length=SHAPE_NODES)]
Reflectances = Annotated[tuple[Share, ...], Field(min_length=COSINE_NODES, max_length=COSINE_NODES)]
Factors = Annotated[tuple[Coefficient, ...], Field(min_length=COSINE_NODES, max_length=COSINE_NODES)]
LEAST_M, MOST_M = 0.001, 4.0
Roughness = Annotated[float, Field(ge=LEAST_M, le=MOST_M, description="slope roughness, dimensionless")]
BLACK = (0.0, 0.0, 0.0)
LEAST_ALPHA = -4.0  # of a retro lobe; below it the power of the cosines overflows in float32


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Lobe(_Strict):
    """One directional lobe (Kurt et al. 2010; thesis eqs 3.3-3.5); `retro` first mirrors wi about n (Belcour 2014).

    With `fresnel`, r0 is its value at normal incidence.
    """

    side: Side = "reflection"
    distribution: Distribution = "beckmann"
    k: RGB = (1.0, 1.0, 1.0)
    mx: Roughness
    my: Roughness
    r0: Annotated[tuple[Share, Share, Share], BeforeValidator(_spread)] = (0.04, 0.04, 0.04)
    alpha: Annotated[float, Field(ge=LEAST_ALPHA, le=1)] = 0.0
    retro: bool = Field(default=False, exclude_if=lambda retro: not retro)  # keeps other documents unchanged
    shape: Shape | None = Field(default=None, exclude_if=lambda shape: shape is None)
    fresnel: tuple[Reflectances, Reflectances, Reflectances] | None = Field(
        default=None, exclude_if=lambda fresnel: fresnel is None
    )

    @model_validator(mode="after")
    def _is_possible(self) -> Lobe:
        if (self.distribution == "curve") != (self.shape is not None):
            raise ValueError("shape: a lobe has one if, and only if, its distribution is 'curve'")
        if self.shape is not None and not any(self.shape):
            raise ValueError("shape: every value is 0")
        if self.fresnel is not None:
            object.__setattr__(self, "r0", tuple(channel[-1] for channel in self.fresnel))
        if self.retro and self.side == "transmission":
            raise ValueError("a lobe of transmission cannot be retro")
        if self.alpha < 0 and not self.retro:
            raise ValueError("alpha: only a retro lobe can have a negative alpha")
        return self

    @property
    def kind(self) -> Kind:
        """`retro`, or the side."""
        return "retro" if self.retro else self.side

    def of_kind(self, kind: Kind) -> Lobe:
        """The lobe converted to another kind; an alpha valid only for retro lobes becomes 0."""
        side = "transmission" if kind == "transmission" else "reflection"
        alpha = self.alpha if kind == "retro" else max(self.alpha, 0.0)
        return self.model_copy(update={"side": side, "retro": kind == "retro", "alpha": alpha})

    @property
    def has_curves(self) -> bool:
        return self.shape is not None or self.fresnel is not None

    @property
    def mirrors(self) -> bool:
        """Whether the lobe reflects about the mirror direction."""
        return self.kind == "reflection"


class Provenance(_Strict):
    """Origin of a material's numbers: its measurement and its fit."""

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
    kd is then the diffuse albedo at normal incidence. With `kd_curve` it is kd/pi c(cos_i) c(cos_o), with the curve
    normalised so that kd is the albedo under uniform light.
    """

    format: Literal["lambent-material"] = FORMAT
    name: str = "material"
    kd: RGB = BLACK
    kd_coupled: bool = False
    kd_curve: Factors | None = Field(default=None, exclude_if=lambda curve: curve is None)
    kt_d: RGB = BLACK
    lobes: tuple[Lobe, ...] = ()
    provenance: Provenance | None = None

    @model_validator(mode="before")
    @classmethod
    def _of_a_known_version(cls, data: Any) -> Any:
        if not isinstance(data, dict) or "version" not in data:
            return data
        if data["version"] not in VERSIONS:
            raise ValueError(f"version: {data['version']!r} is none of {VERSIONS}")
        return {name: value for name, value in data.items() if name != "version"}

    @model_validator(mode="after")
    def _is_possible(self) -> Material:
        if self.kd_curve is not None and self.kd_coupled:
            raise ValueError("kd_curve: takes the place of kd_coupled, which is set as well")
        if self.kd_curve is not None and not any(self.kd_curve):
            raise ValueError("kd_curve: every value is 0")
        return self

    @model_serializer(mode="wrap")
    def _with_version(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """The fields, and after `format` the least version that can hold them."""
        data = handler(self)
        return {"format": data.pop("format", FORMAT), "version": self.version, **data}

    @property
    def version(self) -> int:
        """The version of the document that holds the material."""
        return 2 if self.kd_curve is not None or any(lobe.has_curves for lobe in self.lobes) else 1

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


def is_document(head: bytes) -> bool:
    """Whether a file that begins with `head` is a material document; a byte order mark is allowed."""
    return head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{")


def load_material(path: Path) -> Material:
    """Read a material document.

    Raises
    ------
    UserError
        If the file is not JSON, not a material, of another version, or has an unknown or invalid field.
    """
    return material_from(parse_json(read_bytes(path, MATERIAL_BYTES), path), path)


def material_from(data: Any, file: Path | str) -> Material:
    """Parse the material of a loaded document; errors name `file`."""
    if not isinstance(data, dict):
        raise UserError("not a material document", file=file, got=type(data).__name__, expected="an object")
    if data.get("version", 1) not in VERSIONS:
        raise UserError("unknown version", file=file, field="version", got=data["version"], expected="1 or 2")
    if isinstance(data.get("lobes"), list):
        LOBES.check(len(data["lobes"]), file=file, field="lobes")
    try:
        material = Material.model_validate(data)
    except ValidationError as error:
        known = [*Lobe.model_fields, *Material.model_fields, *Provenance.model_fields]
        raise invalid(error, file, known) from error
    if not data.keys() & SCATTERING:
        hint = "for a black surface set kd = 0"
        raise UserError("has no scattering term", file=file, expected="kd, kt_d or lobes", hint=hint)
    return material
