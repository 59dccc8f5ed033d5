"""Mitsuba's emitters and sensors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from lambent.core.geometry.directions import Floats, normalize
from lambent.core.light.photometry import LM_PER_W
from lambent.core.plain import Triple, triple
from lambent.core.views.camera import Camera
from lambent.scenes.loaders.contents import DAYLIGHT
from lambent.scenes.loaders.mitsuba.values import Plugin, colour
from lambent.scenes.loaders.surfaces.surface import rgb
from lambent.scenes.scene import (
    LEAST_SUN_DEG,
    MOST_SUN_DEG,
    SUN_RADIUS_DEG,
    ConstantEnvironment,
    DirectionalLight,
    Environment,
    ImageEnvironment,
    Light,
    PointLight,
    SunSky,
)

ENVIRONMENTS = ("envmap", "constant", "sunsky", "sky", "sun")
UPRIGHT = 0.9995  # cosine of a negligible tilt
SKY_UNIT = 683.0 * 106.856 / LM_PER_W  # W/(sr m^2) of 1 W/(sr m^2 nm), the unit of all light in a file with a sky


def environment_of(plugin: Plugin, world: Floats) -> Environment | None:
    """The environment of an emitter; `world` (4, 4) rotates the file's world into ours."""
    matrix = world @ plugin.transform()
    made: Environment | None
    if plugin.type == "constant":
        made = ConstantEnvironment(rgb(colour(plugin, "radiance", 1.0, emitted=True).mean))
    elif plugin.type == "envmap":
        made = _picture(plugin, matrix)
    else:
        made = _daylight(plugin, world, matrix)
    plugin.note_unread()
    return made


def _picture(plugin: Plugin, matrix: Floats) -> Environment | None:
    """Mitsuba's pictures have +y at the top, like ours, but +z in the middle, where ours have -z."""
    path = plugin.file()
    if not path.is_file():
        plugin.note(f"picture {plugin.text('filename')} is missing: left out")
        return None
    plugin.reading.files.use(path)
    axes = matrix[:3, :3] / np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-12)
    if axes[1, 1] < UPRIGHT:
        plugin.note("its tilt is ignored")
    if np.linalg.det(axes) < 0:
        plugin.note("its mirroring is ignored")
    gamma = plugin.number("gamma", 0.0)
    if gamma > 0:
        plugin.note("its gamma is ignored")
    turned_deg = math.degrees(math.atan2(axes[0, 2], axes[2, 2]))
    rotation_deg = turned_deg % 360 - 180
    return ImageEnvironment(path, plugin.number("scale", 1.0), round(rotation_deg, 4), "lat-long")


def _daylight(plugin: Plugin, world: Floats, matrix: Floats) -> SunSky:
    """sunsky, sky or sun; in version 3 its own up is z, in 0.6 y."""
    up = normalize(matrix[:3, :3] @ ([0.0, 1.0, 0.0] if plugin.reading.document.is_old else [0.0, 0.0, 1.0]))
    if up[1] < UPRIGHT:
        plugin.note("its tilt is ignored")
    given = plugin.vector("sun_direction")
    if given is not None and given.any():
        towards = normalize(world[:3, :3] @ given)
    else:
        plugin.note("place and time are ignored: the sun is at Lambent's default")
        plugin.ignore("latitude", "longitude", "timezone", "year", "month", "day", "hour", "minute", "second")
        towards = np.array(DAYLIGHT.sun_direction)
    if towards[1] < 0:
        plugin.note("its sun is below the horizon: moved up to it")
        towards = normalize(np.array([towards[0] + 1e-9, 0.0, towards[2]]))
    scale = plugin.number("scale", 1.0)
    plugin.ignore("resolution", "stretch")
    plugin.note("a diffuse ground of its albedo is added below the horizon")
    return SunSky(
        triple(towards),
        turbidity=min(max(plugin.number("turbidity", 3.0), 1.0), 10.0),
        albedo=float(np.clip(colour(plugin, "albedo", 0.3).mean.mean(), 0, 1)),
        sun_scale=0.0 if plugin.type == "sky" else scale * plugin.number("sun_scale", 1.0),
        sky_scale=0.0 if plugin.type == "sun" else scale * plugin.number("sky_scale", 1.0),
        sun_radius_deg=_sun_radius_deg(plugin),
    )


def _sun_radius_deg(plugin: Plugin) -> float:
    """Of `sunRadiusScale` (0.6) or `sun_aperture`, the whole angle in degrees (3); neither changes the sun's power."""
    aperture_deg = plugin.number("sun_aperture", 2 * SUN_RADIUS_DEG)
    wanted = aperture_deg / 2 * plugin.number("sun_radius_scale", 1.0)
    radius_deg = min(max(wanted, LEAST_SUN_DEG), MOST_SUN_DEG)
    if radius_deg != wanted:
        plugin.note(f"its sun's radius of {wanted:g} degrees becomes {radius_deg:g}")
    return radius_deg


