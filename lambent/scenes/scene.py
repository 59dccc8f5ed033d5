"""The scene as produced by every loader and consumed by every bake.

Conventions: world space is right-handed, y up, metres. Meshes are stored in world space (loaders apply transforms).
Faces are counter-clockwise seen from outside; normals are unit; uv has v up. Radiance is in W/(sr m^2), linear
Rec.709. All dataclasses are frozen; arrays must not be modified.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lambent.core.light.light_mix import LightMix
from lambent.core.plain import Triple
from lambent.core.surroundings import Axis, Layout
from lambent.core.views.camera import Camera, CameraPath
from lambent.materials.document import Material
from lambent.scenes.grids import Grid
from lambent.scenes.mesh import Mesh as Mesh  # most users of scenes want it too
from lambent.scenes.mesh import boxes_of, corners_of
from lambent.scenes.photometry.distribution import Photometry

Array = NDArray[np.floating]
Border = tuple[float, float, float, float]
UvTransform = tuple[Triple, Triple]
IDENTITY: UvTransform = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
EYE_HEIGHT_M = 1.6  # of a standing person
SUN_RADIUS_DEG = 0.2679  # Mitsuba's aperture of .5358 degrees
LEAST_SUN_DEG, MOST_SUN_DEG = 0.05, 30.0
MOST_POINTS = 0xFFFF  # gather points of a light field: their numbers have 16 bits
LEAST_TEXELS, MOST_TEXELS = 8, 1024  # along a side of a light field's map
Ground = Literal["diffuse", "black"]


@dataclass(frozen=True)
class Texture:
    """Linear values on a surface: texels (H, W, C) float16, row 0 at the top, repeated in u and v.

    A point shows the texel at M (u, v, 1), M = `uv_transform` (2, 3); v is up for the point and for the texture.
    """

    texels: Array
    uv_transform: UvTransform = IDENTITY


@dataclass(frozen=True)
class MaterialTextures:
    """The textures of a material: the first three multiply numbers of its document, the others are absolute.

    The document has the mean of a quantity, so that it is right without its textures; a multiplying texture is texel /
    mean, at most the largest half float. For a masked surface the mean is over its visible texels.

    diffuse (3 channels): kd and kt_d. specular (3): k of every lobe. roughness (1): mx and my of every lobe.
    normal (3): the shading normal in the frame (t, b, n), components from -1 to 1.
    direction (2): cosine and sine of the rotation of t about n.
    opacity (1): below `cutoff` there is no surface.
    """

    diffuse: Texture | None = None
    specular: Texture | None = None
    roughness: Texture | None = None
    normal: Texture | None = None
    direction: Texture | None = None
    opacity: Texture | None = None
    cutoff: float = 0.5


@dataclass(frozen=True)
class SceneObject:
    """A named mesh, the name of its material, and the radiance it emits (one-sided, along the normal).

    `light_map_scale` multiplies its light map texels per metre: small for surfaces that are never seen. An object with
    a `luminaire`, the number of a light of the scene, is its opening: paths see the radiance of its photometry, whose
    mean is `emission`.
    """

    name: str
    mesh: Mesh
    material: str
    emission: Triple = (0.0, 0.0, 0.0)
    light_map_scale: float = 1.0
    luminaire: int | None = None
    moved: tuple[tuple[float, ...], ...] | None = (
        None  # rows of a rigid (4, 4): where paths see it, with its edited lamp
    )


@dataclass(frozen=True)
class SunSky:
    """Clear daylight, up is +y, over a `ground` that is diffuse with the sky's `albedo` and lit by it, or black.

    Colours and distribution are those of Mitsuba's `sunsky` (Hosek-Wilkie), illuminances those of
    `scenes.sky.clear_sky` times `sun_scale` and `sky_scale`. The sun gives the same light for any radius.
    """

    sun_direction: Triple  # unit, towards the sun
    turbidity: float = 3.0
    albedo: float = 0.3
    sun_scale: float = 1.0
    sky_scale: float = 1.0
    sun_radius_deg: float = SUN_RADIUS_DEG
    ground: Ground = "diffuse"


@dataclass(frozen=True)
class ImageEnvironment:
    """A picture of the surroundings, in a layout of `core.pictures.environment_layouts`; None to detect it.

    It is rotated by `rotation_deg` about its own up, from -z towards -x; its up is then aligned with the axis `up`.
    """

    file: Path
    scale: float = 1.0
    rotation_deg: float = 0.0
    layout: Layout | None = None
    up: Axis = "+y"


@dataclass(frozen=True)
class ConstantEnvironment:
    """Equal radiance from all directions."""

    radiance: Triple


@dataclass(frozen=True)
class ComputedEnvironment:
    """Procedural surroundings, by their name in `scenes.sky.computed`."""

    name: str


@dataclass(frozen=True)
class PointLight:
    """Radiant intensity W/sr; `direction` and cone half-angles make it a spot. Its `name` may be empty."""

    position: Triple
    intensity: Triple
    direction: Triple | None = None
    inner_deg: float = 0.0
    outer_deg: float = 180.0
    name: str = ""


@dataclass(frozen=True)
class DirectionalLight:
    """Irradiance W/m^2 on a surface that faces it; `direction` is the direction in which the light travels."""

    direction: Triple
    irradiance: Triple
    name: str = ""


@dataclass(frozen=True)
class IesLight:
    """A luminaire; `scale` is W/sr per candela of its photometry.

    It shines from the object that is its opening (`scenes.photometry.luminous_surfaces`), or else from a point.

    Its axis is `aim`, unit; `rotation_deg` rotates it about that, counter-clockwise seen from behind.
    """

    position: Triple
    photometry: Photometry
    scale: Triple
    aim: Triple = (0.0, -1.0, 0.0)
    rotation_deg: float = 0.0
    name: str = ""

    @property
    def axes(self) -> Array:
        """(3, 3) rows: unit world directions of the horizontal angles 0 and 90, and of vertical angle 0.

        Aimed straight down, horizontal angle 0 is +x and 90 is -z; otherwise both follow the minimal rotation.
        """
        aim, down = np.asarray(self.aim, float), np.array([0.0, -1.0, 0.0])
        angle = np.radians(self.rotation_deg)
        across = np.array([np.cos(angle), 0.0, -np.sin(angle)])
        beside = np.array([-np.sin(angle), 0.0, -np.cos(angle)])
        turn = np.cross(down, aim)
        cosine = float(down @ aim)
        if cosine < -1 + 1e-9:  # straight up: half a turn about x
            return np.array([across * (1, 1, -1), beside * (1, 1, -1), aim])
        turned = [v + np.cross(turn, v) + np.cross(turn, np.cross(turn, v)) / (1 + cosine) for v in (across, beside)]
        return np.array([*turned, aim])

    def turned_to(self, across: Array) -> IesLight:
        """The luminaire rotated about its axis so that horizontal angle 0 is towards `across` (3,), a unit vector."""
        unturned = replace(self, rotation_deg=0.0).axes
        return replace(self, rotation_deg=math.degrees(math.atan2(across @ unturned[1], across @ unturned[0])))


Light = PointLight | DirectionalLight | IesLight
Environment = SunSky | ImageEnvironment | ConstantEnvironment | ComputedEnvironment


@dataclass(frozen=True)
class ReflectorRule:
    """Whether objects with names that match `objects` count as planar reflectors (`scenes.reflectors`).

    `plane` (n, d), n.x + d = 0, replaces the plane that would be found.
    """

    objects: str
    use: bool = True
    plane: tuple[float, float, float, float] | None = None


@dataclass(frozen=True)
class LightGroup:
    """Emitters that are dimmed and coloured together: see `scenes.light_groups`.

    `members` are "sun", "sky", and names of lights and of objects that emit, or patterns with * and ?.
    """

    name: str
    members: tuple[str, ...]


@dataclass(frozen=True)
class ImageTexture:
    """An image file shown as the diffuse texture of a material, `repeat` times as often as the texture it replaces.

    The material's other textures stay. Without a texture to replace, the image fills the unit square of uv.
    """

    file: str
    repeat: float = 1.0

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 - read by pydantic: an unknown key in a file is an error


@dataclass(frozen=True)
class Look:
    """A material as a variant shows it, with the textures of the scene's material of that name; "" for none.

    Instead of a name, `textures` can be an image.
    """

    material: Material
    textures: str | ImageTexture = ""

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 - read by pydantic: an unknown key in a file is an error


@dataclass(frozen=True)
class Variant:
    """A state of the scene's materials and of its light: see `scenes.looks.variants`.

    `looks` are by the name of the material that each replaces; all others stay, as do light groups that the mix `light`
    does not name.
    """

    name: str
    looks: Mapping[str, Look] = field(default_factory=dict)
    light: LightMix = field(default_factory=LightMix)

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012

    @property
    def materials(self) -> dict[str, Material]:
        """The replacing documents, by the names of the replaced materials."""
        return {name: look.material for name, look in self.looks.items()}


@dataclass(frozen=True)
class LightFieldWish:
    """Settings of an object's offset surface light field (`baked.light_fields.light_field`); None lets the bake decide.

    At most `points` points, each with a map of `texels` a side, at `offset_m` off the surface. With an `error`, the
    mean difference in log(1 + L/median) from what viewers see mirrored, the bake uses only as many points as that error
    needs. With `volume`, points fill the object's bounding box, and maps leave the object out, so that another may
    stand there (thesis R, "Object Replacement"). With `refracts`, maps leave it out too, and light that it transmits is
    refracted ("Thin Lens Refractions").
    """

    points: int | None = None
    texels: int | None = None
    offset_m: float | None = None
    error: float | None = None
    volume: bool = False
    refracts: bool = False

    @property
    def without_object(self) -> bool:
        """Whether maps leave the object out."""
        return self.volume or self.refracts


@dataclass(frozen=True)
class Scene:
    """Everything that a bake needs. `sources` are its files, which a bake hashes to detect changes."""

    name: str
    objects: tuple[SceneObject, ...]
    materials: Mapping[str, Material]
    environment: Environment | None = None
    lights: tuple[Light, ...] = ()
    cameras: tuple[Camera, ...] = ()
    paths: tuple[CameraPath, ...] = ()
    exposure_ev: float | None = None  # stops; None: by the first picture (core.exposure)
    sources: tuple[Path, ...] = ()
    warnings: tuple[str, ...] = ()
    textures: Mapping[str, MaterialTextures] = field(default_factory=dict)  # by the material's name
    probe_planes: Mapping[str, Array] = field(default_factory=dict)  # object -> (P, 4) planes, set by the user
    probe_centres: Mapping[str, Triple] = field(default_factory=dict)  # object -> centre of its probe, set by the user
    light_fields: Mapping[str, LightFieldWish] = field(default_factory=dict)  # by object
    reflector_rules: tuple[ReflectorRule, ...] = ()  # the last one that matches an object counts
    variants: tuple[Variant, ...] = ()  # other states of the materials and the light
    light_groups: tuple[LightGroup, ...] = ()  # named by the user; other emitters are in default groups
    grids: tuple[Grid, ...] = ()  # calculation surfaces
    parts: Mapping[str, str] = field(default_factory=dict)  # object that is a part -> name of the whole
    borders: Mapping[str, tuple[Border, ...]] = field(default_factory=dict)  # of parts, as in store.contract
    measured: Mapping[str, Path] = field(default_factory=dict)  # material -> the table that replaces it in bakes
    crease_deg: float | None = None  # angle for which hard edges and normals were recomputed
    caption: str = ""  # a line about the scene, for those who look at it
    credit: str = ""  # whose work it is
    origin: str | None = None  # "builtin:NAME" or the absolute path that it was loaded from; None if made in memory

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Corners (3,), (3,) of the box around all objects, m."""
        boxes = boxes_of([o.mesh for o in self.objects])
        return boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)

    @property
    def openings(self) -> dict[int, str]:
        """Names of the objects that are openings of luminaires, by number of the light."""
        return {o.luminaire: o.name for o in self.objects if o.luminaire is not None}

    @property
    def lamps(self) -> tuple[int, ...]:
        """Numbers of the lights that are at a place: all but directional ones."""
        return tuple(number for number, light in enumerate(self.lights) if isinstance(light, PointLight | IesLight))

    @property
    def corners(self) -> Array:
        """(F, 3, 3) float64 world positions of the corners of all triangles, object after object."""
        return corners_of([o.mesh for o in self.objects])

    def merged(self, same: Mapping[str, str]) -> Scene:
        """With objects of each material named in `same` made of the other one."""
        return replace(self, objects=tuple(replace(o, material=same.get(o.material, o.material)) for o in self.objects))

    def object(self, name: str) -> SceneObject:
        return self._by_name[name]

    @cached_property
    def _by_name(self) -> dict[str, SceneObject]:
        return {o.name: o for o in self.objects}
