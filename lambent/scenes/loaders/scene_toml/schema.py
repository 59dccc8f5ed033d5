"""The keys of a scene.toml, and the scene values of each section. Unknown keys are errors."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, field_validator, model_validator

from lambent.core.ceilings import VARIANTS
from lambent.core.light.exposure import exposure_of
from lambent.core.surroundings import Axis, Layout
from lambent.core.views.camera import Camera, CameraPath
from lambent.scenes.light_groups import MOST_GROUPS
from lambent.scenes.loaders.scene_toml.grids import GridSection
from lambent.scenes.loaders.scene_toml.lamps import LightSection, one_of
from lambent.scenes.loaders.scene_toml.sections import (
    Colour,
    Finite,
    NotNegative,
    Place,
    Plane,
    Positive,
    Section,
    Vector,
    not_zero,
    unit,
)
from lambent.scenes.scene import (
    LEAST_SUN_DEG,
    LEAST_TEXELS,
    MOST_POINTS,
    MOST_SUN_DEG,
    MOST_TEXELS,
    SUN_RADIUS_DEG,
    ComputedEnvironment,
    ConstantEnvironment,
    Ground,
    LightFieldWish,
    LightGroup,
    SunSky,
)
from lambent.scenes.sky.computed import COMPUTED

FORMAT = "lambent-scene"


class GeometrySection(Section):
    """A file, or a built-in scene's geometry; `scale` turns its unit into metres, `up` is the file's own axis."""

    file: str
    scale: Positive = 1.0
    up: Axis = "+y"


class SunSkySection(Section):
    """Clear daylight (Hosek & Wilkie 2012, 2013)."""

    kind: Literal["sunsky"]
    sun_direction: Vector
    turbidity: Annotated[float, Field(ge=1, le=10)] = 3.0
    albedo: Annotated[float, Field(ge=0, le=1)] = 0.3
    sun_scale: NotNegative = 1.0
    sky_scale: NotNegative = 1.0
    sun_radius_deg: Annotated[float, Field(ge=LEAST_SUN_DEG, le=MOST_SUN_DEG)] = SUN_RADIUS_DEG
    ground: Ground = "diffuse"

    @field_validator("sun_direction")
    @classmethod
    def _above_horizon(cls, vector: Any) -> Any:
        if vector[1] < 0:
            raise ValueError("the sun is below the horizon (its y is negative)")
        return not_zero(vector)

    def environment(self) -> SunSky:
        return SunSky(**{**self.model_dump(exclude={"kind"}), "sun_direction": unit(self.sun_direction)})


class ImageSection(Section):
    """An HDR picture of the surroundings; its layout is detected if not given."""

    kind: Literal["image"]
    file: str
    scale: NotNegative = 1.0
    rotation_deg: Finite = 0.0
    layout: Layout | None = None
    up: Axis = "+y"


class ConstantSection(Section):
    """Equal radiance from all directions."""

    kind: Literal["constant"]
    radiance: Colour

    def environment(self) -> ConstantEnvironment:
        return ConstantEnvironment(self.radiance)


class ComputedSection(Section):
    """An environment of `scenes.sky.computed`."""

    kind: Literal["computed"]
    name: str

    @field_validator("name")
    @classmethod
    def _is_known(cls, name: str) -> str:
        if name not in COMPUTED:
            raise ValueError(f"unknown computed environment {name!r}; expected {', '.join(sorted(COMPUTED))}")
        return name

    def environment(self) -> ComputedEnvironment:
        return ComputedEnvironment(self.name)


class LightFieldSection(Section):
    """An offset surface light field: see `scenes.scene.LightFieldWish`. `true` and `false` stand for its `use`."""

    use: bool = True
    points: Annotated[int, Field(ge=1, le=MOST_POINTS)] | None = None
    texels: Annotated[int, Field(ge=LEAST_TEXELS, le=MOST_TEXELS)] | None = None
    offset_m: Annotated[float, Field(gt=0, le=1000)] | None = None
    error: Positive | None = None
    volume: bool = False
    refracts: bool = False

    @model_validator(mode="after")
    def _one_place(self) -> LightFieldSection:
        if self.volume and self.refracts:
            raise ValueError(
                "volume (for a replacement of the object) and refracts (for the object itself) exclude each other"
            )
        if self.volume and (self.offset_m is not None or self.error is not None):
            raise ValueError("offset_m and error apply to points on the surface, not to a volume")
        return self

    @property
    def wish(self) -> LightFieldWish:
        return LightFieldWish(**self.model_dump(exclude={"use"}))


class ObjectSection(Section):
    """Settings of the objects whose name matches a pattern; settings left out stay as in the geometry file."""

    material: str | None = None
    emission: Colour | None = None  # W/(sr m^2); or luminance, cd/m^2; or lumens of each object, with a colour
    luminance: NotNegative | None = None
    lumens: NotNegative | None = None
    colour: Colour | None = None
    light_map_scale: Positive | None = None
    probe_centre: Vector | None = None
    probe_planes: tuple[Plane, ...] | None = None
    light_field: LightFieldSection | None = None

    @field_validator("light_field", mode="before")
    @classmethod
    def _table_or_flag(cls, value: Any) -> Any:
        if isinstance(value, bool):
            return {"use": value}
        if not isinstance(value, dict):
            raise ValueError("must be true, false, or a table of points, texels, offset_m and error")
        return value

    @model_validator(mode="after")
    def _one_light(self) -> ObjectSection:
        one_of(self, "emission", "luminance", "lumens", needed=False)
        return self

    @field_validator("probe_planes")
    @classmethod
    def _planes(cls, planes: Any) -> Any:
        for plane in planes or ():
            not_zero(plane[:3])
        return planes


class ViewSection(Section):
    """A camera without a name."""

    position: Place
    target: Place
    up: Place = (0.0, 1.0, 0.0)
    fov_y_deg: Annotated[float, Field(ge=1, le=150)] = 45.0

    @model_validator(mode="after")
    def _looks_somewhere(self) -> ViewSection:
        if self.position == self.target:
            raise ValueError("position and target coincide")
        return self

    def camera(self, name: str) -> Camera:
        return Camera(name, self.position, self.target, self.up, self.fov_y_deg)


class CameraSection(ViewSection):
    name: str


class PathSection(Section):
    """Keys passed at constant speed, or at `times_s`, which start at 0 and end at `seconds`."""

    name: str
    seconds: Positive = 20.0
    times_s: tuple[NotNegative, ...] | None = None
    keys: Annotated[tuple[ViewSection, ...], Field(min_length=2)]

    @model_validator(mode="after")
    def _timed(self) -> PathSection:
        times = self.times_s
        if times is None:
            return self
        ends = times[:1] == (0,) and times[-1:] == (self.seconds,)
        if len(times) != len(self.keys) or not ends or any(b <= a for a, b in pairwise(times)):
            raise ValueError("times_s has an increasing time for each key, from 0 to seconds")
        return self

    def path(self) -> CameraPath:
        keys = tuple(k.camera(f"{self.name}_{i}") for i, k in enumerate(self.keys))
        return CameraPath(self.name, keys, self.seconds, self.times_s)


class ReflectorSection(Section):
    """Objects that are, or are not, planar reflectors; see `scenes.reflectors`."""

    objects: str
    use: bool = True
    plane: Plane | None = None

    @field_validator("plane")
    @classmethod
    def _plane(cls, plane: Any) -> Any:
        if plane is not None:
            not_zero(plane[:3])
        return plane


class LightGroupSection(Section):
    """Emitters that are dimmed together; see `scenes.light_groups`."""

    name: Annotated[str, Field(min_length=1, max_length=40)]
    members: Annotated[tuple[str, ...], Field(min_length=1)]

    def group(self) -> LightGroup:
        return LightGroup(self.name, self.members)


class VariantSection(Section):
    """Other looks of materials, by name; other materials of objects, by pattern; a mix of light groups."""

    name: Annotated[str, Field(min_length=1, max_length=80)]
    materials: dict[str, dict[str, Any]] = Field(default_factory=dict)
    objects: dict[str, str] = Field(default_factory=dict)
    light: dict[str, str | NotNegative] = Field(default_factory=dict)


EnvironmentSection = SunSkySection | ImageSection | ConstantSection | ComputedSection


class SceneDocument(Section):
    """A whole scene.toml."""

    format: Literal["lambent-scene"]
    version: Literal[1]
    name: str = "scene"
    caption: str = ""
    credit: str = ""
    geometry: Annotated[tuple[GeometrySection, ...], Field(min_length=1)]
    exposure_ev: Annotated[float, Field(ge=-30, le=30)] | None = None
    exposure_ev100: Annotated[float, Field(ge=-30, le=30)] | None = None
    environment: Annotated[EnvironmentSection, Field(discriminator="kind")] | None = None
    crease_angle: Annotated[float, Field(ge=0, le=180)] | None = None  # degrees; see `load_scene`
    variant: str | None = None  # a material set of the geometry files
    materials: dict[str, dict[str, Any]] = Field(default_factory=dict)
    measured: dict[str, str] = Field(default_factory=dict)  # material -> file of the table that replaces it in bakes
    assign: dict[str, str] = Field(default_factory=dict)  # pattern over objects and materials -> material
    objects: dict[str, ObjectSection] = Field(default_factory=dict)
    lights: tuple[Annotated[LightSection, Field(discriminator="kind")], ...] = ()
    light_groups: Annotated[tuple[LightGroupSection, ...], Field(max_length=MOST_GROUPS - 1)] = ()
    variants: Annotated[tuple[VariantSection, ...], Field(max_length=VARIANTS.most)] = ()
    cameras: tuple[CameraSection, ...] = ()
    reflectors: tuple[ReflectorSection, ...] = ()
    paths: tuple[PathSection, ...] = ()
    grids: tuple[GridSection, ...] = ()

    @property
    def exposure(self) -> float | None:
        """Stops on radiance; None: metered from the first picture."""
        return self.exposure_ev if self.exposure_ev100 is None else exposure_of(self.exposure_ev100)

    @model_validator(mode="after")
    def _one_exposure(self) -> SceneDocument:
        if self.exposure_ev is not None and self.exposure_ev100 is not None:
            raise ValueError("has two exposures, exposure_ev and exposure_ev100")
        return self

    @field_validator("geometry", mode="before")
    @classmethod
    def _one_or_many(cls, value: Any) -> Any:
        if not isinstance(value, str | dict | list):
            raise ValueError("names no file")
        entries = value if isinstance(value, list) else [value]
        return [{"file": entry} if isinstance(entry, str) else entry for entry in entries]


def known_keys() -> set[str]:
    """Every key of a scene.toml."""
    sections: list[type[BaseModel]] = [SceneDocument, *_below(Section)]
    return {key for section in sections for key in section.model_fields}


def _below(section: type[BaseModel]) -> list[type[BaseModel]]:
    return [s for child in section.__subclasses__() for s in (child, *_below(child))]