def light_of(plugin: Plugin, world: Floats) -> PointLight | DirectionalLight | None:
    """A light without extent; None, with a warning, if its kind is unknown."""
    matrix, name = world @ plugin.transform(), plugin.element.id or ""
    made: PointLight | DirectionalLight
    if plugin.type == "point":
        position = plugin.vector("position")
        at = matrix[:3, 3] if position is None else matrix[:3, :3] @ position + matrix[:3, 3]
        made = PointLight(triple(at), _emitted(plugin, "intensity"), name=name)
    elif plugin.type == "spot":
        outer = min(max(plugin.number("cutoff_angle", 20.0), 0.01), 90.0)
        inner = min(max(plugin.number("beam_width", outer * 0.75), 0.0), outer)
        direction = triple(normalize(matrix[:3, 2]))
        made = PointLight(triple(matrix[:3, 3]), _emitted(plugin, "intensity"), direction, inner, outer, name)
    elif plugin.type == "directional":
        given = plugin.vector("direction")
        direction_world = matrix[:3, 2] if given is None else matrix[:3, :3] @ given
        if not direction_world.any():
            raise plugin.element.error("direction is zero")
        made = DirectionalLight(triple(normalize(direction_world)), _emitted(plugin, "irradiance"), name)
    else:
        plugin.note("left out, unknown kind of emitter")
        return None
    plugin.note_unread()
    return made


def in_sky_units(light: PointLight | DirectionalLight) -> Light:
    """A light of a file with a sky, in Lambent's units."""
    if isinstance(light, PointLight):
        return replace(light, intensity=scaled(light.intensity))
    return replace(light, irradiance=scaled(light.irradiance))


def scaled(light: Triple) -> Triple:
    """Values of light of a file with a sky, in Lambent's units."""
    return triple(SKY_UNIT * np.array(light))


def emission_of(shape: Plugin) -> Triple:
    """Radiance of a shape's area emitter."""
    plugin = next(iter(shape.objects("emitter")), None)
    if plugin is not None and plugin.type != "area":
        plugin.note("left out, a shape can have only area emitters")
    if plugin is None or plugin.type != "area":
        return 0.0, 0.0, 0.0
    radiance = _emitted(plugin, "radiance")
    plugin.note_unread()
    return radiance


def _emitted(plugin: Plugin, name: str) -> Triple:
    """Linear RGB of an emitter's parameter, times its scale."""
    value = colour(plugin, name, 1.0, emitted=True)
    if value.is_texture:
        plugin.note(f"its {name} is averaged over its texture")
    return rgb(plugin.number("scale", 1.0) * value.mean)


def camera_of(plugin: Plugin, name: str, world: Floats) -> Camera | None:
    """A perspective camera; None, with a warning, for other kinds."""
    if plugin.type not in ("perspective", "thinlens"):
        plugin.note("left out, only perspective cameras are supported")
        return None
    if plugin.type == "thinlens":
        plugin.note("its depth of field is ignored")
        plugin.ignore("aperture_radius", "focus_distance")
    if plugin.has("principal_point_offset_x", "principal_point_offset_y"):
        plugin.note("its principal point is moved to the middle")
        plugin.ignore("principal_point_offset_x", "principal_point_offset_y")
    film = next(iter(plugin.objects("film")), None)
    width, height = (film.number(n, d) if film else d for n, d in (("width", 768.0), ("height", 576.0)))
    if min(width, height) <= 0:
        raise plugin.element.error("film has no size", got=f"{width} x {height}")
    matrix = world @ plugin.transform()
    if np.linalg.det(matrix[:3, :3]) < 0:
        plugin.note("its mirroring is ignored")
    fov_y_deg = min(max(_fov_y_deg(plugin, width / height), 1.0), 150.0)
    plugin.objects("sampler")
    plugin.ignore("focus_distance")
    plugin.note_unread()
    position, ahead, up = matrix[:3, 3], normalize(matrix[:3, 2]), normalize(matrix[:3, 1])
    return Camera(name, triple(position), triple(position + ahead), triple(up), fov_y_deg)


def _fov_y_deg(plugin: Plugin, aspect: float) -> float:
    """Full vertical field of view; Mitsuba's is horizontal by default."""
    length = plugin.text("focal_length", "50mm")
    axis = plugin.text("fov_axis", "x").lower()
    if plugin.has("fov"):
        fov_deg = plugin.number("fov", 45.0)
        if not 0 < fov_deg < 180:
            raise plugin.element.error("field of view is out of range", got=fov_deg, expected="between 0 and 180")
        half = math.tan(math.radians(fov_deg) / 2)
    else:  # of a 35 mm film, along its diagonal
        try:
            half = math.hypot(36, 24) / 2 / float(length.lower().removesuffix("mm"))
        except (ValueError, ZeroDivisionError) as error:
            raise plugin.element.error("not a focal length", got=length, expected='such as "50mm"') from error
        axis = "diagonal"
    if axis == "smaller":
        axis = "x" if aspect < 1 else "y"
    elif axis == "larger":
        axis = "y" if aspect < 1 else "x"
    if axis == "diagonal":
        half = half / math.hypot(aspect, 1)
    elif axis == "x":
        half = half / aspect
    elif axis != "y":
        raise plugin.element.error("unknown fov_axis", got=axis, expected="x, y, diagonal, smaller or larger")
    return math.degrees(2 * math.atan(half))
