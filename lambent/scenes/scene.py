"""What is there: the scene as every loader produces it and every bake consumes it.

Conventions: world space is right-handed, y up, metres. Meshes are stored in world space (loaders apply transforms).
Faces are counter-clockwise seen from the outside; normals unit; uv with v up. Radiance in W/(sr m^2), linear Rec.709.
All dataclasses are frozen; arrays are not to be written to.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.camera import Camera, CameraPath
from lambent.core.plain import Triple
from lambent.materials.document import Material

Array = NDArray[np.floating]
EYE_HEIGHT_M = 1.6  # of a person who stands


@dataclass(frozen=True)
class Mesh:
    """Triangles. positions, normals (V, 3) float32; uv (V, 2) float32; tangents (V, 3) float32; faces (T, 3) uint32.

    `tangents` is the brushing direction t of the shading frame, unit, at right angles to the normal (b = n x t).
    """

    positions: Array
    normals: Array
    tangents: Array
    uv: Array
    faces: NDArray[np.uint32]

    @property
    def bounds(self) -> tuple[Array, Array]:
        return self.positions.min(axis=0), self.positions.max(axis=0)


@dataclass(frozen=True)
class Texture:
    """A picture on a surface, linear values. texels (H, W, C) float16, row 0 at the top, repeated in u and v.

    A point's texel is where M (u, v, 1) lies, M = `uv_transform` (2, 3); both the point's and the picture's v are up.
    """

    texels: Array
    uv_transform: tuple[tuple[float, float, float], tuple[float, float, float]] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@dataclass(frozen=True)
class MaterialTextures:
    """What varies over a surface: each picture multiplies numbers of the material's document, but for the last three.

    The document holds the mean of what varies, so that it is right without its textures; a texture that multiplies is
    texel / mean, at most the largest half float. Of a masked surface the mean is that of what is to be seen.

    diffuse (3 channels): kd and kt_d. specular (3): k of every lobe. roughness (1): mx and my of every lobe.
    normal (3): the shading normal in the frame (t, b, n), components from -1 to 1.
    direction (2): cosine and sine of the angle by which t is turned about n.
    opacity (1): where it is below `cutoff` there is no surface.
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
    """A named thing: a mesh, the name of its material, and the radiance it emits (one-sided, along the normal).

    `light_map_scale` multiplies the texels per metre it gets of the light map: small for what is never seen.
    """

    name: str
    mesh: Mesh
    material: str
    emission: Triple = (0.0, 0.0, 0.0)
    light_map_scale: float = 1.0


@dataclass(frozen=True)
class SunSky:
    """Clear daylight by Mitsuba's `sunsky` (Hosek-Wilkie), up is +y, over a diffuse ground of the same `albedo`."""

    sun_direction: Triple  # unit, towards the sun
    turbidity: float = 3.0
    albedo: float = 0.3
    sun_scale: float = 1.0
    sky_scale: float = 1.0


@dataclass(frozen=True)
class ImageEnvironment:
    """A lat-long HDR picture; its top is +y, its middle column looks along -z."""

    file: Path
    scale: float = 1.0
    rotation_deg: float = 0.0  # about +y


@dataclass(frozen=True)
class ConstantEnvironment:
    """The same radiance from everywhere."""

    radiance: Triple


@dataclass(frozen=True)
class PointLight:
    """Radiant intensity W/sr; `direction` and cone half-angles make it a spot."""

    position: Triple
    intensity: Triple
    direction: Triple | None = None
    inner_deg: float = 0.0
    outer_deg: float = 180.0


@dataclass(frozen=True)
class DirectionalLight:
    """Irradiance W/m^2 on a surface that faces it; `direction` is the way the light travels."""

    direction: Triple
    irradiance: Triple


Light = PointLight | DirectionalLight
Environment = SunSky | ImageEnvironment | ConstantEnvironment


@dataclass(frozen=True)
class ReflectorRule:
    """What the scene says of planar reflectors (scenes.reflectors): objects whose name fits `objects` are or are not.

    `plane` (n, d), n.x + d = 0, stands in for what would be found.
    """

    objects: str
    use: bool = True
    plane: tuple[float, float, float, float] | None = None


@dataclass(frozen=True)
class Scene:
    """Everything a bake needs. `sources` are the files it was read from: a bake hashes them to notice a change."""

    name: str
    objects: tuple[SceneObject, ...]
    materials: Mapping[str, Material]
    environment: Environment | None = None
    lights: tuple[Light, ...] = ()
    cameras: tuple[Camera, ...] = ()
    paths: tuple[CameraPath, ...] = ()
    exposure_ev: float = 0.0
    sources: tuple[Path, ...] = ()
    warnings: tuple[str, ...] = ()
    textures: Mapping[str, MaterialTextures] = field(default_factory=dict)  # by the material's name
    probe_planes: Mapping[str, Array] = field(default_factory=dict)  # object name -> (P, 4) user-given planes
    probe_centres: Mapping[str, Triple] = field(default_factory=dict)  # where not the centre of the object's bounds
    reflector_rules: tuple[ReflectorRule, ...] = ()  # the last that fits an object counts
    parts: Mapping[str, str] = field(default_factory=dict)  # object that is a part -> name of the whole
    measured: Mapping[str, Path] = field(default_factory=dict)  # material -> the table it scatters by in bakes

    @property
    def bounds(self) -> tuple[Array, Array]:
        lows, highs = zip(*(o.mesh.bounds for o in self.objects), strict=True)
        return np.min(lows, axis=0), np.max(highs, axis=0)

    @property
    def corners(self) -> Array:
        """(F, 3, 3) float64 world positions of the corners of all triangles, object after object."""
        return np.concatenate([o.mesh.positions[o.mesh.faces] for o in self.objects]).astype(float)

    def object(self, name: str) -> SceneObject:
        return next(o for o in self.objects if o.name == name)
