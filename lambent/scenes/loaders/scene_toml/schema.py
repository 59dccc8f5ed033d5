"""The keys of a scene.toml, and the scene's values of each section. Unknown keys are errors."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from lambent.core.camera import Camera, CameraPath
from lambent.core.plain import Triple, triple
from lambent.core.surroundings import Axis, Layout
from lambent.scenes.interiors import INTERIORS
from lambent.scenes.scene import ComputedEnvironment, ConstantEnvironment, DirectionalLight, PointLight, SunSky

FORMAT = "lambent-scene"

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Vector = tuple[Finite, Finite, Finite]
Colour = tuple[NotNegative, NotNegative, NotNegative]
Plane = tuple[Finite, Finite, Finite, Finite]


def _not_zero(vector: Any) -> Any:
    if not any(vector):
        raise ValueError("a direction cannot be zero")
    return vector


def _unit(vector: Triple) -> Triple:
    return triple(np.asarray(vector, float) / np.linalg.norm(vector))


class Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class GeometrySection(Section):
    """A file, or a built-in scene's geometry; `scale` turns its unit into metres."""

    file: str
    scale: Positive = 1.0


class SunSkySection(Section):
    """Clear daylight (Hosek & Wilkie 2012, 2013)."""

    kind: Literal["sunsky"]
    sun_direction: Vector
    turbidity: Annotated[float, Field(ge=1, le=10)] = 3.0
    albedo: Annotated[float, Field(ge=0, le=1)] = 0.3
    sun_scale: NotNegative = 1.0
    sky_scale: NotNegative = 1.0

    @field_validator("sun_direction")
    @classmethod
    def _above_horizon(cls, vector: Any) -> Any:
        if vector[1] < 0:
            raise ValueError("the sun is below the horizon (its y is negative)")
        return _not_zero(vector)

    def environment(self) -> SunSky:
        return SunSky(_unit(self.sun_direction), self.turbidity, self.albedo, self.sun_scale, self.sky_scale)


class ImageSection(Section):
    """An HDR picture of everything around; its layout is recognised where it is not said."""

    kind: Literal["image"]
    file: str
    scale: NotNegative = 1.0
    rotation_deg: Finite = 0.0
    layout: Layout | None = None
    up: Axis = "+y"


class ConstantSection(Section):
    """The same radiance from everywhere."""

    kind: Literal["constant"]
    radiance: Colour

    def environment(self) -> ConstantEnvironment:
        return ConstantEnvironment(self.radiance)


class ComputedSection(Section):
    """An interior of `scenes.interiors`."""

    kind: Literal["computed"]
    name: str

    @field_validator("name")
    @classmethod
    def _is_known(cls, name: str) -> str:
        if name not in INTERIORS:
            raise ValueError(f"there is no computed environment {name!r}, but {', '.join(sorted(INTERIORS))}")
        return name

    def environment(self) -> ComputedEnvironment:
        return ComputedEnvironment(self.name)


class ObjectSection(Section):
    """Settings of the objects whose name fits a pattern; those left out stay as in the geometry file."""

    material: str | None = None
    emission: Colour | None = None
    light_map_scale: Positive | None = None
    probe_centre: Vector | None = None
    probe_planes: tuple[Plane, ...] | None = None

    @field_validator("probe_planes")
    @classmethod
    def _planes(cls, planes: Any) -> Any:
        for plane in planes or ():
            _not_zero(plane[:3])
        return planes


class PointSection(Section):
    kind: Literal["point"]
    position: Vector
    intensity: Colour

    def light(self) -> PointLight:
        return PointLight(self.position, self.intensity)


class SpotSection(Section):
    kind: Literal["spot"]
    position: Vector
    intensity: Colour
    direction: Vector
    inner_deg: Annotated[float, Field(ge=0, le=90)] = 0.0
    outer_deg: Annotated[float, Field(gt=0, le=90)] = 45.0

    _direction = field_validator("direction")(_not_zero)

    @model_validator(mode="after")
    def _cone(self) -> SpotSection:
        if self.inner_deg > self.outer_deg:
            raise ValueError("inner_deg is larger than outer_deg")
        return self

    def light(self) -> PointLight:
        return PointLight(self.position, self.intensity, _unit(self.direction), self.inner_deg, self.outer_deg)


class DirectionalSection(Section):
    kind: Literal["directional"]
    direction: Vector
    irradiance: Colour

    _direction = field_validator("direction")(_not_zero)

    def light(self) -> DirectionalLight:
        return DirectionalLight(_unit(self.direction), self.irradiance)


class ViewSection(Section):
    """A camera without a name."""

    position: Vector
    target: Vector
    up: Vector = (0.0, 1.0, 0.0)
    fov_y_deg: Annotated[float, Field(ge=1, le=150)] = 45.0

    @model_validator(mode="after")
    def _looks_somewhere(self) -> ViewSection:
        if self.position == self.target:
            raise ValueError("position and target are the same point")
        return self

    def camera(self, name: str) -> Camera:
        return Camera(name, self.position, self.target, self.up, self.fov_y_deg)


class CameraSection(ViewSection):
    name: str


class PathSection(Section):
    name: str
    seconds: Positive = 20.0
    keys: Annotated[tuple[ViewSection, ...], Field(min_length=2)]

    def path(self) -> CameraPath:
        return CameraPath(self.name, tuple(k.camera(f"{self.name}_{i}") for i, k in enumerate(self.keys)), self.seconds)


class ReflectorSection(Section):
    """Objects that are, or are not, planar reflectors; see `scenes.reflectors`."""

    objects: str
    use: bool = True
    plane: Plane | None = None

    @field_validator("plane")
    @classmethod
    def _plane(cls, plane: Any) -> Any:
        if plane is not None:
            _not_zero(plane[:3])
        return plane


EnvironmentSection = SunSkySection | ImageSection | ConstantSection | ComputedSection


class SceneDocument(Section):
    """A whole scene.toml."""

    format: Literal["lambent-scene"]
    version: Literal[1]
    name: str = "scene"
    geometry: Annotated[tuple[str | GeometrySection, ...], Field(min_length=1)]
    exposure_ev: Annotated[float, Field(ge=-30, le=30)] = 0.0
    environment: Annotated[EnvironmentSection, Field(discriminator="kind")] | None = None
    crease_angle: Annotated[float, Field(ge=0, le=180)] | None = None  # degrees; edges of larger ones are hard
    variant: str | None = None  # a material set of the geometry files
    materials: dict[str, dict[str, Any]] = Field(default_factory=dict)
    measured: dict[str, str] = Field(default_factory=dict)  # material -> file of the table it scatters by in bakes
    assign: dict[str, str] = Field(default_factory=dict)  # pattern over objects and materials -> material
    objects: dict[str, ObjectSection] = Field(default_factory=dict)
    lights: tuple[Annotated[PointSection | SpotSection | DirectionalSection, Field(discriminator="kind")], ...] = ()
    cameras: tuple[CameraSection, ...] = ()
    reflectors: tuple[ReflectorSection, ...] = ()
    paths: tuple[PathSection, ...] = ()

    @field_validator("geometry", mode="before")
    @classmethod
    def _one_or_many(cls, value: Any) -> Any:
        return [value] if isinstance(value, str | dict) else value


def known_keys() -> set[str]:
    """Every key of a scene.toml."""
    sections: list[type[BaseModel]] = [SceneDocument, *_below(Section)]
    return {key for section in sections for key in section.model_fields}


def _below(section: type[BaseModel]) -> list[type[BaseModel]]:
    return [s for child in section.__subclasses__() for s in (child, *_below(child))]
